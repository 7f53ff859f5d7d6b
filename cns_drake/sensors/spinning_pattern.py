"""Beam patterns of spinning LiDARs, with one ring or many."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cns_drake.sensors.beam_pattern import BeamPattern, Beams


@dataclass(frozen=True)
class SpinningPattern(BeamPattern):
    """The beams of one turn of a spinning LiDAR of one ring or many.

    In the sensor frame S (x forward, y left, z up) the turn starts at the
    rear and goes clockwise seen from above, as Ouster's and Velodyne's units
    turn: column k of n points at azimuth pi - 2 pi k / n. With azimuth limits
    it goes from the first to the last one, both included, and fires only in
    that part of the turn. Ring 0 is the highest beam. Beams are ordered as they
    fire: column by column, and from ring 0 downwards in each.

    Attributes:
        elevations_rad: elevation of each ring, descending [rad].
        num_columns: columns in a turn.
        min_range: nearest range that is measured [m].
        max_range: farthest range that is measured [m].
        period: duration of one turn [s].
        azimuths_rad: first and last azimuth, None for the whole turn [rad].

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

    @property
    def num_rings(self) -> int:
        return len(self.elevations_rad)

    def beams(self, frame: int) -> Beams:
        return self._beams

    @cached_property
    def _beams(self) -> Beams:
        return Beams(
            self.d_Sset,
            self.ring,
            self.column,
            self.column_t_ns,
            self.packet_order,
        )

    @property
    def num_beams(self) -> int:
        return self.num_rings * self.num_columns

    @cached_property
    def d_Sset(self) -> np.ndarray:
        """(num_beams, 3) float64 unit directions, expressed in S."""
        column = np.arange(self.num_columns)
        if self.azimuths_rad is None:
            azimuth = np.pi - 2.0 * np.pi * column / self.num_columns
        else:
            azimuth = np.linspace(*self.azimuths_rad, self.num_columns)
        azimuth = azimuth[:, None]
        elevation = np.asarray(self.elevations_rad)[None, :]
        d = np.stack(
            np.broadcast_arrays(
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ),
            axis=-1,
        ).reshape(-1, 3)
        d.flags.writeable = False
        return d

    @cached_property
    def packet_order(self) -> np.ndarray:
        """(num_beams,) beams in the order of casting.

        The order is ring by ring: neighbours point nearly the same way and meet
        the same geometry, which makes packets of rays faster (by 1.6 against
        the firing order, in Metropolis).
        """
        beams = np.arange(self.num_beams)
        return beams.reshape(self.num_columns, self.num_rings).T.ravel()

    @cached_property
    def ring(self) -> np.ndarray:
        """(num_beams,) uint16 ring of each beam."""
        rings = np.arange(self.num_rings, dtype=np.uint16)
        return np.tile(rings, self.num_columns)

    @cached_property
    def column(self) -> np.ndarray:
        """(num_beams,) int column of each beam."""
        return np.repeat(np.arange(self.num_columns), self.num_rings)

    @cached_property
    def column_t_ns(
        self,
    ) -> np.ndarray:
        """(num_columns,) uint32 firing time since the start of the turn."""
        column_ns = self.period * 1e9 / self.num_columns
        if self.azimuths_rad is not None:
            first, last = self.azimuths_rad
            part = abs(last - first) / (2.0 * np.pi)
            column_ns = part * self.period * 1e9 / max(self.num_columns - 1, 1)
        columns = np.arange(self.num_columns)
        return np.round(columns * column_ns).astype(np.uint32)

    @cached_property
    def t_ns(self) -> np.ndarray:
        """(num_beams,) uint32 firing time since the start of the turn."""
        return self.column_t_ns[self.column]
