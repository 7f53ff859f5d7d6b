"""Pairs of drives with one cause of change each: rows, tables and figures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import TypeVar

from cns_drake.base.drives.drive import Drive
from cns_drake.base.files import completing
from evaluation.report.ladder import CauseCell, draw_cells
from evaluation.report.tables import Columns, Table


@dataclass(frozen=True)
class ComparedPair:
    """Two drives that are compared.

    Attributes:
        map_name: name of the city.
        database: name of the drive of the map, the older one.
        query: name of the other drive.
        cause: of the change between them.
        level: its strength, from 1 to 4; 0 without a change.
        strength: in words.
        sources: open both drives.
        seed: number of the random draw.
    """

    map_name: str
    database: str
    query: str
    cause: str
    level: int
    strength: str
    sources: tuple[Callable[[], Drive], Callable[[], Drive]]
    seed: int = 1

    @property
    def name(self) -> str:
        """What tells it from other pairs."""
        return (
            f"{self.map_name} {self.database} {self.query} {self.cause} "
            f"{self.level} {self.seed}"
        )


@dataclass(frozen=True)
class ComparedRow:
    """The result of a method on a pair.

    Attributes:
        pair: the drives.
        method: its name.
    """

    pair: ComparedPair
    method: str


_Row = TypeVar("_Row", bound=ComparedRow)


def write_compared(
    path: Path, rows: Sequence[_Row], columns: Columns[_Row]
) -> None:
    """Writes a table (CSV) of rows, with what they are of first.

    Args:
        path: of the file.
        rows: in their order.
        columns: further ones.
    """
    keys: Columns[_Row] = {
        "map": lambda row: row.pair.map_name,
        "db": lambda row: row.pair.database,
        "query": lambda row: row.pair.query,
        "cause": lambda row: row.pair.cause,
        "level": lambda row: row.pair.level,
        "method": lambda row: row.method,
    }
    with completing(path) as unfinished:
        table = Table.of(rows, {**keys, **columns})
        unfinished.write_text(table.to_csv(), encoding="utf-8")


def draw_compared(
    panels: Mapping[str, Sequence[_Row]],
    share: Callable[[str, _Row], tuple[float, str]],
    meaning: str,
    stem: Path,
) -> None:
    """Draws methods over causes, two panels for each map.

    A cell has a strip for each level, the weakest at its left; the number is
    that of the strongest level.

    Args:
        panels: title -> rows for all maps and causes.
        share: title, row -> the colour, from 0 to 1, and the number in words.
        meaning: of the colours.
        stem: path to write, without ending.
    """
    names = dict.fromkeys(
        row.pair.map_name for rows in panels.values() for row in rows
    )
    draw_cells(
        {
            (name, f"{name}, {title}"): [
                CauseCell(
                    row.method,
                    row.pair.cause,
                    row.pair.level,
                    *share(title, row),
                )
                for row in rows
                if row.pair.map_name == name
            ]
            for name in names
            for title, rows in panels.items()
        },
        meaning,
        stem,
    )


@dataclass(frozen=True)
class MapRow(ComparedRow):
    """The labels of a method, or the true ones, on the maps of a pair.

    Attributes:
        scores: name -> value, see `evaluation.map_update.scores.summary`; None
            where one is undefined.
    """

    scores: Mapping[str, float | None]


def draw_maps(rows: Sequence[MapRow], stem: Path) -> None:
    """Draws the scores of points, and how right the verdicts on structures are.

    The numbers are mean IoU [%], and the structures that are called gone or new
    [%].

    Args:
        rows: rows for all maps, causes and methods.
        stem: path to write, without ending.
    """
    values = {
        "points": ("miou", "miou"),
        "structures": ("right_structures", "called_structures"),
    }

    def share(title: str, row: MapRow) -> tuple[float, str]:
        colour, number = (row.scores[name] for name in values[title])
        return (
            math.nan if colour is None else colour,
            "–" if number is None else f"{100.0 * number:.0f}",
        )

    draw_compared(
        dict.fromkeys(values, rows),
        share,
        "mean IoU of points, and right part of structures; numbers: mean IoU, "
        "and part called gone or new [%]",
        stem,
    )
