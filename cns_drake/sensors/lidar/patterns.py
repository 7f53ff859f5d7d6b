"""Beam patterns that repeat: spinning, flash, and any other directions."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field
from functools import lru_cache
import math

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.sensors.lidar.beams import BeamPattern, Beams, make_beams
from evaluation.base import check_fields, cos, of_type, sin, sinc


@dataclass(frozen=True)
class SpinningPattern(BeamPattern):
    """The beam pattern of a spinning LiDAR with one or more rings.

    The revolution starts at the rear and goes clockwise as seen from above,
    like the revolutions of Ouster's and Velodyne's units. In the sensor frame S
    (x forward, y left, z up), column k of n points at azimuth pi - 2 pi k / n.
    With azimuth limits, the unit fires only in the part of the revolution from
    the first limit to the last, including both limits. Ring 0 is the highest
    beam. Beams are ordered as they fire: column by column, and in each column
    from ring 0 downwards.

    Attributes:
        elevations_rad: elevation of each ring, descending [rad].
        num_columns: number of columns in a revolution.
        min_range: nearest range that is measured [m].
        max_range: farthest range that is measured [m].
        period: duration of one revolution [s].
        azimuths_rad: first and last azimuth [rad]; None for all azimuths.

    Raises:
        TypeError: a value is of another type.
        ValueError: a value is impossible, or elevations ascend.

    Example:
        from cns_drake import SpinningPattern

        pattern = SpinningPattern((0.1, 0.0, -0.1), 1024, 0.5, 120.0, 0.1)
        print(pattern.d_Sset.shape)
    """

    elevations_rad: tuple[float, ...]
    num_columns: int
    min_range: float
    max_range: float
    period: float
    azimuths_rad: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        self.check()
        if self.num_columns < 1:
            raise ValueError(f"num_columns: {self.num_columns} is no number")
        elevations = np.asarray(self.elevations_rad)
        azimuths = self.azimuths_rad or (0.0, 0.0)
        if not (
            elevations.size
            and (np.abs(elevations) <= math.pi / 2.0).all()
            and (np.diff(elevations) <= 0.0).all()
        ):
            raise ValueError(
                "elevations_rad: they must descend, from pi/2 at most to "
                "-pi/2 at least, and there must be one"
            )
        if not np.ptp(azimuths) <= 2 * math.pi + 1e-9:
            raise ValueError(
                f"azimuths_rad: {self.azimuths_rad} is no range within 360 deg"
            )

    @property
    def num_rings(self) -> int:
        """The number of rings, one for each laser."""
        return len(self.elevations_rad)

    def beams(self, frame: int) -> Beams:
        return _spinning_beams(self)

    @property
    def num_beams(self) -> int:
        """The number of beams of a revolution."""
        return self.num_rings * self.num_columns

    @property
    def d_Sset(self) -> np.ndarray:
        """(num_beams, 3) float64 unit directions, expressed in S."""
        return _spinning_beams(self).d_Sset


@lru_cache(maxsize=8)
def _spinning_beams(pattern: SpinningPattern) -> Beams:
    """Returns the beams of a pattern; equal patterns share one result.

    Sharing saves memory, because Drake's bindings may keep a dropped Diagram
    with its patterns.
    """
    num_columns, num_rings = int(pattern.num_columns), pattern.num_rings
    columns, rings = np.arange(num_columns), np.arange(num_rings)
    azimuth = np.pi - 2.0 * np.pi * columns / num_columns
    column_ns = pattern.period * 1e9 / num_columns
    if pattern.azimuths_rad is not None:
        first, last = pattern.azimuths_rad
        azimuth = np.linspace(first, last, num_columns)
        part = abs(last - first) / (2.0 * np.pi)
        column_ns = part * pattern.period * 1e9 / max(num_columns - 1, 1)
    azimuth = azimuth[:, None]
    elevation = np.asarray(pattern.elevations_rad)[None, :]
    d_Sset = np.stack(
        np.broadcast_arrays(
            cos(elevation) * cos(azimuth),
            cos(elevation) * sin(azimuth),
            sin(elevation),
        ),
        axis=-1,
    ).reshape(-1, 3)
    d_Sset.flags.writeable = False
    beams = np.arange(pattern.num_beams)
    return Beams(
        d_Sset,
        ring=np.tile(rings, num_columns),
        column=np.repeat(columns, num_rings),
        column_t_ns=np.round(columns * column_ns),
        # Casting ring by ring is faster than in firing order, by a factor of
        # 1.6 in Metropolis.
        packet_order=beams.reshape(num_columns, -1).T.ravel(),
    )


class DirectionPattern(BeamPattern):
    """A pattern of beams in given directions, the same in every revolution.

    Example:
        from cns_drake import DirectionPattern

        cross = DirectionPattern(
            [[1, 0, 0], [1, 0.1, 0], [1, 0, 0.1]],
            min_range=0.1, max_range=20.0, period=0.1,
        )
    """

    def __init__(
        self,
        directions: ArrayLike,
        *,
        min_range: float,
        max_range: float,
        period: float,
        times: ArrayLike | None = None,
        rings: ArrayLike | None = None,
    ):
        """Takes the beams.

        Args:
            directions: (N, 3) directions in the sensor frame S, of any length
                except zero.
            min_range: nearest range that is measured [m].
            max_range: farthest range that is measured [m].
            period: duration of one revolution [s].
            times: (N,) firing time of each beam since the start of the
                revolution [s]; by default all fire at once.
            rings: (N,) number of each beam's emitter; by default there is one
                emitter.

        Raises:
            ValueError: there is no beam, a direction is zero or not a number, a
                time is not within the revolution or beyond 4.29 s, a ring is
                beyond 65535, a limit is impossible, or the numbers of beams
                differ.
        """
        self.min_range, self.max_range = min_range, max_range
        self.period = period
        self.check()
        d_Sset = np.array(directions, dtype=float)
        if d_Sset.size and d_Sset.shape[-1] != 3:
            raise ValueError(
                f"directions: their shape {d_Sset.shape} does not end in 3"
            )
        d_Sset = d_Sset.reshape(-1, 3)
        num_beams = len(d_Sset)
        t = np.zeros(num_beams) if times is None else np.array(times, float)
        ring = np.zeros(num_beams) if rings is None else np.array(rings)
        if num_beams == 0 or t.shape != (num_beams,) or ring.shape != t.shape:
            raise ValueError(
                f"{num_beams} directions, {t.size} times and {ring.size} "
                "rings do not match; give as many of each, and at least one"
            )
        length = np.linalg.norm(d_Sset, axis=1, keepdims=True)
        if not (np.isfinite(length) & (length > 0.0)).all():
            raise ValueError("a direction is zero or not a number")
        if not ((t >= 0.0) & (t < period)).all():
            raise ValueError(
                f"a time is not within the revolution of {period} s"
            )
        order = np.argsort(t, kind="stable")
        t_ns = np.round(t[order] * 1e9)
        self._beams = make_beams((d_Sset / length)[order], ring[order], t_ns)

    def beams(self, frame: int) -> Beams:
        return self._beams


def make_flash_pattern(
    width: int,
    height: int,
    fov_deg: tuple[float, float],
    *,
    min_range: float,
    max_range: float,
    period: float,
) -> DirectionPattern:
    """Returns the pattern of a solid-state LiDAR with a grid of pixels.

    All pixels fire at once. The beams are evenly spaced in azimuth and
    elevation. The centres of the outermost pixels lie half a pixel inside the
    edge of the field of view. Ring 0 is the uppermost row.

    Args:
        width: number of pixels in a row.
        height: number of rows.
        fov_deg: horizontal and vertical field of view [deg].
        min_range: nearest range that is measured [m].
        max_range: farthest range that is measured [m].
        period: time between two flashes [s].

    Raises:
        TypeError: a value is of another type.
        ValueError: a value is impossible.

    Example:
        from cns_drake import make_flash_pattern

        flash = make_flash_pattern(
            160, 120, (60.0, 45.0), min_range=0.2, max_range=30.0, period=0.05
        )
    """
    width, height = of_type(width, int, "width"), of_type(height, int, "height")
    across, up = np.deg2rad(of_type(fov_deg, tuple[float, float], "fov_deg"))
    if not (0.0 < across <= 2.0 * math.pi and 0.0 < up <= math.pi):
        raise ValueError(
            f"fov_deg: {fov_deg} is not above 0, up to 360 and 180 deg"
        )
    azimuth = across * (0.5 - (np.arange(width) + 0.5) / width)
    elevation = up * (0.5 - (np.arange(height) + 0.5) / height)
    elevation, azimuth = np.meshgrid(elevation, azimuth, indexing="ij")
    d_Sset = np.stack(
        [
            cos(elevation) * cos(azimuth),
            cos(elevation) * sin(azimuth),
            sin(elevation),
        ],
        axis=-1,
    )
    return DirectionPattern(
        d_Sset,
        min_range=min_range,
        max_range=max_range,
        period=period,
        rings=np.repeat(np.arange(height), width),
    )


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


@dataclass(frozen=True, kw_only=True)
class _TimedPattern(BeamPattern):
    """A pattern of `num_lines` beams that fire together at a constant rate.

    Line 0 is the highest. The limits of the range are in m, the period of a
    frame in s.
    """

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
            TypeError: one of them is of another type.
            ValueError: one of them is impossible.
        """
        check_fields(self)
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
        left = bend * (cos(first) + cos(second))
        up = bend * (sin(first) + sin(second))
        angle = np.hypot(left, up)
        x = cos(angle)
        # sin(angle) / angle.
        share = sinc(angle / np.pi)
        y, z = left * share, up * share
        top = self.height_deg / 2.0 if self.num_lines > 1 else 0.0
        lines = np.deg2rad(np.linspace(top, -top, self.num_lines))
        c, s = cos(lines), sin(lines)
        return np.stack(
            [
                x[:, None] * c - z[:, None] * s,
                np.broadcast_to(y[:, None], (len(times), self.num_lines)),
                x[:, None] * s + z[:, None] * c,
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
                cos(elevation) * cos(azimuth),
                cos(elevation) * sin(azimuth),
                sin(elevation),
            ],
            axis=-1,
        )
