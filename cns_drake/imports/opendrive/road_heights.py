"""The height of imported roads at any place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from cns_drake.imports.opendrive.lane_bands import LaneBand

# Number of nearby places whose planes give a height, as their mean.
_NEIGHBOURS = 8
# Distance of the places of a lane [m].
_SPACING = 0.5
# Nearer places count more; this distance bounds their weight [m].
_CORE = 0.05
# Places at a time.
_BLOCK = 200_000
_LEVEL = 1e-9


class RoadHeights:
    """The height of imported carriageways, continued to both sides.

    Each place in the middle of a lane has a plane, from the grade and the roll
    of its road. The height is the mean of those nearby (Shepard's
    interpolation): exact on one road, and without a step where roads that
    overlap in a junction differ.
    """

    def __init__(self, bands: Sequence[LaneBand]):
        """Takes all lanes that lie on the ground, at least one."""
        places = np.concatenate([_places(band) for band in bands])
        self._p = places[:, :3]
        heading, roll, grade = places[:, 3:].T
        across = np.tan(roll)
        self._slope = np.stack(
            [
                grade * np.cos(heading) - across * np.sin(heading),
                grade * np.sin(heading) + across * np.cos(heading),
            ],
            axis=1,
        )
        self._tree = cKDTree(self._p[:, :2])

    @property
    def is_level(self) -> bool:
        """Whether all roads lie at z = 0 throughout."""
        return bool(
            np.abs(self._p[:, 2]).max() < _LEVEL
            and np.abs(self._slope).max() < _LEVEL
        )

    def heights(self, xy: ArrayLike) -> np.ndarray:
        """Returns the (N,) heights at (N, 2) places [m]."""
        xy = np.asarray(xy, dtype=float).reshape(-1, 2)
        blocks = [
            self._block(xy[k : k + _BLOCK]) for k in range(0, len(xy), _BLOCK)
        ]
        return np.concatenate([np.zeros(0), *blocks])

    def _block(self, xy: np.ndarray) -> np.ndarray:
        count = min(_NEIGHBOURS, len(self._p))
        distance, index = self._tree.query(xy, k=count)
        distance, index = distance.reshape(-1, count), index.reshape(-1, count)
        away = xy[:, None] - self._p[index, :2]
        z = self._p[index, 2] + (self._slope[index] * away).sum(axis=2)
        weight = 1.0 / (distance**2 + _CORE**2) ** 2
        return (z * weight).sum(axis=1) / weight.sum(axis=1)


def _places(band: LaneBand) -> np.ndarray:
    """Returns (N, 6) places in the middle, heading, roll and grade there."""
    rows = np.column_stack([band.middle, band.heading, band.roll, band.grade])
    # Both sides of a joint stay: the stretch between them has no length.
    steps = np.diff(band.s)
    counts = np.maximum(np.ceil(steps / _SPACING).astype(int), 1)
    first = np.repeat(np.arange(len(steps)), counts)
    part = (
        np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    ) / counts[first]
    between = rows[first] + part[:, None] * (rows[first + 1] - rows[first])
    return np.concatenate([between, rows[-1:]])
