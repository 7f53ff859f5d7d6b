"""Commands on trajectories: `drives` and `trajectory`."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cns_drake.base import terminal
from evaluation.command_line import options

if TYPE_CHECKING:
    from evaluation.drives.comparison import DriveComparison


def drives(
    first: Annotated[Path, typer.Argument(metavar="A")],
    second: Annotated[Path, typer.Argument(metavar="B")],
    align: options.Align = "auto",
    lidar: options.LidarName = None,
    json: options.Json = False,
) -> None:
    """How the ways of two drives differ.

    Offsets, lanes, headings, heights and stops of B at a stop of A every 5 m,
    beside those of two pairs of real drives along one route (Boreas, 28 days
    apart; KAIST 01 and 02 of MulRan).
    """
    from evaluation.drives.comparison import compare_drives

    pair = options.aligned(
        options.open_noted(first, second, lidar=lidar), align
    )
    found = compare_drives(*pair)
    options.show(found.to_json(), _drive_rows(found), json=json)


def trajectory(
    drive: Annotated[Path, typer.Argument(metavar="DRIVE")],
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE.tum")],
    frame: Literal["lidar", "base_link"] = "lidar",
    time_offset: Annotated[float, typer.Option(metavar="S")] = 0.0,
    lidar: options.LidarName = None,
    json: options.Json = False,
) -> None:
    """Errors of an estimated trajectory.

    They are those of evo and KITTI. The estimate is a TUM file: seconds, x y z,
    and a quaternion x y z w. Prints ATE, the root mean square of its distances
    from DRIVE after rigid alignment, and drift, the error of its motion over
    100 m of path.

    Args:
        frame: Frame whose poses are estimated: the LiDAR's or the vehicle's.
        time_offset: Time to add to that of the estimate [s].
    """
    from evaluation.alignment.trajectory_errors import trajectory_errors
    from evaluation.drives.text_tables import read_tum

    (truth,) = options.open_noted(drive, lidar=lidar)
    errors = trajectory_errors(truth, read_tum(estimate), frame, time_offset)
    if errors.num_outside:
        terminal.note(
            f"{estimate}: {errors.num_outside} poses before or after the drive,"
            " left out"
        )
    named = {"drive": truth.name, "frame": frame}
    options.show(named | errors.to_json(), errors.to_rows(), json=json)


def _drive_rows(found: DriveComparison) -> Iterator[tuple[str, str]]:
    """Yields the rows of `drives`: the pair, then Boreas, then KAIST."""

    def row(value: float | str, boreas: str = "", kaist: str = "") -> str:
        if isinstance(value, float):
            value = "-" if isnan(value) else f"{value:.2f}"
        return f"{value:>12}{boreas:>14}{kaist:>14}".rstrip()

    yield "", row("these", "Boreas", "KAIST")
    yield (
        "stops that meet the other drive",
        row(
            f"{found.num_met} of {found.num_stops}",
            "1593 of 1593",
            "1166 of 1194",
        ),
    )
    yield (
        "  in the opposite direction only",
        row(found.reverse, "0", ".15 to .20"),
    )
    yield "offset, 50 % [m]", row(found.offset_50, ".33", ".37")
    yield "  75 %", row(found.offset_75, ".64", "1.11")
    yield "  90 %", row(found.offset_90, "1.53", "2.44")
    yield "  95 %", row(found.offset_95, "2.82", "2.83")
    yield "  99 %", row(found.offset_99, "3.48", "3.14")
    yield "in another lane", row(found.other_lane, ".10", ".17")
    yield "  for, 50 % [m]", row(found.episode_50, "15 to 20", "65 to 80")
    yield "  90 %", row(found.episode_90, "43", "200 to 270")
    yield "spread within the lane [m]", row(found.wander, ".49", ".55")
    yield "  correlated over [m]", row(found.wander_length, "45", "50 to 55")
    yield "heading, spread [deg]", row(found.heading_spread_deg, "1.6", "1.6")
    yield "  5 %", row(found.heading_5_deg, "-2.5", "-2.6")
    yield "  95 %", row(found.heading_95_deg, "2.5", "2.8")
    yield "height, 5 % [m]", row(found.height_5, "-.07", "-.2")
    yield "  95 %", row(found.height_95, ".04", ".2")
    yield (
        "opposite direction, 25 % [m]",
        row(found.reverse_25, "", "1.1 to 3.0"),
    )
    yield "  50 %", row(found.reverse_50, "", "2.7 to 5.9")
    yield "  75 %", row(found.reverse_75, "", "3.3 to 6.6")
    yield "  95 %", row(found.reverse_95, "", "3.7 to 9.3")
    for drive, standing, fast in (
        (found.first, ".22", "13"),
        (found.second, ".13", "14"),
    ):
        yield f"{drive.name}: standing", row(drive.standing, standing)
        yield "  moving, 10 % [m/s]", row(drive.speed_10, "2.9")
        yield "  50 %", row(drive.speed_50, "9.1")
        yield "  90 %", row(drive.speed_90, fast)
        yield "  roll, spread [deg]", row(drive.roll_spread_deg, ".9")
        yield "  pitch, spread [deg]", row(drive.pitch_spread_deg, ".9")
