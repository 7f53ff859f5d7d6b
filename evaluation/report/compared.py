"""Pairs of drives with one cause of change each: rows, tables and figures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import TypeVar

from cns_drake.base.drives.drive import Drive
from evaluation.report.ladder import (
    RUNG_COLUMNS,
    CauseCell,
    LadderRung,
    draw_cells,
)
from evaluation.report.tables import Columns, Table


@dataclass(frozen=True)
class ComparedPair:
    """Two drives that are compared.

    Attributes:
        rung: the change between them; the drive of the map is the database.
        sources: open both drives.
        seed: number of the random draw.
    """

    rung: LadderRung
    sources: tuple[Callable[[], Drive], Callable[[], Drive]]
    seed: int = 1

    @property
    def name(self) -> str:
        """Its drives, cause, level and seed, which no other pair has."""
        names = (get(self) for get in RUNG_COLUMNS.values())
        return " ".join(map(str, (*names, self.seed)))


@dataclass(frozen=True)
class ComparedRow:
    """The result of a method on a pair.

    Attributes:
        pair: the drives.
        method: its name.
    """

    pair: ComparedPair
    method: str

    @property
    def rung(self) -> LadderRung:
        """The change between the drives."""
        return self.pair.rung


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
    keys = {**RUNG_COLUMNS, "method": lambda row: row.method}
    Table.of(rows, {**keys, **columns}).write_csv(path)


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
        row.rung.map_name for rows in panels.values() for row in rows
    )
    draw_cells(
        {
            (name, f"{name}, {title}"): [
                CauseCell(
                    row.method,
                    row.rung.cause,
                    row.rung.level,
                    *share(title, row),
                )
                for row in rows
                if row.rung.map_name == name
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
        "mean IoU of points [%]": ("miou", "miou"),
        "structures called gone or new [%]": (
            "right_structures",
            "called_structures",
        ),
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
        "mean IoU; right structures",
        stem,
    )
