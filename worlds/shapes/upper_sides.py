"""The upper sides of solids, and their height at any place."""

import numpy as np
import shapely

from worlds.shapes.triangles import from_above, looks_up, unit_normals


class UpperSides:
    """The upper sides of solids, and their height at any place.

    The constructor takes the triangles (M, 3, 3) of all surfaces [m], and keeps
    the triangles that face upwards.
    """

    def __init__(self, triangles: np.ndarray):
        self._triangles = triangles[looks_up(triangles)]
        self._normals = unit_normals(self._triangles)
        self._tree = shapely.STRtree(from_above(self._triangles))

    def heights(self, xy: np.ndarray) -> np.ndarray:
        """Returns the height (N,) of the highest surface at places (N, 2) [m].

        The height is -inf at a place without a surface.
        """
        highest = np.full(len(xy), -np.inf)
        np.maximum.at(highest, *self.levels(xy))
        return highest

    def levels(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the heights of all surfaces at places (N, 2) [m].

        The results are (M,) the numbers of the places, and (M,) a height of a
        surface at each.
        """
        place, triangle = self._tree.query(shapely.points(xy), "intersects")
        corner = self._triangles[triangle, 0]
        normal = self._normals[triangle]
        aside = ((xy[place] - corner[:, :2]) * normal[:, :2]).sum(axis=1)
        return place, corner[:, 2] - aside / normal[:, 2]

    def hides(self, points: np.ndarray) -> np.ndarray:
        """Returns (N,) bool: whether points (N, 3) lie below a surface."""
        return np.asarray(self.heights(points[:, :2]) > points[:, 2])
