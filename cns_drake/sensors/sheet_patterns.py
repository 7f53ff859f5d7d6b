"""The beam patterns of LiDARs, made from their data sheets."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path
from typing import Any, TypeAlias, TypeVar
import warnings

import numpy as np

from cns_drake.sensors.lidar.beams import BeamPattern, period_of_rate
from cns_drake.sensors.lidar.patterns import (
    NoddingPattern,
    RosettePattern,
    SpinningPattern,
)
from evaluation.lidar_sheets import (
    LONGEST_PERIOD,
    LidarSheet,
    NoddingSheet,
    ReturnsSheet,
    RosetteSheet,
    SpinningSheet,
    find_sheet,
)

UnitPattern: TypeAlias = SpinningPattern | RosettePattern | NoddingPattern
_Pattern = TypeVar("_Pattern", bound=BeamPattern)


def make_beam_pattern(
    unit: str | Path | LidarSheet,
    period: float | None = None,
    *,
    num_columns: int | None = None,
    min_range: float | None = None,
    max_range: float | None = None,
) -> UnitPattern:
    """Returns the beam pattern of a LiDAR.

    Args:
        unit: a key of `LIDAR_PRESETS`, the file of a data sheet, or a data
            sheet.
        period: duration of a revolution [s]; by default the duration in the
            data sheet.
        num_columns: columns in a revolution; by default the number in the data
            sheet. If the lasers of a unit fire at a fixed rate, the period
            determines this number.
        min_range: nearest range that is measured [m]; by default the value in
            the data sheet.
        max_range: farthest range that is measured [m]; by default the value in
            the data sheet.

    Raises:
        ValueError: there is no preset of that name, `num_columns` is given for
            a LiDAR without columns, or a value is impossible.
        InputError: the file cannot be read, or is no data sheet.

    Example:
        from cns_drake import LIDAR_PRESETS, make_beam_pattern

        patterns = [make_beam_pattern(name, 0.1) for name in LIDAR_PRESETS]
    """
    sheet = find_sheet(unit)
    if period is not None and not 0.0 < period <= LONGEST_PERIOD:
        raise ValueError(
            f"period: {period:g} s is not above 0 and up to {LONGEST_PERIOD:g}"
        )
    if isinstance(sheet, SpinningSheet):
        if sheet.fires_steadily and period and num_columns is None:
            num_columns = max(round(sheet.columns * period / sheet.period), 1)
    elif num_columns is not None:
        raise ValueError(
            f"columns: a LiDAR with the pattern '{sheet.pattern}' has none"
        )
    common: dict[str, Any] = {
        "period": sheet.period if period is None else period,
        "min_range": sheet.ranges[0] if min_range is None else min_range,
        "max_range": sheet.ranges[1] if max_range is None else max_range,
    }
    match sheet:
        case SpinningSheet():
            limits = sheet.azimuths_deg
            return SpinningPattern(
                tuple(np.deg2rad(sheet.elevations).tolist()),
                sheet.columns if num_columns is None else num_columns,
                azimuths_rad=(
                    None
                    if limits is None
                    else tuple(np.deg2rad(limits).tolist())
                ),
                **common,
            )
        case RosetteSheet():
            return RosettePattern(
                sheet.fov_deg,
                height_deg=sheet.height_deg,
                num_lines=sheet.num_lines,
                points_per_second=sheet.points_per_second,
                **common,
            )
        case NoddingSheet():
            return NoddingPattern(
                sheet.elevations_deg,
                num_lines=sheet.num_lines,
                points_per_second=sheet.points_per_second,
                **common,
            )
    raise AssertionError(sheet)  # There is no other kind.


def revolution_at_rate(
    unit: str | Path | LidarSheet,
    rate: float | None,
    num_columns: int | None = None,
) -> float:
    """Returns the duration of a revolution of a LiDAR that takes scans [s].

    It is the duration in the data sheet, or 1 / `rate` if that is shorter.

    Args:
        unit: as for `make_beam_pattern`.
        rate: scans per second; None for the duration in the data sheet.
        num_columns: as for `make_beam_pattern`.

    Raises:
        ValueError: see `make_beam_pattern`, or the rate is out of range.

    Warns:
        UserWarning: the revolution has fewer beams than in the data sheet.
    """
    sheet = find_sheet(unit)
    if rate is None:
        return sheet.period
    period = period_of_rate(rate, LONGEST_PERIOD)
    if period >= sheet.period:
        return sheet.period
    num_beams, usual = (
        make_beam_pattern(sheet, one, num_columns=num_columns).num_beams
        for one in (period, None)
    )
    if num_beams != usual:
        warnings.warn(
            f"rate: {rate:g} scans per second: a revolution takes {period:g} s "
            f"and has {num_beams} beams, not {sheet.period:g} s and {usual} "
            "beams as in the data sheet",
            stacklevel=3,
        )
    return period


def aimed(pattern: _Pattern, sheet: ReturnsSheet) -> _Pattern:
    """Returns a pattern with the elevations that were measured on one unit.

    If the elevations are not known (see `Head`), or the pattern is not spinning
    or has another number of rings, the pattern is returned unchanged.
    """
    own = tuple(map(math.radians, sheet.head.elevations_deg))
    if not isinstance(pattern, SpinningPattern):
        return pattern
    is_own = len(own) == pattern.num_rings
    return replace(pattern, elevations_rad=own) if is_own else pattern
