"""Opening drives that are compared, in one world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from evaluation.alignment.align import AlignmentReport, When, in_one_world
from evaluation.base import InputError
from evaluation.drives import Drive, Reading


def open_in_one_world(
    given: Sequence[Drive | Path | str],
    readings: Sequence[Reading],
    when: When,
    on_note: Callable[[str], None],
    *,
    across_maps: bool = False,
) -> tuple[list[Drive | Path], list[AlignmentReport]]:
    """Opens drives that are compared, and aligns them, see `in_one_world`.

    Args:
        given: the drives, open or as paths, or paths of point clouds.
        readings: how each of them is read.
        when, across_maps: see `in_one_world`.
        on_note: is called with notes on how drives were read and aligned.

    Returns:
        The drives and paths of clouds, and a report on each alignment.

    Raises:
        InputError: something cannot be read, or drives cannot be aligned.
    """
    opened = [
        one if isinstance(one, Drive) else reading.open_source(Path(one))
        for one, reading in zip(given, readings, strict=True)
    ]
    lidar = readings[0].lidar
    if lidar is not None and not any(isinstance(one, Drive) for one in opened):
        raise InputError(f"--lidar {lidar}: a map file has no LiDARs")
    for drive in opened:
        for text in drive.notes if isinstance(drive, Drive) else ():
            on_note(text)
    found, reports = in_one_world(opened, when, across_maps=across_maps)
    for report in reports:
        on_note(report.to_text())
    return found, reports
