"""The command `pairs`: data for training place recognition."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.command_line import options
from evaluation.base import ended_by_interrupts, note, shared_options, terminal

GROUP = "Convert for other programs"


def pairs(
    drives: Annotated[list[str] | None, typer.Argument(metavar="DRIVE")] = None,
    *,
    output: Annotated[Path, typer.Option()],
    spacing: Annotated[float, typer.Option(min=0.01, metavar="METRES")] = 10.0,
    vary: options.Vary = None,
    held_out: Annotated[list[str] | None, typer.Option(metavar="NAME")] = None,
    scans: Annotated[int, typer.Option(min=1, metavar="N")] = 1,
    half_extent: Annotated[
        float, typer.Option(min=1.0, max=10_000.0, metavar="METRES")
    ] = 50.0,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    json: shared_options.Json = False,
) -> None:
    """Write data for training place recognition.

    The data are point clouds and pickle files in the format of PointNetVLAD,
    with exact positives and negatives. The drives are simulated but not
    recorded. To resume after an interruption, run the same command again.

    Args:
        drives: Shipped drives, or scenario files. If you name none, the drives
            of the experiment that --vary names are used, or all shipped drives
            if --vary is not given.
        output: Folder to write: new, empty, or with earlier data of this
            command.
        spacing: Distance that the car drives between two clouds [m].
        held_out: Drive that is used for evaluation only, and never for
            training, even if DRIVE or --vary names it. May be repeated.
        scans: Number of consecutive scans that are merged into each cloud (a
            submap).
        half_extent: Largest absolute x, y and z of a point in the LiDAR's frame
            [m]. Points beyond this limit are left out.

    Example:
        cns-drake pairs riverside_01 riverside_02 --output pairs
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.training import ExportOptions, write_pairs
        from evaluation.base import choose_cluster

    cluster = choose_cluster(jobs, scheduler)
    paths = write_pairs(
        drives or (),
        held_out or (),
        output,
        ExportOptions(spacing, scans, half_extent),
        cluster,
        vary=vary,
        on_note=note,
    )
    texts = [str(path) for path in paths]
    terminal.show({"output": texts}, "\n".join(texts), json=json)
