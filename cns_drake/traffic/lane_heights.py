"""Heights of the ground on lanes, also where roads cross at two heights."""

import numpy as np
from scipy.spatial import cKDTree

# Heights that differ by more than this belong to different roads [m].
_LEVEL_HEIGHT = 1.5
# A height is found from at most this many points of lanes, the nearest ones.
_MOST_POINTS = 24
# These points are at most this far away [m].
_REACH = 6.0
# Least cosine of the angle between a vehicle and its lane.
_LEAST_COSINE = 0.7


class LaneHeights:
    """Heights of the ground, interpolated between points on lanes."""

    def __init__(self, points: np.ndarray):
        """Takes points (N, 3) on the ground along lanes [m]."""
        self._tree = cKDTree(points[:, :2])
        self._z = points[:, 2]
        steps = np.diff(points[:, :2], axis=0, prepend=points[:1, :2])
        self._heading = np.arctan2(steps[:, 1], steps[:, 0])

    def at(self, xy: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) of the ground at places (N, 2) [m].

        Each height is a mean of the heights of the nearest points, weighted by
        nearness.
        """
        distance, near = self._tree.query(xy, k=min(4, len(self._z)))
        distance, near = (
            np.reshape(values, (len(xy), -1)) for values in (distance, near)
        )
        return self._weighted(distance, near)

    def along(
        self, xy: np.ndarray, z: np.ndarray, yaw: np.ndarray | None
    ) -> np.ndarray:
        """Returns the heights (M,) of one road user at successive places [m].

        Where two roads cross at different heights, the road user is on the road
        that is nearest to its given height. Without given heights, the road
        user stays on the road on which it arrived, or else is on a road with a
        lane in its direction.

        Args:
            xy: (M, 2) places [m].
            z: (M,) approximate heights [m]; NaN if they are unknown.
            yaw: (M,) headings [rad]; None if the direction does not count.
        """
        found = self.at(xy)
        count = min(_MOST_POINTS, len(self._z))
        distance, near = (
            np.reshape(values, (len(xy), -1))
            for values in self._tree.query(xy, k=count)
        )
        is_near = distance < _REACH
        levels = np.where(is_near, self._z[near], np.nan)
        for k in np.flatnonzero(np.ptp(self._z[near], axis=1) > _LEVEL_HEIGHT):
            usable = np.flatnonzero(is_near[k])
            if not len(usable) or np.ptp(levels[k][usable]) <= _LEVEL_HEIGHT:
                continue
            if yaw is not None:
                turn = self._heading[near[k][usable]] - yaw[k]
                alike = usable[np.abs(np.cos(turn)) > _LEAST_COSINE]
                usable = alike if len(alike) else usable
            moved = np.hypot(*(xy[k] - xy[k - 1])) if k else np.inf
            goal = levels[k][usable[0]]
            if np.isfinite(z[k]):
                goal = z[k]
            elif moved < _REACH:
                goal = found[k - 1]
            off = np.abs(levels[k][usable] - goal)
            usable = usable[off < off.min() + _LEVEL_HEIGHT / 2][:4]
            (found[k],) = self._weighted(
                distance[k][None, usable], near[k][None, usable]
            )
        return found

    def _weighted(self, distance: np.ndarray, near: np.ndarray) -> np.ndarray:
        weight = 1.0 / np.maximum(distance, 0.05) ** 2
        return np.sum(weight * self._z[near], axis=1) / weight.sum(axis=1)
