"""The beams of a revolution, and what every beam pattern has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache
import math

import numpy as np

from evaluation.base import arcsin, arctan2, of_type

# Height of the elevation bands in which beams of irregular patterns are cast.
_BAND_RAD = 0.03
# Greatest value of the field `ring` of a point.
_MOST_RING = 2**16 - 1
# Greatest value of the field `t` of a point [ns].
_LATEST_NS = 2**32 - 1
# Greatest rate of any sensor [1/s].
HIGHEST_RATE = 1000


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
        num_cycles, rest = divmod(len(columns), max(len(self.column_t_ns), 1))
        once = np.arange(len(self.column_t_ns))
        if rest == 0 and np.array_equal(columns, np.tile(once, num_cycles)):
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
    elevation = arcsin(np.clip(d_Sset[:, 2], -1.0, 1.0))
    azimuth = arctan2(d_Sset[:, 1], d_Sset[:, 0])
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
            TypeError: one of them is no number.
            ValueError: one of them is impossible.
        """
        for name in ("min_range", "max_range", "period"):
            of_type(getattr(self, name), float, name)
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
            elevations_deg: limits of the elevation [deg], from -90 to 90.

        Raises:
            ValueError: an argument is not two numbers in this range, or no beam
                is left.
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
        """Limits a pattern; the arguments are as for `BeamPattern.within`.

        Args:
            whole: the pattern.
            azimuths_deg: first and last azimuth [deg].
            elevations_deg: limits of the elevation [deg].
        """
        self.min_range, self.max_range = whole.min_range, whole.max_range
        self.period = whole.period
        self.repeats = whole.repeats
        self._whole = whole
        for name, limits, most in (
            ("azimuths_deg", azimuths_deg, 180.0),
            ("elevations_deg", elevations_deg, 90.0),
        ):
            limits = of_type(limits, tuple[float, float], name)
            if not np.all(np.abs(limits) <= most):
                raise ValueError(
                    f"{name}: {limits} is not two numbers from {-most:g} to "
                    f"{most:g}"
                )
        self._limits = tuple(azimuths_deg), tuple(elevations_deg)
        self._first = _limited_beams(whole.beams(0), *self._limits)
        if len(self._first.column) == 0:
            raise ValueError(
                f"no beam within azimuths {azimuths_deg} and elevations "
                f"{elevations_deg} [deg]"
            )

    def beams(self, frame: int) -> Beams:
        if self.repeats or frame == 0:
            return self._first
        return _limited_beams(self._whole.beams(frame), *self._limits)


@lru_cache(maxsize=4)
def _limited_beams(
    beams: Beams,
    azimuths_deg: tuple[float, ...],
    elevations_deg: tuple[float, ...],
) -> Beams:
    """Returns the beams within limits; equal arguments share one result."""
    x, y, z = beams.d_Sset.T
    azimuth = np.rad2deg(arctan2(y, x))
    elevation = np.rad2deg(arcsin(np.clip(z, -1.0, 1.0)))
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


def period_of_rate(rate: float, longest: float = math.inf) -> float:
    """Returns the time between two scans [s].

    Args:
        rate: scans per second.
        longest: greatest time that is allowed [s].

    Raises:
        TypeError: the rate is no number.
        ValueError: the rate is not positive, or is out of range.
    """
    of_type(rate, float, "rate")
    if not (0.0 < rate <= HIGHEST_RATE and rate * longest >= 1):
        least = f"at least {1.0 / longest:g} and " if longest < math.inf else ""
        raise ValueError(
            f"rate: {rate!r} is not a positive number per second, {least}"
            f"up to {HIGHEST_RATE}"
        )
    return 1.0 / rate
