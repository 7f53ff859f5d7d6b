"""The commands `list` and `city`, on maps with roads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
import shutil
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import (
    InputError,
    ended_by_interrupts,
    note,
    shared_options,
    show,
)
from cns_drake.command_line.suggestions import suggest_reproduction

if TYPE_CHECKING:
    from cns_drake.scenarios import DriveRow

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
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import drive_rows, shipped_cities
        from cns_drake.scene import no_drives

    rows = []
    for folder in folders or shipped_cities().values():
        of_map = drive_rows(folder)
        if folders and not of_map:
            raise no_drives(folder)
        rows += of_map
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    show(
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


def city(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER")],
    new: Annotated[bool, typer.Option("--new")] = False,
    seed: Annotated[int | None, typer.Option(min=0, metavar="N")] = None,
    check: Annotated[bool, typer.Option("--check")] = False,
    repair_stages: Annotated[bool, typer.Option("--repair-stages")] = False,
) -> None:
    """Build the stages of a city from its roads and plan.

    You write the files roads.yaml, with the roads, and city.yaml, with the
    districts along the roads. The command generates an SDF world for each
    stage.

    Args:
        folder: Folder with roads.yaml, city.yaml and stages.yaml. The command
            writes the stages to this folder, and updates the folder's table of
            drives.
        new: Start from a folder with only roads.yaml: first write the missing
            files, which are two stages, a drive for each stage, and a city.yaml
            with a district for each block. Existing files are not changed.
        seed: Seed of the random districts and drives that --new writes; by
            default 0.
        check: Write nothing. List the files that would change, and exit with
            status 1 if any would.
        repair_stages: Update the names of structures in stages.yaml. Use this
            option after you have added something to city.yaml, because
            additions renumber the structures. The command recognises structures
            by their coordinates in the structures.csv of the last run.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.city import differing_files, generate_city, start_city
        from cns_drake.scenarios import check_table, write_table

    if seed is not None and not new:
        raise InputError("--seed: has no effect without --new")
    if new and check:
        raise InputError(
            "--new and --check exclude each other; give one of them"
        )
    if check:
        changed = differing_files(folder, note, repair_stages=repair_stages)
        for path in changed:
            print(path)
        if changed:
            raise typer.Exit(1)
        return
    check_table(folder)
    if new:
        start_city(folder, seed or 0, note)
    files = generate_city(folder, note, repair_stages=repair_stages)
    write_table(folder)
    note(f"{len(files)} files")
    suggest_reproduction(folder)
