"""The drives that a user names, and those that an experiment makes."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cns_drake.scenarios import (
    Scenario,
    check_written_scenarios,
    load_scenario,
    write_scenarios,
)
from cns_drake.studies.maps.experiment_maps import pairs_by_map
from cns_drake.studies.pairs.changed_pairs import (
    changed_pairs,
    simulated_drives,
)
from evaluation.base import Cluster, InputError, check_writable, note, write_csv
from evaluation.results import CAUSE
from evaluation.study import ExperimentRun, Pair, load_experiment
from worlds.maps import recordable_drives


def named_drives(
    names: Sequence[str], vary: str | None, output: Path, cluster: Cluster
) -> list[Scenario]:
    """Returns the named drives, and after them those of an experiment.

    If neither is given, these are all shipped drives. The scenario files of an
    experiment's drives are written to `<output>/scenarios`, the pairs that it
    compares to `<output>/pairs.csv`, and cities that it makes to
    `<output>/cities`.

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
    check_writable(output / "pairs.csv")
    run = ExperimentRun(experiment, output.absolute(), vary, cluster, note)
    found = _study_pairs(run, ())
    members = _drives_of(found, vary)
    write_scenarios(members, output / "scenarios")
    _write_pairs(found, output / "pairs.csv")
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
    return _drives_of(_study_pairs(run, maps), run.source)


def _study_pairs(run: ExperimentRun, maps: Sequence[str]) -> list[Pair]:
    found = list(pairs_by_map(run, maps))
    return [one for pairs in changed_pairs(run, found) for one in pairs]


def _drives_of(pairs: Iterable[Pair], source: str) -> list[Scenario]:
    drives: dict[str, Scenario] = {}
    for pair in pairs:
        for drive in simulated_drives(pair):
            if drives.setdefault(drive.name, drive) != drive:
                raise InputError(f"{source}: two drives are named {drive.name}")
    return list(drives.values())


# Columns of a table of pairs before those of factors and of the protocol.
_PAIR = ("map", "database", "query", "case", "seed")


def _write_pairs(pairs: Iterable[Pair], path: Path) -> None:
    """Writes the pairs of an experiment, by the names of their recordings.

    Several drives of a database are separated by spaces. The protocol's seed
    is the column `protocol_seed`; the others have the names of its fields.
    """
    rows: list[dict[str, Any]] = []
    for pair in pairs:
        *database, query = (one.name for one in simulated_drives(pair))
        protocol = asdict(pair.protocol)
        protocol["protocol_seed"] = protocol.pop("seed")
        case = pair.factors.get(CAUSE)
        values = pair.map_name, " ".join(database), query, case, pair.seed
        rows.append(
            {
                **dict(zip(_PAIR, values, strict=True)),
                **pair.factors,
                **protocol,
            }
        )
    names = list(dict.fromkeys(name for row in rows for name in row))
    write_csv(path, names, ([row.get(name) for name in names] for row in rows))
