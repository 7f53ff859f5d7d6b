"""Where the beams of a LiDAR point, and when each one fires."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

# One return, in the sensor frame. C alignment, so that every field starts at
# a multiple of its size for readers that map structs onto the bytes.
POINT_DTYPE = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("t", "<u4"),
        ("label", "u1"),
        ("instance", "<u2"),
    ],
    align=True,
)


@dataclass(frozen=True)
class BeamPattern:
    """The beams of one turn of a spinning multi-beam LiDAR.

    In the sensor frame S (x forward, y left, z up) the turn starts at the
    rear and goes clockwise seen from above, as Ouster's and Velodyne's units
    turn: column k of n points at azimuth pi - 2 pi k / n. Ring 0 is the
    highest beam. Beams are ordered as they fire: column by column, and from
    ring 0 downwards in each.

    Attributes:
        elevations_rad: elevation of each ring, descending [rad].
        num_columns: columns in a turn.
        min_range: nearest range that is measured [m].
        max_range: farthest range that is measured [m].
        period: duration of one turn [s].

    Example:
        from cns_drake import BeamPattern

        pattern = BeamPattern((0.1, 0.0, -0.1), 1024, 0.5, 120.0, 0.1)
        print(pattern.d_Sset.shape)
    """

    elevations_rad: tuple[float, ...]
    num_columns: int
    min_range: float
    max_range: float
    period: float

    @property
    def num_rings(self) -> int:
        return len(self.elevations_rad)

    @property
    def num_beams(self) -> int:
        return self.num_rings * self.num_columns

    @cached_property
    def d_Sset(self) -> np.ndarray:
        """(num_beams, 3) float64 unit directions, expressed in S."""
        column = np.arange(self.num_columns)
        azimuth = (np.pi - 2.0 * np.pi * column / self.num_columns)[:, None]
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
        """(num_beams,) beams in the order in which to cast them.

        Ring by ring: neighbours in this order point nearly the same way
        and meet the same geometry, which a packet of rays profits from (by
        1.6 over the firing order, in Metropolis).
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
    def column_t_ns(self) -> np.ndarray:
        """(num_columns,) uint32 firing time since the start of the turn."""
        column_ns = self.period * 1e9 / self.num_columns
        columns = np.arange(self.num_columns)
        return np.round(columns * column_ns).astype(np.uint32)

    @cached_property
    def t_ns(self) -> np.ndarray:
        """(num_beams,) uint32 firing time since the start of the turn."""
        return self.column_t_ns[self.column]


def _uniform_deg(
    top: float, bottom: float, num_rings: int
) -> tuple[float, ...]:
    elevations = np.deg2rad(np.linspace(top, bottom, num_rings))
    return tuple(float(elevation) for elevation in elevations)


def _hdl_64e_elevations() -> tuple[float, ...]:
    # Velodyne HDL-64E S2/S3 manual: an upper block of 32 lasers from +2 deg
    # in steps of 1/3 deg, a lower block of 32 down to -24.8 deg in steps of
    # about 1/2 deg.
    upper = np.linspace(2.0, -8.33, 32)
    lower = np.linspace(-8.83, -24.8, 32)
    elevations = np.deg2rad(np.concatenate([upper, lower]))
    return tuple(float(elevation) for elevation in elevations)


@dataclass(frozen=True)
class _Preset:
    elevations_rad: tuple[float, ...]
    num_columns: int
    min_range: float
    max_range: float
    source: str


LIDAR_PRESETS: dict[str, _Preset] = {
    "cns": _Preset(
        _uniform_deg(22.5, -22.5, 32),
        1024,
        0.8,
        120.0,
        "the CNS paper: 32 channels, +-22.5 deg, 120 m, after Ouster's OS1",
    ),
    "os1-32": _Preset(
        _uniform_deg(22.5, -22.5, 32),
        1024,
        0.5,
        120.0,
        "Ouster OS1 data sheet rev. C, uniform 32-channel configuration",
    ),
    "os1-64": _Preset(
        _uniform_deg(22.5, -22.5, 64),
        1024,
        0.5,
        120.0,
        "Ouster OS1 data sheet rev. C, uniform 64-channel configuration",
    ),
    "os1-128": _Preset(
        _uniform_deg(22.5, -22.5, 128),
        1024,
        0.5,
        120.0,
        "Ouster OS1 data sheet rev. C, 128 channels",
    ),
    "vlp-16": _Preset(
        _uniform_deg(15.0, -15.0, 16),
        900,
        0.5,
        100.0,
        "Velodyne VLP-16 data sheet: 2 deg steps, 0.4 deg columns at 20 Hz",
    ),
    "hdl-64e": _Preset(
        _hdl_64e_elevations(),
        1040,
        0.9,
        120.0,
        "Velodyne HDL-64E S2/S3 manual: 0.346 deg columns at 20 Hz",
    ),
}


def make_beam_pattern(
    preset: str,
    period: float,
    *,
    num_columns: int | None = None,
    min_range: float | None = None,
    max_range: float | None = None,
) -> BeamPattern:
    """Returns the pattern of a preset, with values of one's own if given.

    Raises:
        KeyError: there is no preset of that name.

    Example:
        from cns_drake import LIDAR_PRESETS, make_beam_pattern

        patterns = [make_beam_pattern(name, 0.1) for name in LIDAR_PRESETS]
    """
    base = LIDAR_PRESETS[preset]
    return BeamPattern(
        elevations_rad=base.elevations_rad,
        num_columns=base.num_columns if num_columns is None else num_columns,
        min_range=base.min_range if min_range is None else min_range,
        max_range=base.max_range if max_range is None else max_range,
        period=period,
    )
