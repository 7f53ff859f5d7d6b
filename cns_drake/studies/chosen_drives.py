"""The drives that a user names, and those that an experiment makes."""

from collections.abc import Sequence
from pathlib import Path

from cns_drake.scenarios import (
    Scenario,
    check_written_scenarios,
    load_scenario,
    write_scenarios,
)
from cns_drake.studies.study import study_drives
from evaluation.base import Cluster, note
from evaluation.study import Study, load_experiment
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
    study = Study(experiment, output.absolute(), vary, cluster, note)
    members = study_drives(study)
    write_scenarios(members, output / "scenarios")
    return members
