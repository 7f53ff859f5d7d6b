"""The drives that a user names, and those that an experiment makes."""

from collections.abc import Sequence
from pathlib import Path

from cns_drake.scenarios import (
    Scenario,
    check_written_scenarios,
    load_scenario,
    write_scenarios,
)
from cns_drake.studies.maps.experiment_maps import pairs_by_map
from cns_drake.studies.pairs.changed_pairs import changed_pairs
from evaluation.base import Cluster, InputError, note
from evaluation.study import ExperimentRun, load_experiment
from worlds.maps import recordable_drives


def named_drives(
    names: Sequence[str], vary: str | None, output: Path, cluster: Cluster
) -> list[Scenario]:
    """Returns the named drives, and after them those of an experiment.

    If neither is given, these are all shipped drives. The scenario files of an
    experiment's drives are written to `<output>/scenarios`, and cities that it
    makes to `<output>/cities`.

    Args:
        names: names of shipped drives, or scenario files.
        vary: name of a shipped experiment, or an experiment file, if any.
        output: folder for what is made of the drives.
        cluster: runs the jobs that make cities.

    Raises:
        InputError: a drive or the experiment cannot be used, or a file is in
            the way.
    """
    if not names and vary is None:
        names = list(recordable_drives())
    chosen = [load_scenario(name) for name in names]
    if vary is not None:
        varied = _varied_drives(vary, output, cluster)
        chosen += [drive for drive in varied if drive not in chosen]
    return chosen


def _varied_drives(vary: str, output: Path, cluster: Cluster) -> list[Scenario]:
    # Nothing is measured, and no program of the experiment runs.
    unused = {"tasks": {"place": {}}, "methods": {"solid": {}}, "charts": []}
    experiment = load_experiment(vary, list(unused.items()))
    check_written_scenarios(output / "scenarios")
    run = ExperimentRun(experiment, output.absolute(), vary, cluster, note)
    members = study_drives(run)
    write_scenarios(members, output / "scenarios")
    return members


def study_drives(
    run: ExperimentRun, maps: Sequence[str] = ()
) -> list[Scenario]:
    """Returns all drives that an experiment compares, after making its maps.

    Args:
        run: the experiment, and where it runs.
        maps: names or folders of maps that replace the experiment's maps.

    Raises:
        InputError: a map cannot be used, no drive of it can be simulated, or
            two drives have the same name.
    """
    found = list(pairs_by_map(run, maps))
    drives: dict[str, Scenario] = {}
    for changed in changed_pairs(run, found):
        for one in changed:
            for drive in one.drives:
                if drives.setdefault(drive.name, drive) != drive:
                    raise InputError(
                        f"{run.source}: two drives are named {drive.name}"
                    )
    return list(drives.values())
