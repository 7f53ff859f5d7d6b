"""Paths on the ground, and what lies beside them."""

import math

import numpy as np
import shapely

from worlds.shapes.frames import GroundFrame
from worlds.shapes.polygons import Area


class Way:
    """A path on the ground; lengths and distances are those seen from above."""

    def __init__(self, points: np.ndarray):
        """Joins points (N, 2) or (N, 3), with N > 1, by straight lines [m]."""
        self._line = shapely.LineString(points)
        # Distance -> area up to this distance from the way.
        self._areas: dict[float, Area] = {}

    @property
    def length(self) -> float:
        """Length of the way [m]."""
        return float(self._line.length)

    def at(self, distance: float) -> np.ndarray:
        """Returns the point, (2,) or (3,), at a distance along the way [m]."""
        point = self._line.interpolate(distance)
        return shapely.get_coordinates(point, include_z=point.has_z)[0]

    def area(self, beside: float) -> Area:
        """Returns the area up to a distance from the way [m]."""
        if beside not in self._areas:
            area = self._areas[beside] = self._line.buffer(beside)
            shapely.prepare(area)
        return self._areas[beside]

    def covers(self, xy: np.ndarray, beside: float) -> np.ndarray:
        """Returns (N,) bool: whether places (N, 2) lie in `area(beside)`."""
        return np.asarray(shapely.contains_xy(self.area(beside), xy))

    def distance(self, area: Area) -> float:
        """Returns the distance of an area from the way [m]."""
        return float(area.distance(self._line))

    def distances(self, xy: np.ndarray) -> np.ndarray:
        """Returns the distances (N,) of places (N, 2) from the way [m]."""
        return np.asarray(shapely.distance(shapely.points(xy), self._line))

    def is_near(self, boxes: np.ndarray, distance: float) -> np.ndarray:
        """Returns (N,) bool: which boxes are within a distance of the way.

        Args:
            boxes: (N, 2, 2) or (N, 2, 3) least and greatest coordinates [m].
            distance: the distance [m].
        """
        flat = shapely.box(*boxes[:, 0, :2].T, *boxes[:, 1, :2].T)
        return np.asarray(shapely.dwithin(flat, self._line, distance))


def facing_side(area: Area, way: Way) -> tuple[GroundFrame, float]:
    """Returns the side of an area that faces a way, and its length [m].

    The area is taken as the least rectangle around it. The frame has its origin
    in the middle of the side, x along the side and y away from the area.
    """
    rectangle = shapely.MultiPoint(
        shapely.get_coordinates(area)
    ).minimum_rotated_rectangle
    corners = shapely.get_coordinates(rectangle)
    middles = (corners[:-1] + corners[1:]) / 2
    k = int(np.argmin(way.distances(middles)))
    length = math.hypot(*(corners[k + 1] - corners[k]))
    away = middles[k] - corners[:-1].mean(axis=0)
    yaw = math.atan2(away[1], away[0]) - np.pi / 2
    return GroundFrame(middles[k], yaw), length
