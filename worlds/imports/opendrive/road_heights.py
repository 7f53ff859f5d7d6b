"""The heights of imported roads, sidewalks and the ground near them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from evaluation.base import cos, sin, tan
from worlds.imports.opendrive.lanes import LEAST_WIDTH, SAG, LaneBand, is_raised

# Number of nearby places whose planes are averaged.
_NEIGHBOURS = 8
# Distance between the places of a lane [m].
_PLACE_SPACING = 0.5
# A kerb within this distance of a sidewalk has the sidewalk's height [m].
_BESIDE = 1.0
# Nearer places have more weight; this distance limits their weight [m].
_CORE = 0.05
# Number of places that are processed at a time.
_BLOCK = 200_000
# Roads are level if no height [m] and no slope is greater than this.
_LEVEL = 1e-9


class RoadHeights:
    """The height of imported carriageways, and of the ground near them.

    At a place on a single road, the height is exact. Where roads with different
    heights overlap in a junction, the height changes gradually from one road to
    the other (Shepard's interpolation between planes with the grade and roll of
    the roads).
    """

    def __init__(self, bands: Sequence[LaneBand]):
        """Takes all lanes on the ground, at least one."""
        rows = []
        for band in bands:
            columns = band.middle, band.heading, band.roll, band.grade
            rows.append(_interpolated(band, np.column_stack(columns)))
        places = np.concatenate(rows)
        self._p = places[:, :3]
        heading, roll, grade = places[:, 3:].T
        across = tan(roll)
        self._slope = np.stack(
            [
                grade * cos(heading) - across * sin(heading),
                grade * sin(heading) + across * cos(heading),
            ],
            axis=1,
        )
        self._tree = cKDTree(self._p[:, :2])

    @property
    def is_level(self) -> bool:
        """Whether all roads lie at z = 0."""
        return bool(
            np.abs(self._p[:, 2]).max() < _LEVEL
            and np.abs(self._slope).max() < _LEVEL
        )

    def heights(self, xy: ArrayLike) -> np.ndarray:
        """Returns the heights (N,) at places (N, 2) [m]."""
        xy = np.asarray(xy, dtype=float).reshape(-1, 2)
        blocks = [
            self._heights_of_block(xy[first : first + _BLOCK])
            for first in range(0, len(xy), _BLOCK)
        ]
        return np.concatenate([np.zeros(0), *blocks])

    def _heights_of_block(self, xy: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) at places (N, 2), all at a time [m]."""
        count = min(_NEIGHBOURS, len(self._p))
        distance, index = self._tree.query(xy, k=count)
        distance, index = distance.reshape(-1, count), index.reshape(-1, count)
        away = xy[:, None] - self._p[index, :2]
        z = self._p[index, 2] + (self._slope[index] * away).sum(axis=2)
        weight = 1.0 / (distance**2 + _CORE**2) ** 2
        return (z * weight).sum(axis=1) / weight.sum(axis=1)


class KerbHeights:
    """The height of imported sidewalks above the road, by place.

    An object is called with places (N, 2) in W [m], and returns heights (N,)
    [m].

    Attributes:
        usual: usual height of a kerb [m].
        differ: whether the height of any kerb differs from the usual height.
    """

    def __init__(self, bands: Sequence[LaneBand], usual: float):
        """Takes the lanes on the ground, and the usual height of a kerb [m].

        Kerbs without a height in the file, or away from sidewalks, have the
        usual height.
        """
        self.usual = usual
        rows = [np.zeros((0, 6))]
        for band in bands:
            if is_raised(band.kind, band.lane.height):
                rise = np.nan_to_num(band.rise, nan=usual)
                edges = [band.inner[:, :2], band.outer[:, :2], rise]
                places = _interpolated(band, np.column_stack(edges))
                widths = np.linalg.norm(places[:, :2] - places[:, 2:4], axis=1)
                rows.append(places[widths > LEAST_WIDTH])
        places = np.concatenate(rows)
        self._inner, self._outer, self._rise = np.split(places, 3, axis=1)
        self._tree = cKDTree((self._inner + self._outer) / 2.0)
        self.differ = bool((np.abs(self._rise - usual) > SAG).any())

    def __call__(self, xy: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) at places (N, 2) [m]."""
        distance, nearest = self._tree.query(xy)
        inner = self._inner[nearest]
        across = self._outer[nearest] - inner
        width2 = (across**2).sum(axis=1)
        share = ((xy - inner) * across).sum(axis=1) / width2
        at_inner, at_outer = self._rise[nearest].T
        own = at_inner + np.clip(share, 0.0, 1.0) * (at_outer - at_inner)
        is_beside = distance < np.sqrt(width2) / 2.0 + _BESIDE
        return np.where(is_beside, own, self.usual)


def _interpolated(band: LaneBand, rows: np.ndarray) -> np.ndarray:
    """Returns values of a lane at places about 0.5 m apart, (N, K).

    `rows` (M, K) contains the values at the lane's M stations.
    """
    # Both sides of a joint stay, with a stretch of no length between them.
    steps = np.diff(band.s)
    counts = np.maximum(np.ceil(steps / _PLACE_SPACING).astype(int), 1)
    first = np.repeat(np.arange(len(steps)), counts)
    part = (
        np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    ) / counts[first]
    between = rows[first] + part[:, None] * (rows[first + 1] - rows[first])
    return np.concatenate([between, rows[-1:]])
