"""What a verb measures: its metrics, and its rows in the two tables."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evaluation.alignment import WorldVerdict
from evaluation.base import Reporter, one_line
from evaluation.drives import Drive
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    Interval,
    Number,
    RetrievalProtocol,
)
from evaluation.results import QueryRows, Results, Row, made_by


@dataclass(frozen=True, eq=False)
class Measured:
    """What a verb measures of a pair of drives, maps or sessions.

    Attributes:
        numbers: name of a metric -> its result, in the order of
            `evaluation.recognition.METRICS`.
        results: the rows of `results.csv`.
        queries: the rows of `queries.csv`.
        world: the world in which they were compared.
    """

    numbers: Mapping[str, Number]
    results: Results
    queries: QueryRows
    world: WorldVerdict

    @property
    def metrics(self) -> dict[str, float]:
        """Name of a metric -> its value; NaN if it is undefined."""
        return {name: one.value for name, one in self.numbers.items()}

    @property
    def intervals(self) -> dict[str, Interval]:
        """Name of a metric -> its 95 % interval; its limits can be unknown."""
        return {name: one.interval for name, one in self.numbers.items()}


def pair_key(
    verb: str,
    map_name: str,
    names: tuple[str, str],
    task: str,
    protocol: RetrievalProtocol = RANDOM_YAW_PROTOCOL,
    settings: Mapping[str, Any] | None = None,
    factors: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Returns the columns that all rows of a pair have.

    Args:
        verb: name of the verb, the `experiment` of the rows.
        map_name: name of the map.
        names: names of the first and of the second drive.
        task: the task.
        protocol: the protocol.
        settings: name -> value of settings outside of the protocol that change
            a number.
        factors: name -> value of each factor.
    """
    database, query = names
    return {
        "experiment": verb,
        "map": map_name,
        "database": database,
        "query": query,
        "seed": protocol.seed,
        "factors": factors or {},
        "task": task,
        **made_by(protocol, settings),
    }


def rows_of(
    numbers: Iterable[Number], key: Mapping[str, Any], world: WorldVerdict
) -> list[Row]:
    """Returns numbers as rows of `results.csv` with the columns of a key."""
    return [Row.of(number, world=world.state, **key) for number in numbers]


def map_of(opened: Drive | Path) -> str:
    """Returns the name of a drive's map; without a map, of its world frame."""
    if isinstance(opened, Path):
        return one_line(opened.name)
    named = (opened.scenario or {}).get("map")
    if named is not None:
        return one_line(Path(str(named)).name)
    return opened.world_frame.partition("/")[0] or opened.name


def noting(on_note: Callable[[str], None]) -> Reporter:
    """Returns a reporter of notes, and of nothing else."""

    def send(kind: str, *values: Any) -> None:
        if kind == "note":
            on_note(*values)

    return Reporter(send)
