"""Options that several commands share, and functions that act on them."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cns_drake.base import InputError, terminal

if TYPE_CHECKING:
    from cns_drake.drives import Drive
    from evaluation.study import Engine

# Option: when drives are aligned to one world.
When = Literal["auto", "always", "never"]
Align = Annotated[
    When,
    typer.Option(
        help="Whether to align the drives to each other before the comparison. "
        "auto aligns only drives with different world frames."
    ),
]
MethodName = Annotated[
    str,
    typer.Option(
        "--method",
        help="Place-recognition method to run: the name of a shipped method, "
        "or a Python file with your own method.",
    ),
]
Tables = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Folder for the tables results.csv and queries.csv, which have "
        "the columns of a study's tables; created if it does not exist.",
    ),
]
SensorHeight = Annotated[
    float, typer.Option(help="Height of the LiDAR above the ground [m].")
]


def open_noted(
    *paths: Path, lidar: str | None, columns: int | None = None
) -> list[Drive]:
    """Opens drives, and shows the notes on how they were read."""
    from evaluation.drives import open_drive

    drives = [open_drive(path, lidar, columns) for path in paths]
    for drive in drives:
        for note in drive.notes:
            terminal.note(note)
    return drives


def write_tables(engine: Engine) -> None:
    """Writes both tables of an engine, and shows a note on them."""
    from evaluation.results import QUERIES, RESULTS

    engine.write_tables()
    terminal.note(f"wrote {engine.output / RESULTS} and {QUERIES}")


def aligned(
    drives: Sequence[Drive], when: When, *, across_maps: bool = False
) -> tuple[Drive, Drive]:
    """Returns two drives in one world; shows a note if a drive was moved.

    Args:
        drives: the two drives.
        when: whether to align them: `auto` (if their world frames differ),
            `always` or `never`.
        across_maps: whether the drives may be from maps with different names.
    """
    from evaluation.alignment import in_one_world

    first, second = drives
    alignment = in_one_world(first, second, when, across_maps=across_maps)
    if alignment is None:
        return first, second
    terminal.note(alignment.report.to_text())
    return alignment.first, alignment.second


def overlap_of(truth: str) -> float | None:
    """Returns the least overlap of a match, from the option --truth.

    Args:
        truth: `radius` or `overlap:PART`.

    Returns:
        PART, from above 0 to 1; None for `radius`.

    Raises:
        InputError: the text is neither.
    """
    if truth == "radius":
        return None
    kind, _, part = truth.partition(":")
    try:
        least = float(part) if kind == "overlap" else math.nan
    except ValueError:
        least = math.nan
    if not 0.0 < least <= 1.0:
        raise InputError(
            f"--truth: {truth!r} is neither 'radius' nor 'overlap:PART' with a"
            " part above 0 and up to 1, such as overlap:0.5"
        )
    return least
