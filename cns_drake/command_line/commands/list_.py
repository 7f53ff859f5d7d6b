"""The command `list`, which lists drives."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
import shutil
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from evaluation.base import ended_by_interrupts, shared_options, terminal

if TYPE_CHECKING:
    from cns_drake.scenarios import DriveRow

GROUP = "Drive through them"

_HEADINGS = (
    "drive",
    "map",
    "stage",
    "length",
    "time",
    "frames",
    "structures",
    "triangles",
)
# Columns without room are dropped in this order.
_GIVE_WAY = (
    "map",
    "structures",
    "triangles",
    "stage",
    "frames",
    "time",
    "length",
)
_GAP = "  "


def list_(
    folders: Annotated[
        list[Path] | None, typer.Argument(metavar="FOLDER")
    ] = None,
    json: shared_options.Json = False,
) -> None:
    """List drives with their lengths, durations and sizes.

    The columns are the length and duration of each drive, its number of frames,
    and the numbers of structures and triangles in its stage. A narrow terminal
    shows fewer columns. A file or pipe gets all columns.

    Args:
        folders: Folders of your own maps, whose drives are listed; by default
            the drives of the shipped cities.

    Example:
        cns-drake list
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import listed_drives

    rows = listed_drives(folders or ())
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    terminal.show(
        {"drives": [asdict(row) for row in rows]},
        "\n".join(table_lines(rows, width)),
        json=json,
    )


def table_lines(rows: list[DriveRow], width: int | None) -> Iterator[str]:
    """Yields the lines of a table of drives.

    Args:
        width: greatest number of characters of a line. Columns that do not fit
            are dropped, except the names. None keeps all columns.
    """
    lines = [_HEADINGS] + [
        (
            row.sequence,
            row.map,
            row.stage,
            f"{row.length:.0f} m",
            f"{row.duration:.1f} s",
            str(row.frames),
            str(row.structures),
            str(row.triangles),
        )
        for row in rows
    ]
    columns = dict(zip(_HEADINGS, zip(*lines, strict=True), strict=True))
    widths = {name: max(map(len, cells)) for name, cells in columns.items()}
    for name in _GIVE_WAY:
        total = sum(widths.values()) + len(_GAP) * (len(widths) - 1)
        if width is None or total <= width:
            break
        del widths[name]
    for line in lines:
        cells = dict(zip(_HEADINGS, line, strict=True))
        yield _GAP.join(
            cells[name].ljust(widths[name])
            if name in ("drive", "map", "stage")
            else cells[name].rjust(widths[name])
            for name in widths
        ).rstrip()
