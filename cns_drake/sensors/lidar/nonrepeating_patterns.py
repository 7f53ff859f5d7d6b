"""Beam patterns that differ from frame to frame: rosette and nodding.

The scan patterns of Livox's LiDARs do not repeat. Livox publishes their fields
of view, rates and numbers of lines, but no formula for the motion of the beams.
`RosettePattern` and `NoddingPattern` state what they assume. Directions depend
only on time, so that a frame of a given number always has the same directions.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from functools import lru_cache
import math

import numpy as np

from cns_drake.sensors.lidar.beams import BeamPattern, Beams, make_beams

# Revolutions per second of the two wedge prisms of the Mid series: 7294 and
# -4664 per minute, the defaults of HELIOS++ for such optics. Together they
# repeat after 30 s.
_PRISMS_HZ = (7294.0 / 60.0, -4664.0 / 60.0)
# Revolutions per second about z of a Mid-360's beams: each of four lines ten
# times in 0.1 s, where the user manual speaks of 40 lines.
_TURNS_HZ = 100.0
# Ups and downs per second: not a simple fraction of the revolutions, so that
# the pattern repeats only after a long time.
_NODS_HZ = 5.0 * (np.sqrt(5.0) - 1.0)


@dataclass(frozen=True)
class _TimedPattern(BeamPattern):
    """A pattern of `num_lines` beams that fire together at a constant rate.

    Line 0 is the highest. The limits of the range are in m, the period of a
    frame in s.
    """

    _: KW_ONLY
    points_per_second: float
    min_range: float
    max_range: float
    period: float
    num_lines: int = 1

    repeats = False
    # Firing times follow from the duration of a frame.
    num_columns = None

    def __post_init__(self) -> None:
        """Checks the values.

        Raises:
            ValueError: one of them is impossible.
        """
        self.check()
        if not 0.0 < self.points_per_second < math.inf:
            raise ValueError(
                f"points_per_second: {self.points_per_second:g} is no rate"
            )
        if self.num_lines < 1:
            raise ValueError(f"num_lines: {self.num_lines} is no number")

    @property
    def num_rings(self) -> int:
        return self.num_lines

    @property
    def num_firings(self) -> int:
        """Number of firings in a frame; all lines fire in each of them."""
        points = self.points_per_second * self.period
        return max(round(points / self.num_lines), 1)

    def beams(self, frame: int) -> Beams:
        return _beams_of_frame(self, frame)

    @abstractmethod
    def directions(self, times: np.ndarray) -> np.ndarray:
        """Returns the directions of all beams at the times of firings.

        Args:
            times: (F,) times of the firings since the start of the drive [s].

        Returns:
            (F, num_lines, 3) unit vectors in the sensor's frame S.
        """


@lru_cache(maxsize=4)
def _beams_of_frame(pattern: _TimedPattern, frame: int) -> Beams:
    """Returns the beams of a frame; equal patterns share one result.

    Sharing saves memory, because Drake's bindings may keep a dropped Diagram
    with its patterns.
    """
    firing = np.arange(pattern.num_firings)
    step = pattern.period / pattern.num_firings
    # A float can hold the number of any frame.
    first = float(frame * pattern.num_firings)
    d_Sset = pattern.directions((first + firing) * step)
    return make_beams(
        d_Sset.reshape(-1, 3),
        np.tile(np.arange(pattern.num_lines), pattern.num_firings),
        np.repeat(np.round(firing * step * 1e9), pattern.num_lines),
    )


@dataclass(frozen=True)
class RosettePattern(_TimedPattern):
    """The pattern of two counter-rotating wedge prisms and a row of lasers.

    Each prism bends a beam by a quarter of the field of view, and both bends
    add up as vectors. The field of view is therefore a disc about x, densest in
    its middle. This holds to first order: a real prism bends an oblique beam
    somewhat more. If there is a vertical row of lasers, each laser scans a disc
    of its own.

    Attributes:
        fov_deg: full opening angle of a disc [deg].
        height_deg: angle between the highest and the lowest laser [deg].

    Example:
        from cns_drake import RosettePattern

        mid_70 = RosettePattern(
            70.4, points_per_second=1e5, min_range=0.05, max_range=130.0,
            period=0.1,
        )
    """

    fov_deg: float
    height_deg: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (0.0 < self.fov_deg <= 360.0 and 0.0 <= self.height_deg < 180.0):
            raise ValueError(
                f"fov_deg {self.fov_deg:g}, height_deg {self.height_deg:g}: "
                "beyond 0 to 360 deg, or 0 to 180 deg"
            )

    def directions(self, times: np.ndarray) -> np.ndarray:
        first, second = (2.0 * np.pi * hz * times for hz in _PRISMS_HZ)
        bend = np.deg2rad(self.fov_deg) / 4.0
        left = bend * (np.cos(first) + np.cos(second))
        up = bend * (np.sin(first) + np.sin(second))
        angle = np.hypot(left, up)
        x = np.cos(angle)
        # sin(angle) / angle, which numpy has with pi in it.
        y, z = left * np.sinc(angle / np.pi), up * np.sinc(angle / np.pi)
        top = self.height_deg / 2.0 if self.num_lines > 1 else 0.0
        lines = np.deg2rad(np.linspace(top, -top, self.num_lines))
        cos, sin = np.cos(lines), np.sin(lines)
        return np.stack(
            [
                x[:, None] * cos - z[:, None] * sin,
                np.broadcast_to(y[:, None], (len(times), self.num_lines)),
                x[:, None] * sin + z[:, None] * cos,
            ],
            axis=-1,
        )


@dataclass(frozen=True)
class NoddingPattern(_TimedPattern):
    """A pattern of lasers (lines) that rotate and slowly nod up and down.

    Each line nods within a band of elevations of its own; the bands are of
    equal height and fill the field of view. The lines rotate about z 100 times
    a second and nod 6.18 times a second. The ratio of these rates is not a
    simple fraction, so each frame fills gaps that earlier frames left.

    Attributes:
        elevations_deg: lowest and highest elevation. Line 0 has the highest
            band between these limits.

    Example:
        from cns_drake import NoddingPattern

        mid_360 = NoddingPattern(
            (-7.0, 52.0), num_lines=4, points_per_second=2e5,
            min_range=0.1, max_range=70.0, period=0.1,
        )
    """

    elevations_deg: tuple[float, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = self.elevations_deg
        if not -90.0 <= low < high <= 90.0:
            raise ValueError(
                f"elevations_deg: {low:g}, {high:g}: not from the lowest to "
                "the highest, within -90 to 90 deg"
            )

    def directions(self, times: np.ndarray) -> np.ndarray:
        azimuth = (np.pi - 2.0 * np.pi * _TURNS_HZ * times)[:, None]
        phase = _NODS_HZ * times % 1.0
        height = 1.0 - np.abs(2.0 * phase - 1.0)  # 0 up to 1, and down.
        low, high = np.deg2rad(self.elevations_deg)
        band = (high - low) / self.num_lines
        lines = np.arange(self.num_lines)
        elevation = high - band * (lines + 1.0 - height[:, None])
        return np.stack(
            [
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ],
            axis=-1,
        )
