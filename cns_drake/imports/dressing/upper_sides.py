"""The upper sides of buildings, to find their height at a place."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import STRtree

from cns_drake.imports.dressing.wall_panels import unit_normals

# The z of a unit normal is greater than this on faces that look upwards.
_UPWARDS = 0.05


def looks_up(triangles: np.ndarray) -> np.ndarray:
    """Returns which of the triangles (M, 3, 3) look upwards."""
    return np.asarray(unit_normals(triangles)[:, 2] > _UPWARDS)


def turned_up(triangles: np.ndarray) -> np.ndarray:
    """Returns triangles (M, 3, 3) with those that look downwards reversed."""
    is_down = unit_normals(triangles)[:, 2] < 0.0
    return np.where(is_down[:, None, None], triangles[:, ::-1], triangles)


class UpperSides:
    """The upper sides of solids, with their height at any place."""

    def __init__(self, triangles: np.ndarray):
        """Collects the upper sides.

        Args:
            triangles: (M, 3, 3) of solids; those that do not look upwards are
                left out [m].
        """
        self._triangles = triangles[looks_up(triangles)]
        self._normals = unit_normals(self._triangles)
        rings = self._triangles[:, [0, 1, 2, 0], :2]
        self._tree = STRtree(np.asarray(shapely.polygons(rings)))

    def heights(self, xy: np.ndarray) -> np.ndarray:
        """Returns the greatest height (N,) at places (N, 2), or -inf [m]."""
        highest = np.full(len(xy), -np.inf)
        place, triangle = self._tree.query(shapely.points(xy), "intersects")
        corner = self._triangles[triangle, 0]
        normal = self._normals[triangle]
        aside = ((xy[place] - corner[:, :2]) * normal[:, :2]).sum(axis=1)
        np.maximum.at(highest, place, corner[:, 2] - aside / normal[:, 2])
        return highest

    def hides(self, points: np.ndarray) -> np.ndarray:
        """Returns which of the points (N, 3) are below an upper side."""
        return np.asarray(self.heights(points[:, :2]) > points[:, 2])
