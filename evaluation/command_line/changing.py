"""The command `cns-eval tcr`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal
from evaluation.command_line.drive_notes import print_notes
from evaluation.command_line.options import Align, AlignName, Json, LidarName
from evaluation.command_line.result_rows import change_rows


def tcr(
    source: Annotated[Path, typer.Argument(metavar="A")],
    target: Annotated[Path, typer.Argument(metavar="B")],
    control: Annotated[
        Path | None,
        typer.Option(
            metavar="C",
            help="A recording of A's route in B's stage, or of B's route in "
            "A's stage. It gives the TCR_sym that the routes alone cause.",
        ),
    ] = None,
    align: Align = AlignName.AUTO,
    lidar: LidarName = None,
    json: Json = False,
) -> None:
    """Temporal change ratio of two drives or maps.

    A and B are recorded drives (MCAP, MulRan, HeLiPR, KITTI odometry,
    CNS) or maps (.pcd .ply .npy .bin). A is the source and B the target of
    the directed ratios. Drives in different world frames are aligned.
    """
    from evaluation.change import drive_change as change
    from evaluation.drives import Drive

    paths = [path for path in (source, target, control) if path is not None]
    surveys, alignments = change.survey_in_one_world(
        paths, align.value, terminal.track, lidar
    )
    report = change.compare(
        surveys[0],
        surveys[1],
        control=None if control is None else surveys[2],
        alignment=alignments[0] if alignments else None,
    )
    for one in surveys:
        if isinstance(one.drive, Drive):
            print_notes(one.drive)
        ignored = one.voxels.num_ignored
        if ignored:
            terminal.note(
                f"{one.name}: {ignored} points are not finite, and left out"
            )
    for alignment in alignments:
        terminal.note(alignment.to_text())
    if json:
        terminal.print_json(report.to_json())
    else:
        terminal.print_rows(change_rows(report))
