"""Commands on recordings: export to other layouts, repair of damaged ones."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.progress_bars import count_progress, show_progress


def export(
    drive: Annotated[
        Path,
        typer.Argument(
            metavar="DRIVE", help="A recorded folder, or its .mcap file."
        ),
    ],
    layout: Annotated[
        Literal["cns", "kitti", "tum"],
        typer.Option(
            "--format",
            help="Layout: CNS data set, KITTI odometry, or TUM (the "
            "trajectory alone).",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            help="Folder of drives: new, empty, or of earlier exports."
        ),
    ],
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Name of the LiDAR, if there are several."
        ),
    ] = None,
    absent_in: Annotated[
        str | None,
        typer.Option(
            metavar="STAGE",
            help="Label points on structures that this stage of the map lacks "
            "with SemanticKITTI's labels of moving objects (252 to 259); "
            "with kitti.",
        ),
    ] = None,
) -> None:
    """Export a recording to a common layout."""
    with uninterrupted():
        from cns_drake.export.exporting import export_drive

    with show_progress() as progress:
        task = progress.add_task(drive.name, total=None, note="reading")
        drive = export_drive(
            drive,
            layout,
            output,
            lidar=sensor,
            absent_in=absent_in,
            on_frame=count_progress(progress, task),
        )
    typer.echo(drive)


def repair(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Any MCAP file, whole or damaged."),
    ],
    output: Annotated[
        Path | None,
        typer.Option(help="The new file; <name>_repaired.mcap by default."),
    ] = None,
) -> None:
    """Save what is readable of an MCAP file."""
    with uninterrupted():
        from cns_drake.recording.repair import repair_mcap

    with show_progress() as progress:
        task = progress.add_task(file.name, total=None, note="")
        result = repair_mcap(
            file,
            output,
            count_progress(progress, task, unit="bytes"),
        )
    typer.echo(
        f"{result.output}: {result.num_messages} messages over "
        f"{result.seconds:.2f} s recovered; "
        + (
            f"damaged places: {result.num_faults}, the first at "
            f"{result.first_fault}"
            if result.num_faults
            else "the file was whole"
        )
    )
