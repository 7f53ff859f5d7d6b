"""The command `cns-drake list`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import shutil
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.terminal import note

if TYPE_CHECKING:
    from cns_drake.scenarios.drive_table import DriveRow

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


def list_drives(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FOLDER",
            help="Folders of your own maps; the shipped ones by default.",
        ),
    ] = None,
) -> None:
    """List drives and their figures.

    Shows length and time of each drive, its recorded frames, and the structures
    and triangles of its stage. A narrow terminal shows fewer columns; a file or
    pipe gets all of them.
    """
    with uninterrupted():
        from cns_drake.scenarios.drive_table import drive_rows
        from cns_drake.scenarios.shipped import shipped_maps

    rows = []
    for folder in folders or shipped_maps().values():
        of_map = drive_rows(folder, note)
        if folders and not of_map:
            raise InputError(
                f"{folder}: no sequence_NN.yaml whose stage_NN.sdf is there"
            )
        rows += of_map
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    for line in table_lines(rows, width):
        print(line)


def table_lines(rows: list[DriveRow], width: int | None) -> Iterator[str]:
    """Yields the lines of a table of drives.

    Args:
        rows: the drives.
        width: the most characters of a line; columns other than the names are
            dropped to keep it. None keeps all columns.
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
