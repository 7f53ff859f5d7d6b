"""Levels: frozen rungs of the ladder, and the results of methods on them.

Level 0 is the world without a change; levels 1 to 4 have all causes together.
Their drives are frozen: `worlds/levels.csv` holds their fingerprints.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import math
from pathlib import Path

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps, worlds_folder
from cns_drake.studies import ladder_rungs
from evaluation.recognition.protocol import FAIR_PROTOCOL
from evaluation.report.tables import Table, in_table_order, title

# The seed was drawn before any method was run on it.
LEVELS_EXTENT = ladder_rungs.Extent(
    causes=(ladder_rungs.ALL,),
    seeds=(4708,),
    strengths=ladder_rungs.LEVEL_STRENGTHS,
)
LEVELS_PROTOCOL = replace(FAIR_PROTOCOL, query_spacing=20.0)
# A level is solved when the interval of the best method begins above this.
_SOLVED = 0.98
# Scores differ in their last digits between machines, and ties break either
# way.
_EQUAL = 1e-3
# An interval of resampled queries may miss its own value by this.
_OUTSIDE = 0.05
_NUMBERS = ("auc", "auc_low", "auc_high")

# (Map, level) -> fingerprint of its drives.
Levels = Mapping[tuple[str, int], str]


@dataclass(frozen=True)
class LevelResult:
    """A method on a level, 0 to 4, of a map; AUC with its 95 % interval.

    With the gate, `is_gated`, the method had the radius.
    """

    map_name: str
    level: int
    method: str
    is_gated: bool
    auc: float
    low: float
    high: float


def planned_levels() -> dict[tuple[str, int], str]:
    """Returns the levels as this version of the program simulates them."""
    found = {}
    for name, folder in shipped_maps().items():
        query = load_scenario(MapFolder(folder).recordable_drives()[-1])
        drives: dict[int, list[str]] = {}
        for rung in ladder_rungs.plan_rungs(query, LEVELS_EXTENT)[0]:
            drives.setdefault(rung.level, []).append(rung.fingerprint())
        for level, prints in drives.items():
            found[name, level] = fingerprint({"drives": prints})
    return found


def frozen_levels() -> dict[tuple[str, int], str]:
    """Returns the levels as they were frozen."""
    columns = ("map", "level", "drives")
    rows = read_records(worlds_folder() / "levels.csv", columns)
    return {(row["map"], int(row["level"])): row["drives"] for _, row in rows}


def read_results(files: Iterable[Path], levels: Levels) -> list[LevelResult]:
    """Returns the results of several tables like `ladder.csv`, checked.

    Each may have several methods. Other rungs than levels are ignored.

    Raises:
        InputError: a table cannot be read; a method lacks a level of a map, was
            run on other drives, or has impossible numbers or numbers that
            differ between two tables.
    """
    kept: dict[tuple[str, str], tuple[Path, list[LevelResult]]] = {}
    for file in files:
        found = list(_read_file(file, levels))
        for key in dict.fromkeys((one.map_name, one.method) for one in found):
            mine = [one for one in found if (one.map_name, one.method) == key]
            _check_complete(file, *key, mine, levels)
            before, others = kept.setdefault(key, (file, mine))
            if not _are_equal(mine, others):
                name, method = key
                raise InputError(
                    f"{file}: {method} on {name}: differs from {before}"
                )
    return [one for _, results in kept.values() for one in results]


def _are_equal(some: list[LevelResult], others: list[LevelResult]) -> bool:
    numbers = {(one.level, one.is_gated): one.auc for one in others}
    return all(
        math.isclose(one.auc, numbers[one.level, one.is_gated], abs_tol=_EQUAL)
        for one in some
    )


def _read_file(file: Path, levels: Levels) -> Iterable[LevelResult]:
    columns = ("map", "cause", "level", "method", "gate", "drives")
    for line, row in read_records(file, (*columns, *_NUMBERS)):
        if row["cause"] not in (ladder_rungs.NONE, ladder_rungs.ALL):
            continue
        where = f"{file}: line {line}"
        try:
            level, is_gated = int(row["level"]), int(row["gate"])
            auc, low, high = (float(row[name]) for name in _NUMBERS)
        except ValueError:
            raise InputError(f"{where}: not a number") from None
        if levels.get((row["map"], level)) != row["drives"]:
            raise InputError(
                f"{where}: drives: they are not those of level {level} of "
                f"{row['map']}; run ladder --levels again"
            )
        if is_gated not in (0, 1):
            raise InputError(f"{where}: gate: {is_gated} is not 0 or 1")
        # Rounding may put the value just outside its interval.
        is_ordered = low - 1e-9 <= high and low >= -1e-9 and high <= 1 + 1e-9
        is_inside = low - _OUTSIDE <= auc <= high + _OUTSIDE
        if not (is_ordered and is_inside and 0.0 <= auc <= 1.0):
            raise InputError(
                f"{where}: auc, auc_low, auc_high: impossible values"
            )
        yield LevelResult(
            row["map"], level, row["method"], bool(is_gated), auc, low, high
        )


def _check_complete(
    file: Path,
    map_name: str,
    method: str,
    found: Iterable[LevelResult],
    levels: Levels,
) -> None:
    there = [(one.level, one.is_gated) for one in found]
    for name, level in levels:
        for is_gated in (False, True):
            number = there.count((level, is_gated))
            if name == map_name and number != 1:
                raise InputError(
                    f"{file}: {method}: level {level} of {name}, gate "
                    f"{int(is_gated)}: {number} rows instead of 1"
                )


def level_table(results: Iterable[LevelResult]) -> Table:
    """Returns the table of all methods: AUC on each level of each map.

    The last row of a map shows the solved levels: the interval of the best
    method begins above 0.98.
    """
    results = list(results)
    numbers = sorted({one.level for one in results})
    rows: list[tuple[object, ...]] = []
    for name in sorted({one.map_name for one in results}):
        of_map = {
            (one.method, one.is_gated, one.level): one
            for one in results
            if one.map_name == name
        }
        methods = in_table_order(method for method, _, _ in of_map)
        for method in methods:
            for is_gated in (False, True):
                found = [of_map[method, is_gated, n].auc for n in numbers]
                word = "yes" if is_gated else "no"
                rows.append((name, title(method), word, *found))
        solved = [
            any(of_map[one, False, n].low > _SOLVED for one in methods)
            for n in numbers
        ]
        words = ("yes" if one else "no" for one in solved)
        rows.append((name, "solved", "no", *words))
    header = ("map", "method", "gate", *(f"level {n}" for n in numbers))
    return Table(header, tuple(rows))
