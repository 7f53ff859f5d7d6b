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
    from evaluation.drives.comparison import DriveComparison, Driving


def drives(
    first: Annotated[Path, typer.Argument(metavar="A")],
    second: Annotated[Path, typer.Argument(metavar="B")],
    align: options.Align = "auto",
    lidar: options.LidarName = None,
    columns: options.Columns = None,
    json: options.Json = False,
) -> None:
    """Compare the paths of two drives.

    Every 5 m along A, the command measures how B differs from A: sideways
    offset, lane, heading and height. It also prints which share of the time
    each car stands, and its speeds. For comparison, it shows the same numbers
    for two pairs of real drives: two drives of Boreas, 28 days apart, and KAIST
    01 and 02 of MulRan.

    Args:
        first: Recorded drive A.
        second: Recorded drive B along the same streets.
    """
    from evaluation.drives.comparison import compare_drives

    pair = options.aligned(
        options.open_noted(first, second, lidar=lidar, columns=columns), align
    )
    found = compare_drives(*pair)
    options.show(found.to_json(), _drive_rows(found), json=json)


def trajectory(
    drive: Annotated[Path, typer.Argument(metavar="DRIVE")],
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE.tum")],
    frame: Literal["lidar", "base_link"] = "lidar",
    time_offset: Annotated[float, typer.Option(metavar="S")] = 0.0,
    lidar: options.LidarName = None,
    columns: options.Columns = None,
    json: options.Json = False,
) -> None:
    """Measure the errors of an estimated trajectory.

    The estimate is a TUM file: time [s], x y z and a quaternion x y z w. The
    command prints two errors, as evo and KITTI define them. ATE is the root
    mean square of the distances from the true trajectory after rigid alignment.
    Drift is the error of the motion over 100 m of path.

    Args:
        drive: Recorded drive with the true trajectory.
        estimate: File with the estimated trajectory.
        frame: Frame whose poses the file contains: the LiDAR's (lidar) or the
            vehicle's (base_link).
        time_offset: Time to add to the times of the estimate [s], if its clock
            differs from that of the drive.
    """
    from evaluation.alignment.trajectory_errors import trajectory_errors
    from evaluation.drives.text_tables import (
        parse_seconds,
        read_quaternions,
    )

    (truth,) = options.open_noted(drive, lidar=lidar, columns=columns)
    found = read_quaternions(estimate, None, parse_seconds)
    errors = trajectory_errors(truth, found, frame, time_offset)
    if errors.num_outside:
        terminal.note(
            f"{estimate}: {errors.num_outside} poses before or after the drive,"
            " left out"
        )
    named = {"drive": truth.name, "frame": frame}
    options.show(named | errors.to_json(), errors.to_rows(), json=json)


def _drive_rows(found: DriveComparison) -> Iterator[tuple[str, str]]:
    """Yields the rows of `drives`: the pair, then Boreas, then KAIST."""

    def shown(value: float | str, boreas: str = "", kaist: str = "") -> str:
        if isinstance(value, float):
            value = "-" if isnan(value) else f"{value:.2f}"
        return f"{value:>12}{boreas:>14}{kaist:>14}".rstrip()

    met = f"{found.num_met} of {found.num_stops}"
    yield "", shown("these", "Boreas", "KAIST")
    rows: list[tuple[str, float | str, str, str]] = [
        (
            "stations that meet the other drive",
            met,
            "1593 of 1593",
            "1166 of 1194",
        ),
        ("  in the opposite direction only", found.reverse, "0", ".15 to .20"),
        ("offset, 50 % [m]", found.offset_50, ".33", ".37"),
        ("  75 %", found.offset_75, ".64", "1.11"),
        ("  90 %", found.offset_90, "1.53", "2.44"),
        ("  95 %", found.offset_95, "2.82", "2.83"),
        ("  99 %", found.offset_99, "3.48", "3.14"),
        ("in another lane", found.other_lane, ".10", ".17"),
        ("  for, 50 % [m]", found.episode_50, "15 to 20", "65 to 80"),
        ("  90 %", found.episode_90, "43", "200 to 270"),
        ("spread within the lane [m]", found.wander, ".49", ".55"),
        ("  correlated over [m]", found.wander_length, "45", "50 to 55"),
        ("heading, spread [deg]", found.heading_spread_deg, "1.6", "1.6"),
        ("  5 %", found.heading_5_deg, "-2.5", "-2.6"),
        ("  95 %", found.heading_95_deg, "2.5", "2.8"),
        ("height, 5 % [m]", found.height_5, "-.07", "-.2"),
        ("  95 %", found.height_95, ".04", ".2"),
        ("opposite direction, 25 % [m]", found.reverse_25, "", "1.1 to 3.0"),
        ("  50 %", found.reverse_50, "", "2.7 to 5.9"),
        ("  75 %", found.reverse_75, "", "3.3 to 6.6"),
        ("  95 %", found.reverse_95, "", "3.7 to 9.3"),
        *_motion(found.first, ".22", "13"),
        *_motion(found.second, ".13", "14"),
    ]
    for name, value, boreas, kaist in rows:
        yield name, shown(value, boreas, kaist)


def _motion(
    drive: Driving, standing: str, fast: str
) -> list[tuple[str, float, str, str]]:
    return [
        (f"{drive.name}: standing", drive.standing, standing, ""),
        ("  moving, 10 % [m/s]", drive.speed_10, "2.9", ""),
        ("  50 %", drive.speed_50, "9.1", ""),
        ("  90 %", drive.speed_90, fast, ""),
        ("  roll, spread [deg]", drive.roll_spread_deg, ".9", ""),
        ("  pitch, spread [deg]", drive.pitch_spread_deg, ".9", ""),
    ]
