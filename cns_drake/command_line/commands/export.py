"""The command `export`, which converts recordings."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from cns_drake.command_line.suggestions import suggest_evaluation
from cns_drake.export import export_formats
from evaluation.base import (
    InputError,
    commands,
    ended_by_interrupts,
    no_such,
    note,
    shared_options,
    terminal,
)

GROUP = "Convert for other programs"


_CONVERTED = export_formats()
_SESSIONS = "map-sessions"
_FORMATS = (*_CONVERTED, _SESSIONS)
# Option -> the formats with which it has an effect.
_ONLY_WITH: Mapping[str, tuple[str, ...]] = {
    "spacing": (_SESSIONS,),
    "absent_in": _CONVERTED,
    "sequence": _CONVERTED,
}
# A format of earlier versions -> the command that took its place.
_MOVED = {
    "pointnetvlad": "pairs",
    "overlap": "truth --format overlaps",
    "overlap-table": "truth --format overlaps",
    "map-truth": "truth",
    "film": "film",
}


def export(
    context: typer.Context,
    drives: Annotated[list[str], typer.Argument(metavar="DRIVE")],
    *,
    layout: Annotated[str, typer.Option("--format", metavar="FORMAT")],
    output: Annotated[Path, typer.Option()],
    lidar: shared_options.Lidars = None,
    odometry: shared_options.Odometry = None,
    poses: shared_options.Poses = None,
    columns: shared_options.ColumnsOfEach = None,
    absent_in: Annotated[str | None, typer.Option(metavar="STAGE")] = None,
    sequence: Annotated[
        int | None, typer.Option(metavar="NN", min=0, max=999)
    ] = None,
    spacing: Annotated[float, typer.Option(min=0.01, metavar="METRES")] = 1.0,
    json: shared_options.Json = False,
) -> None:
    """Convert drives for other programs.

    The format map-sessions contains two maps without labels, from drives whose
    world is unknown, such as real ones; for cns-eval map-update, add ground
    truth of your own: A/truth.npy and B/truth.npy. All other formats convert
    one drive.

    Args:
        drives: Drive to convert, in any format that cns-eval reads; with
            --format map-sessions, two drives.
        layout: Format to write: one of CONVERTED (tum has only the trajectory)
            or map-sessions.
        output: Folder to write: new, empty, or, except with map-sessions, with
            earlier exports of the same format.
        absent_in: Another stage of the map, such as 01. Points on structures
            that do not exist in that stage get SemanticKITTI's labels of moving
            objects (252 to 259). Only with a format that has labels, such as
            kitti.
        sequence: Number NN of the exported drive, whose folder is called
            sequences/NN. By default the digits at the end of the drive's name.
            Only with a format that numbers drives, such as kitti.
        spacing: Distance that the car drives between two scans of a map [m].
            The smaller the distance, the denser the map. Only with --format
            map-sessions.

    Example:
        cns-drake export drives/metropolis_01 \\
            --format kitti --output kitti
    """
    _check_format(layout)
    _check_options(commands.given_options(context), layout)
    number, wanted = (
        (2, "two drives") if layout == _SESSIONS else (1, "one drive")
    )
    if len(drives) != number:
        raise InputError(f"--format {layout}: give {wanted}, not {len(drives)}")
    with ended_by_interrupts("cns-drake"):
        from cns_drake.export import export_drive
        from evaluation.drives import Reading, find_data_sets
        from evaluation.map_update import write_sessions

    given = shared_options.readings(lidar, odometry, poses, columns)
    opened = [
        reading.open(Path(path))
        for reading, path in zip(
            Reading.each(number, **given), drives, strict=True
        )
    ]
    if layout == _SESSIONS:
        write_sessions(opened[0], opened[1], output, spacing, note)
        path = output
    else:
        path = export_drive(
            opened[0],
            layout,
            output,
            absent_in=absent_in,
            sequence=sequence,
            on_note=note,
        )
    terminal.show({"output": str(path)}, str(path), json=json)
    if layout != _SESSIONS and not given and find_data_sets(path):
        suggest_evaluation(Path(drives[0]), path)


# The help lists the formats.
export.__doc__ = (export.__doc__ or "").replace(
    "CONVERTED", f"{', '.join(_CONVERTED[:-1])} and {_CONVERTED[-1]}"
)


def _check_format(layout: str) -> None:
    if layout in _MOVED:
        raise InputError(
            f"--format: {layout} is no conversion of a recording; use cns-drake"
            f" {_MOVED[layout]}"
        )
    if layout not in _FORMATS:
        raise InputError(f"--format: {no_such('format', layout, _FORMATS)}")


def _check_options(names: Iterable[str], layout: str) -> None:
    """Refuses options that have no effect with a format.

    Args:
        names: names of the parameters that the user gave.
    """
    for name in names:
        formats = _ONLY_WITH.get(name, (layout,))
        if layout not in formats:
            raise InputError(
                f"--{name.replace('_', '-')}: not with --format {layout};"
                f" only with {', '.join(formats)}"
            )
