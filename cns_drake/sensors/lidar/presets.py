"""Beam patterns of commercial units, from their data sheets."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from cns_drake.sensors.lidar.livox_patterns import (
    NoddingPattern,
    RosettePattern,
)
from cns_drake.sensors.lidar.patterns import BeamPattern, SpinningPattern


class LidarPreset(NamedTuple):
    """A unit.

    Attributes:
        pattern: its beams.
        source: where their numbers come from.
    """

    pattern: SpinningPattern | RosettePattern | NoddingPattern
    source: str


def _spinning(
    elevations_rad: tuple[float, ...],
    num_columns: int,
    min_range: float,
    max_range: float,
    source: str,
    *,
    period: float = 0.05,
    azimuths_rad: tuple[float, float] | None = None,
) -> LidarPreset:
    return LidarPreset(
        SpinningPattern(
            elevations_rad,
            num_columns,
            min_range,
            max_range,
            period,
            azimuths_rad,
        ),
        source,
    )


def _uniform_deg(
    top: float, bottom: float, num_rings: int
) -> tuple[float, ...]:
    elevations = np.deg2rad(np.linspace(top, bottom, num_rings))
    return tuple(float(elevation) for elevation in elevations)


def _radians(*parts_deg: np.ndarray | tuple[float, ...]) -> tuple[float, ...]:
    elevations = np.deg2rad(np.concatenate(parts_deg))
    return tuple(float(elevation) for elevation in elevations)


# Two blocks of 32 lasers, in steps of 1/3 deg and of 1/2 deg.
_HDL_64E = _radians(np.linspace(2.0, -8.33, 32), np.linspace(-8.83, -24.33, 32))
_PANDAR_64 = _radians(
    (15.0, 11.0, 8.0, 5.0, 3.0),
    np.linspace(2.0, -6.0, 49),
    np.linspace(-7.0, -14.0, 8),
    (-19.0, -25.0),
)
_ALPHA_PRIME = _radians(
    4.61 + 10.39 * np.linspace(1.0, 1.0 / 14.0, 14) ** 1.7,
    np.linspace(4.61, -6.5, 102),
    (-6.65, -6.85, -7.15, -7.65, -8.352, -9.244),
    (-10.346, -11.742, -13.565, -16.042, -19.582, -25.0),
)


LIDAR_PRESETS: dict[str, LidarPreset] = {
    "cns": _spinning(
        _uniform_deg(22.5, -22.5, 32),
        1024,
        0.8,
        120.0,
        "the CNS paper: 32 channels, +-22.5 deg, 120 m, after Ouster's OS1",
    ),
    "os0-128": _spinning(
        _uniform_deg(45.0, -45.0, 128),
        1024,
        0.3,
        50.0,
        "Ouster OS0 data sheet rev. C: 128 channels over 90 deg, 1024 "
        "columns at 20 Hz, 50 m at 80 %",
    ),
    "os1-32": _spinning(
        _uniform_deg(22.5, -22.5, 32),
        1024,
        0.5,
        120.0,
        "Ouster OS1 data sheet rev. C, uniform 32-channel configuration",
    ),
    "os1-64": _spinning(
        _uniform_deg(22.5, -22.5, 64),
        1024,
        0.5,
        120.0,
        "Ouster OS1 data sheet rev. C, uniform 64-channel configuration",
    ),
    "os1-128": _spinning(
        _uniform_deg(22.5, -22.5, 128),
        1024,
        0.5,
        120.0,
        "Ouster OS1 data sheet rev. C, 128 channels",
    ),
    "os1-64-33": _spinning(
        _uniform_deg(16.6, -16.6, 64),
        1024,
        0.8,
        120.0,
        "Ouster OS1-64 data sheet, first generation: 64 channels over 33.2 deg",
    ),
    "os1-128-42": _spinning(
        _uniform_deg(21.2, -21.2, 128),
        1024,
        0.5,
        200.0,
        "Ouster OS1 data sheet rev. 7: 128 channels over 42.4 deg, 200 m",
    ),
    "vlp-16": _spinning(
        _uniform_deg(15.0, -15.0, 16),
        900,
        0.5,
        100.0,
        "Velodyne VLP-16 data sheet: 2 deg steps, 0.4 deg columns at 20 Hz",
    ),
    "hdl-64e": _spinning(
        _HDL_64E,
        1040,
        0.9,
        120.0,
        "Velodyne HDL-64E S2/S3 manual: 2 to -8.33 deg in steps of 1/3 deg, "
        "-8.83 to -24.33 deg in steps of 1/2 deg, 0.346 deg columns at 20 Hz",
    ),
    "hdl-32e": _spinning(
        _uniform_deg(10.67, -30.67, 32),
        1085,
        1.0,
        100.0,
        "Velodyne HDL-32E manual: 32 lasers from +10.67 to -30.67 deg, a "
        "firing each 46.08 us, 1 to 100 m",
    ),
    "alpha-prime": _spinning(
        _ALPHA_PRIME,
        938,
        0.5,
        245.0,
        "Velodyne Alpha Prime data sheet: 128 channels from +15 to -25 deg, "
        "0.11 deg at least, 245 m, a firing each 53.3 us; angles in between "
        "approximate: even in the middle, ever farther apart above and below",
    ),
    "hesai-pandar64": _spinning(
        _PANDAR_64,
        900,
        0.3,
        200.0,
        "Hesai Pandar64 user manual: 64 channels from +15 to -25 deg, 1/6 deg "
        "from +2 to -6 deg, 0.4 deg columns at 20 Hz, 0.3 to 200 m",
    ),
    "hesai-pandar-xt32": _spinning(
        _uniform_deg(15.0, -16.0, 32),
        1000,
        0.05,
        120.0,
        "Hesai PandarXT-32 user manual: 32 channels from +15 to -16 deg, "
        "0.36 deg columns at 20 Hz, 0.05 to 120 m",
    ),
    "hokuyo-ust-20lx": _spinning(
        (0.0,),
        1081,
        0.06,
        20.0,
        "Hokuyo UST-20LX specification: 270 deg in steps of 0.25 deg, "
        "counter-clockwise, 25 ms a turn, 0.06 to 20 m",
        period=0.025,
        azimuths_rad=(-0.75 * np.pi, 0.75 * np.pi),
    ),
    "mid-70": LidarPreset(
        RosettePattern(
            70.4,
            points_per_second=100_000.0,
            min_range=0.05,
            max_range=130.0,
            period=0.1,
        ),
        "Livox Mid-70 user manual: a disc of 70.4 deg, 100,000 points/s, "
        "0.05 m to 130 m at 20 %; prisms as in `RosettePattern`",
    ),
    "avia": LidarPreset(
        RosettePattern(
            70.4,
            points_per_second=240_000.0,
            min_range=1.0,
            max_range=320.0,
            period=0.1,
            num_lines=6,
            height_deg=6.8,
        ),
        "Livox Avia user manual: 6 lines, 70.4 x 77.2 deg without repeating, "
        "240,000 points/s, 1 m to 320 m at 80 %; prisms as in "
        "`RosettePattern`, whose discs of 70.4 deg then span 6.8 deg",
    ),
    "mid-360": LidarPreset(
        NoddingPattern(
            (-7.0, 52.0),
            points_per_second=200_000.0,
            min_range=0.1,
            max_range=70.0,
            period=0.1,
            num_lines=4,
        ),
        "Livox Mid-360 user manual: 4 lines, 360 deg, -7 to 52 deg, 200,000 "
        "points/s, 0.1 m to 70 m at 80 %; its motion as in `NoddingPattern`",
    ),
}


def make_beam_pattern(
    preset: str,
    period: float | None = None,
    *,
    num_columns: int | None = None,
    min_range: float | None = None,
    max_range: float | None = None,
) -> BeamPattern:
    """Returns the pattern of a preset, with other values if given.

    Args:
        preset: a key of `LIDAR_PRESETS`; `source` there names its data sheet.
        period: duration of a turn [s].
        num_columns: columns in a turn.
        min_range: nearest range that is measured [m].
        max_range: farthest range that is measured [m].

    Raises:
        KeyError: there is no preset of that name.
        ValueError: the preset has no columns to choose.

    Example:
        from cns_drake import LIDAR_PRESETS, make_beam_pattern

        patterns = [make_beam_pattern(name, 0.1) for name in LIDAR_PRESETS]
    """
    if preset not in LIDAR_PRESETS:
        raise KeyError(
            f"no LiDAR preset '{preset}'; there are: {', '.join(LIDAR_PRESETS)}"
        )
    base = LIDAR_PRESETS[preset].pattern
    if num_columns is not None and base.num_columns is None:
        raise ValueError(f"the preset '{preset}' has no columns")
    changes: dict[str, Any] = {
        "period": period,
        "num_columns": num_columns,
        "min_range": min_range,
        "max_range": max_range,
    }
    return replace(
        base,
        **{name: one for name, one in changes.items() if one is not None},
    )
