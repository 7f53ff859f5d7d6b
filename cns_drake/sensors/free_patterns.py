"""Beams in any directions, and flashing grids of beams."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.sensors.beam_pattern import BeamPattern, Beams, make_beams


class DirectionPattern(BeamPattern):
    """Beams in chosen directions, the same in every turn.

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
            directions: (N, 3), expressed in the sensor frame S, of any
                length but zero.
            min_range: nearest range that is measured [m].
            max_range: farthest range that is measured [m].
            period: duration of one turn [s].
            times: (N,) when each beam fires, from the start of the turn [s];
                by default all at once.
            rings: (N,) number of each beam's emitter; by default there is one.

        Raises:
            ValueError: there is no beam, a direction is zero or not a number, a
                time is not within the turn, or the numbers of beams differ.
        """
        d_Sset = np.array(directions, dtype=float).reshape(-1, 3)
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
            raise ValueError(f"a time is not within the turn of {period} s")
        self.min_range, self.max_range = min_range, max_range
        self.period = period
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
    """Returns a solid-state LiDAR that lights a grid of pixels at once.

    Pixels are evenly spaced in azimuth and elevation; the outer ones have their
    middles half a pixel within the field of view. Ring 0 is the uppermost row.

    Args:
        width: pixels in a row.
        height: rows.
        fov_deg: field of view, across and up.
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
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
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
