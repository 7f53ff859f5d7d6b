"""The beams of a LiDAR: directions and firing times.

The scan patterns of Livox's LiDARs do not repeat. Livox publishes their fields
of view, rates and numbers of lines, but no formula for the motion of the beams.
`RosettePattern` and `NoddingPattern` state what they assume. Directions depend
only on time, so that a frame of a given number always has the same directions.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property, lru_cache
import math

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.base.elementary import cos, sin

# One return, in the sensor frame. Fields have C alignment, for readers that map
# structs onto the bytes. NumPy's copies leave the two bytes after `ring`
# undefined.
POINT_DTYPE = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("t", "<u4"),
        ("label", "<u2"),
        ("instance", "<u2"),
    ],
    align=True,
)


# Height of the elevation bands in which beams of irregular patterns are cast.
_BAND_RAD = 0.03
# Greatest value of the field `ring` of a point.
_MOST_RING = 2**16 - 1
# Greatest value of the field `t` of a point [ns].
_LATEST_NS = 2**32 - 1
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


@dataclass(frozen=True, eq=False)
class Beams:
    """The N beams of one revolution, in the order in which they fire.

    Attributes:
        d_Sset: (N, 3) float64 unit directions, expressed in the sensor frame
            S (x forward, y left, z up).
        ring: (N,) uint16, number of each beam's laser.
        column: (N,) int, index of each beam's firing time in `column_t_ns`.
        column_t_ns: (C,) uint32 firing times since the start of the revolution
            [ns], increasing.
        packet_order: (N,) indices of the beams in the order in which rays are
            cast. Consecutive rays have nearly the same direction and mostly hit
            the same geometry, which makes packets of rays fast.

    Raises:
        ValueError: a ring or a firing time is not a whole number that fits the
            field `ring` or `t` of a point.
    """

    d_Sset: np.ndarray
    ring: np.ndarray
    column: np.ndarray
    column_t_ns: np.ndarray
    packet_order: np.ndarray

    def __post_init__(self) -> None:
        """Checks rings and times, and gives them their types."""
        for name, kind, most, what in (
            ("ring", np.uint16, _MOST_RING, "a ring"),
            ("column_t_ns", np.uint32, _LATEST_NS, "a firing time [ns]"),
        ):
            given = np.asarray(getattr(self, name))
            fits = (given >= 0) & (given <= most) & (given == np.floor(given))
            if not fits.all():
                raise ValueError(
                    f"{what}: {given[~fits][0]:.10g} is not a whole number "
                    f"from 0 to {most}, which a point has room for"
                )
            object.__setattr__(self, name, given.astype(kind))

    @cached_property
    def t_ns(self) -> np.ndarray:
        """(N,) uint32 firing times since the start of the revolution [ns]."""
        return self.column_t_ns[self.column]

    @cached_property
    def cast_columns(self) -> np.ndarray | None:
        """(N,) column of each beam, in the order of `packet_order`.

        None if these columns repeat the sequence 0, 1, ..., C - 1.
        """
        columns = self.column[self.packet_order]
        turns, rest = divmod(len(columns), max(len(self.column_t_ns), 1))
        once = np.arange(len(self.column_t_ns))
        if rest == 0 and np.array_equal(columns, np.tile(once, turns)):
            return None
        return columns


def make_beams(d_Sset: np.ndarray, ring: np.ndarray, t_ns: np.ndarray) -> Beams:
    """Returns beams with arbitrary directions, in firing order.

    Args:
        d_Sset: (N, 3) unit directions, expressed in the sensor frame S.
        ring: (N,) number of each beam's laser.
        t_ns: (N,) firing times since the start of the revolution [ns], not
            decreasing.
    """
    elevation = np.arcsin(np.clip(d_Sset[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(d_Sset[:, 1], d_Sset[:, 0])
    bands = np.floor(elevation / _BAND_RAD)
    column_t_ns, column = np.unique(t_ns, return_inverse=True)
    return Beams(
        d_Sset, ring, column, column_t_ns, np.lexsort((azimuth, bands))
    )


class BeamPattern(ABC):
    """The directions and firing times of a LiDAR's beams.

    A revolution is the time that the LiDAR takes for one scan. Firing times
    within a revolution are the same in all revolutions; directions can differ
    between revolutions.

    Attributes:
        min_range: nearest measured range [m].
        max_range: farthest measured range [m].
        period: duration of one revolution [s].
        repeats: whether all revolutions have the same directions.

    Example:
        from cns_drake import make_beam_pattern

        pattern = make_beam_pattern("vlp-16").within(azimuths_deg=(-60, 60))
        print(pattern.beams(0).d_Sset.shape)
    """

    min_range: float
    max_range: float
    period: float
    repeats: bool = True

    @abstractmethod
    def beams(self, frame: int) -> Beams:
        """Returns the beams of one revolution.

        Args:
            frame: number of the revolution.
        """

    def check(self) -> None:
        """Checks that the range limits and the period are possible.

        Raises:
            ValueError: one of them is impossible.
        """
        if not 0.0 <= self.min_range < self.max_range:
            raise ValueError(
                f"min_range {self.min_range:g}, max_range {self.max_range:g}: "
                "ranges are from 0 on, and the first is below the second"
            )
        if not 0.0 < self.period < math.inf:
            raise ValueError(f"period: {self.period:g} s is no duration")

    @property
    def num_beams(self) -> int:
        """The number of beams of a revolution."""
        return len(self.beams(0).column)

    @property
    def column_t_ns(self) -> np.ndarray:
        """(C,) uint32 firing times since the start of a revolution [ns]."""
        return self.beams(0).column_t_ns

    def within(
        self,
        azimuths_deg: tuple[float, float] = (-180.0, 180.0),
        elevations_deg: tuple[float, float] = (-90.0, 90.0),
    ) -> BeamPattern:
        """Returns a pattern with only the beams inside a field of view.

        Args:
            azimuths_deg: first and last azimuth [deg], from -180 to 180; if the
                first is greater than the last, the field of view includes the
                rear.
            elevations_deg: limits of the elevation [deg].

        Raises:
            ValueError: no beam is left.
        """
        return LimitedPattern(self, azimuths_deg, elevations_deg)


class LimitedPattern(BeamPattern):
    """A pattern limited to the beams in a field of view."""

    def __init__(
        self,
        whole: BeamPattern,
        azimuths_deg: tuple[float, float],
        elevations_deg: tuple[float, float],
    ):
        """Limits a pattern; the arguments are those of `BeamPattern.within`.

        Args:
            whole: the pattern.
            azimuths_deg: first and last azimuth [deg].
            elevations_deg: limits of the elevation [deg].
        """
        self.min_range, self.max_range = whole.min_range, whole.max_range
        self.period = whole.period
        self.repeats = whole.repeats
        self._whole = whole
        self._limits = tuple(azimuths_deg), tuple(elevations_deg)
        self._first = _limit(whole.beams(0), *self._limits)
        if len(self._first.column) == 0:
            raise ValueError(
                f"no beam within azimuths {azimuths_deg} and elevations "
                f"{elevations_deg} [deg]"
            )

    def beams(self, frame: int) -> Beams:
        if self.repeats or frame == 0:
            return self._first
        return _limit(self._whole.beams(frame), *self._limits)


@lru_cache(maxsize=4)
def _limit(
    beams: Beams,
    azimuths_deg: tuple[float, ...],
    elevations_deg: tuple[float, ...],
) -> Beams:
    """Returns the beams within limits; equal arguments share one result."""
    x, y, z = beams.d_Sset.T
    azimuth = np.rad2deg(np.arctan2(y, x))
    elevation = np.rad2deg(np.arcsin(np.clip(z, -1.0, 1.0)))
    # Beams on a limit are inside, with either rounding.
    low, high = azimuths_deg[0] - 1e-9, azimuths_deg[1] + 1e-9
    if low <= high:
        kept = (azimuth >= low) & (azimuth <= high)
    else:
        kept = (azimuth >= low) | (azimuth <= high)
    kept &= elevation >= elevations_deg[0] - 1e-9
    kept &= elevation <= elevations_deg[1] + 1e-9
    place = np.cumsum(kept) - 1
    order = beams.packet_order[kept[beams.packet_order]]
    # All firing times stay, so that all revolutions have the same.
    return Beams(
        beams.d_Sset[kept],
        beams.ring[kept],
        beams.column[kept],
        beams.column_t_ns,
        place[order],
    )


@dataclass(frozen=True)
class SpinningPattern(BeamPattern):
    """The beam pattern of a spinning LiDAR with one or more rings.

    In the sensor frame S (x forward, y left, z up) the revolution starts at the
    rear and goes clockwise seen from above, as Ouster's and Velodyne's units
    turn: column k of n points at azimuth pi - 2 pi k / n. With azimuth limits,
    the unit fires only in the part of the revolution from the first limit to
    the last, including both limits. Ring 0 is the highest beam. Beams are
    ordered as they fire: column by column, and in each column from ring 0
    downwards.

    Attributes:
        elevations_rad: elevation of each ring, descending [rad].
        num_columns: number of columns in a revolution.
        min_range: nearest range that is measured [m].
        max_range: farthest range that is measured [m].
        period: duration of one revolution [s].
        azimuths_rad: first and last azimuth [rad]; None for all azimuths.

    Raises:
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
        self.check()
        if not (self.num_columns >= 1 and self.num_columns % 1 == 0):
            raise ValueError(f"num_columns: {self.num_columns} is no number")
        elevations = np.asarray(self.elevations_rad, float)
        # Equal patterns are found by their hash, which an array has not.
        object.__setattr__(self, "elevations_rad", tuple(elevations.tolist()))
        if not (
            elevations.size
            and (np.abs(elevations) <= math.pi / 2.0).all()
            and (np.diff(elevations) <= 0.0).all()
        ):
            raise ValueError(
                "elevations_rad: they must descend, from pi/2 at most to "
                "-pi/2 at least, and there must be one"
            )
        if not np.ptp(self.azimuths_rad or 0.0) <= 2.0 * math.pi + 1e-9:
            raise ValueError(
                f"azimuths_rad: {self.azimuths_rad} is no range within 360 deg"
            )

    @property
    def num_rings(self) -> int:
        """The number of rings, one for each laser."""
        return len(self.elevations_rad)

    def beams(self, frame: int) -> Beams:
        return _spin(self)

    @property
    def num_beams(self) -> int:
        """The number of beams of a revolution."""
        return self.num_rings * self.num_columns

    @property
    def d_Sset(self) -> np.ndarray:
        """(num_beams, 3) float64 unit directions, expressed in S."""
        return _spin(self).d_Sset


@lru_cache(maxsize=8)
def _spin(pattern: SpinningPattern) -> Beams:
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

    Example:
        from cns_drake import make_flash_pattern

        flash = make_flash_pattern(
            160, 120, (60.0, 45.0), min_range=0.2, max_range=30.0, period=0.05
        )
    """
    across, up = np.deg2rad(fov_deg)
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


# Width of a cell in elevation and in azimuth [deg].
_CELL_DEG = 0.25
# Number of cells in elevation.
_ROWS = round(180 / _CELL_DEG)
# Number of cells in azimuth.
_COLUMNS = round(360 / _CELL_DEG)
# How far a beam covers its surroundings: 1.5 deg, in cells.
_NEAR_CELLS = 6
# Half of the widest gap between beams that still counts as field of view: 12
# deg, in cells.
_GAP_CELLS = 48


class BeamCoverage:
    """The directions that the beams of a revolution cover.

    A beam covers all directions that differ from its own by at most 1.5 deg in
    elevation and in azimuth and lie inside the field of view.

    The field of view consists of cells of 0.25 deg: the cells of the beams; the
    neighbours of the beams' cells, because rounding can move a point into a
    neighbour; and all cells between beams that are up to 24 deg apart (a
    morphological closing).
    """

    def __init__(self, d_Sset: np.ndarray):
        """Takes the directions of the beams, (N, 3) unit vectors in S."""
        # Imported here: the rest of the module needs no library that is slow
        # to load.
        from scipy.ndimage import maximum_filter, minimum_filter

        hit = np.zeros((_ROWS, _COLUMNS), np.uint8)
        hit[_cells(d_Sset)] = 1
        # Azimuths go round, elevations do not.
        modes = ("constant", "wrap")
        field = maximum_filter(hit, 2 * _GAP_CELLS + 1, mode=modes)
        # One cell less: those beside the beams stay.
        field = minimum_filter(field, 2 * _GAP_CELLS - 1, mode=modes, cval=1)
        near = maximum_filter(hit, 2 * _NEAR_CELLS + 1, mode=modes)
        self._is_covered = (near & field).astype(bool)

    def covers(self, d_Sset: np.ndarray) -> np.ndarray:
        """Returns which directions a revolution's beams cover, (N,) bool.

        Args:
            d_Sset: (N, 3) unit directions, expressed in S.
        """
        return self._is_covered[_cells(d_Sset)]


def _cells(d_Sset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns row and column of the cells of unit directions (N, 3)."""
    x, y, z = d_Sset.T
    elevation_deg = np.degrees(np.arcsin(np.clip(z, -1.0, 1.0))) + 90.0
    azimuth_deg = np.degrees(np.arctan2(y, x)) + 180.0
    # The direction straight up is rounded to the upper limit.
    rows = np.minimum((elevation_deg / _CELL_DEG).astype(np.int64), _ROWS - 1)
    return rows, (azimuth_deg / _CELL_DEG).astype(np.int64) % _COLUMNS


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
        return _fire(self, frame)

    @abstractmethod
    def directions(self, times: np.ndarray) -> np.ndarray:
        """Returns the directions of all beams at the times of firings.

        Args:
            times: (F,) times of the firings since the start of the drive [s].

        Returns:
            (F, num_lines, 3) unit vectors in the sensor's frame S.
        """


@lru_cache(maxsize=4)
def _fire(pattern: _TimedPattern, frame: int) -> Beams:
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
