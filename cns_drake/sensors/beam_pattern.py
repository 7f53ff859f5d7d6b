"""Directions and firing times of the beams of a LiDAR."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

# One return, in the sensor frame. Fields have C alignment, for readers that map
# structs onto the bytes.
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


# Height of the bands in which beams without an order of their own are cast.
_BAND_RAD = 0.03


@dataclass(frozen=True, eq=False)
class Beams:
    """The N beams of one turn, in the order in which they fire.

    Attributes:
        d_Sset: (N, 3) float64 unit directions, expressed in the sensor frame
            S (x forward, y left, z up).
        ring: (N,) uint16, number of the emitter.
        column: (N,) int, index of its firing time.
        column_t_ns: (C,) uint32 firing times since the start of the turn,
            rising.
        packet_order: (N,) beams in the order of casting: neighbours point
            nearly the same way and meet the same geometry, which makes packets
            of rays fast.
    """

    d_Sset: np.ndarray
    ring: np.ndarray
    column: np.ndarray
    column_t_ns: np.ndarray
    packet_order: np.ndarray

    @cached_property
    def t_ns(self) -> np.ndarray:
        """(N,) uint32 firing time since the start of the turn."""
        return self.column_t_ns[self.column]

    @cached_property
    def cast_columns(self) -> np.ndarray | None:
        """(N,) columns in packet order; None if they simply repeat."""
        columns = self.column[self.packet_order]
        turns, rest = divmod(len(columns), max(len(self.column_t_ns), 1))
        once = np.arange(len(self.column_t_ns))
        if rest == 0 and np.array_equal(columns, np.tile(once, turns)):
            return None
        return columns


def make_beams(d_Sset: np.ndarray, ring: np.ndarray, t_ns: np.ndarray) -> Beams:
    """Returns beams that may point anywhere.

    Args:
        d_Sset: (N, 3) unit directions, in the order of firing.
        ring: (N,).
        t_ns: (N,) firing times, not decreasing.
    """
    elevation = np.arcsin(np.clip(d_Sset[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(d_Sset[:, 1], d_Sset[:, 0])
    bands = np.floor(elevation / _BAND_RAD)
    column_t_ns, column = np.unique(t_ns, return_inverse=True)
    return Beams(
        d_Sset,
        ring.astype(np.uint16),
        column,
        column_t_ns.astype(np.uint32),
        np.lexsort((azimuth, bands)),
    )


class BeamPattern(ABC):
    """The beams of a LiDAR, turn by turn.

    A turn is the time of one scan, and depends on the unit. Firing times are
    the same in all turns; directions may differ.

    Attributes:
        min_range: nearest measured range [m].
        max_range: farthest measured range [m].
        period: duration of one turn [s].
        repeats: whether all turns are alike.

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
        """Returns the beams of a turn.

        Args:
            frame: its number.
        """

    @property
    def num_beams(self) -> int:
        return len(self.beams(0).column)

    @property
    def column_t_ns(self) -> np.ndarray:
        """(C,) uint32 firing times since the start of a turn."""
        return self.beams(0).column_t_ns

    def within(
        self,
        azimuths_deg: tuple[float, float] = (-180.0, 180.0),
        elevations_deg: tuple[float, float] = (-90.0, 90.0),
    ) -> BeamPattern:
        """Returns the pattern without the beams outside a field of view.

        Args:
            azimuths_deg: the limits; if the first one is greater, the rear is
                in sight.
            elevations_deg: the limits.

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
        """See `BeamPattern.within`."""
        self.min_range, self.max_range = whole.min_range, whole.max_range
        self.period, self.repeats = whole.period, whole.repeats
        self._whole = whole
        self._azimuths_deg = azimuths_deg
        self._elevations_deg = elevations_deg
        self._first = self._limit(0)
        if len(self._first.column) == 0:
            raise ValueError(
                f"no beam within azimuths {azimuths_deg} and elevations "
                f"{elevations_deg} [deg]"
            )

    def beams(self, frame: int) -> Beams:
        if self.repeats or frame == 0:
            return self._first
        return self._limit(frame)

    def _limit(self, frame: int) -> Beams:
        beams = self._whole.beams(frame)
        x, y, z = beams.d_Sset.T
        azimuth = np.rad2deg(np.arctan2(y, x))
        elevation = np.rad2deg(np.arcsin(np.clip(z, -1.0, 1.0)))
        # Beams on a limit are inside, with either rounding.
        low, high = self._azimuths_deg[0] - 1e-9, self._azimuths_deg[1] + 1e-9
        if low <= high:
            kept = (azimuth >= low) & (azimuth <= high)
        else:
            kept = (azimuth >= low) | (azimuth <= high)
        kept &= elevation >= self._elevations_deg[0] - 1e-9
        kept &= elevation <= self._elevations_deg[1] + 1e-9
        place = np.cumsum(kept) - 1
        order = beams.packet_order[kept[beams.packet_order]]
        # All firing times stay, so that all turns have the same.
        return Beams(
            beams.d_Sset[kept],
            beams.ring[kept],
            beams.column[kept],
            beams.column_t_ns,
            place[order],
        )
