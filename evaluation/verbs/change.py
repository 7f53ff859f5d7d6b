"""The verb `tcr`: how much changed between two drives or maps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.alignment import When, open_pair
from evaluation.base import json_values, note
from evaluation.change import (
    ChangeReport,
    DriveMap,
    change_of_maps,
    map_source,
    registered_change,
    same_stage_partner,
    spread_over_grids,
)
from evaluation.drives import NOT_FINITE, Drive, Reading
from evaluation.recognition import numbers_of
from evaluation.results import LAST, OWN, STAGE, QueryRows, Results
from evaluation.verbs.measured import Measured, map_of, pair_key, rows_of

# What registration corrects is told above this angle [deg] ...
_TURNED_DEG = 0.25
# ... and this distance [m].
_MOVED = 0.25


@dataclass(frozen=True, eq=False)
class Change(Measured):
    """How much changed between two drives or maps.

    Attributes:
        report: the change, with its context.
    """

    report: ChangeReport

    def to_json(self) -> dict[str, Any]:
        """Returns what `cns-eval tcr --json` prints."""
        return json_values(
            {
                "source": self.report.source,
                "target": self.report.target,
                "world": self.world.to_json(),
                "tcr_sym_registered": None,
                "registration_yaw_deg": None,
                **self.metrics,
                **self.report.to_json(),
            }
        )


def change_between(
    a: Drive | Path | str,
    b: Drive | Path | str,
    *,
    no_change: Drive | Path | str | None = None,
    align: When = "auto",
    lidar: str | Sequence[str] | None = None,
    odometry: str | Sequence[str] | None = None,
    poses: Path | Sequence[Path] | None = None,
    columns: int | Sequence[int] | None = None,
    pose_gap: float | None = None,
    on_note: Callable[[str], None] = note,
) -> Change:
    """Measures how much changed between two drives, as `cns-eval tcr` does.

    Args:
        a: drive before the change, open or as a path, or the path of a map.
        b: drive or map after the change.
        no_change: control: a third drive, on A's route in B's stage or on B's
            route in A's stage.
        align: whether to align the drives: `auto` (unless something says
            that they share a world), `always` or `never`.
        lidar: name of the LiDAR, for recordings with several LiDARs; like the
            next three, one value for all drives, or a list with one for each.
        odometry: topic of the poses, for recordings with several.
        poses: file with the poses of the LiDAR, see `open_drive`.
        columns: number of columns of `.bin` files.
        pose_gap: see `open_drive`.
        on_note: is called with notes for the user.

    Raises:
        InputError: something cannot be read, drives cannot be aligned, or the
            control follows neither route.

    Example:
        from evaluation import change_between

        print(change_between("before.pcd", "after.pcd").metrics["tcr_sym"])
    """
    given = [one for one in (a, b, no_change) if one is not None]
    readings = Reading.each(
        len(given),
        lidar=lidar,
        odometry=odometry,
        poses=poses,
        columns=columns,
        pose_gap=pose_gap,
    )
    opened = open_pair(given, readings, align, on_note)
    alignments = opened.world.alignments
    maps = [
        map_source(one, reading.columns)
        for one, reading in zip(opened.drives, readings, strict=True)
    ]
    before, after, *controls = maps
    report = change_of_maps(before, after)
    compared = {OWN: (report, after)}
    for third in controls:
        partner = same_stage_partner(before, after, third)
        control = change_of_maps(third, partner)
        compared[LAST] = control, partner
        report = report.beside(control)
    report = replace(
        report,
        spread=spread_over_grids(before, after, report.change),
        alignment=alignments[0] if alignments else None,
        registered=registered_change(before, after),
    )
    compared[OWN] = report, after
    for drive_map in maps:
        for text in drive_map.notes:
            on_note(text)
        if ignored := drive_map.voxels.num_ignored:
            on_note(f"{drive_map.name}: {ignored} {NOT_FINITE}")
    if report.note is not None:
        on_note(report.note)
    world = opened.world
    off = report.registered
    if off is not None and (
        abs(off.yaw_deg) > _TURNED_DEG or np.linalg.norm(off.offset) > _MOVED
    ):
        x, y, z = off.offset
        text = (
            f"the recorded poses decide: registration turns {after.name} by"
            f" {off.yaw_deg:.2f} deg and moves it by ({x:.2f}, {y:.2f},"
            f" {z:.2f}) m"
        )
        world = replace(world, why=f"{world.why}; {text}")
        if report.note is None:
            on_note(text)
    names = before.name, after.name
    rows = []
    for stage, (found, newer) in compared.items():
        factors = {STAGE: stage} if controls else {}
        key = pair_key("tcr", _map_of(newer), names, "change", factors=factors)
        rows += rows_of(numbers_of("change", found), key, world)
    return Change(
        {one.metric: one for one in numbers_of("change", report)},
        Results.of(rows),
        QueryRows.of(()),
        world,
        report,
    )


def _map_of(drive_map: DriveMap) -> str:
    drive = drive_map.drive
    return map_of(drive if isinstance(drive, Drive) else Path(drive_map.name))
