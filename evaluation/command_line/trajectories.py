"""What `tcr --paths` and `localise --estimate` print of trajectories."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from cns_drake.base import terminal
from evaluation.command_line import options

if TYPE_CHECKING:
    from cns_drake.drives import Drive
    from evaluation.drives import DriveComparison, Driving


def compare_paths(
    first: Drive, second: Drive, when: options.When, *, json: bool
) -> None:
    """Prints how the paths of two drives along the same streets differ.

    Args:
        first: drive A.
        second: drive B.
        when: whether to first align the drives to one world.
        json: whether to print JSON.
    """
    from evaluation.drives import compare_drives

    found = compare_drives(*options.aligned((first, second), when))
    terminal.show(found.to_json(), _drive_rows(found), json=json)


def measure_estimate(
    truth: Drive,
    estimate: Path,
    frame: options.Frame,
    time_offset: float,
    *,
    json: bool,
) -> None:
    """Prints the errors of an estimated trajectory.

    Args:
        truth: drive with the ground-truth trajectory.
        estimate: TUM file.
        frame: frame whose poses the file contains.
        time_offset: time to add to the times of the estimate [s].
        json: whether to print JSON.
    """
    from evaluation.alignment import trajectory_errors
    from evaluation.drives import parse_seconds, read_quaternions

    found = read_quaternions(estimate, None, parse_seconds)
    errors = trajectory_errors(truth, found, frame, time_offset)
    if errors.num_outside:
        terminal.note(
            f"{estimate}: {errors.num_outside} poses before or after the drive,"
            " left out"
        )
    named = {"drive": truth.name, "frame": frame}
    terminal.show(named | errors.to_json(), errors.to_rows(), json=json)


def _drive_rows(found: DriveComparison) -> Iterator[tuple[str, str]]:
    """Yields the rows of `tcr --paths`: name and three columns of values.

    The values are of the pair, of drives of Boreas, and of drives of KAIST.
    """

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
