"""Keeps the things of a city from standing in each other."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry


class Occupancy:
    """The ground that is taken, as a growing set of polygons in W.

    A few thousand polygons are expected; candidates are found by bounds in
    one vectorised comparison, and only those are checked exactly.
    """

    def __init__(self) -> None:
        self._geometries: list[BaseGeometry] = []
        self._bounds: np.ndarray = np.zeros((64, 4))

    def add(self, geometry: BaseGeometry) -> None:
        """Takes the ground of a polygon."""
        count = len(self._geometries)
        if count == len(self._bounds):
            self._bounds = np.concatenate(
                [self._bounds, np.zeros_like(self._bounds)]
            )
        shapely.prepare(geometry)
        self._bounds[count] = geometry.bounds
        self._geometries.append(geometry)

    def is_free(
        self,
        geometry: BaseGeometry,
        clearance: float = 0.0,
        ignore: BaseGeometry | None = None,
    ) -> bool:
        """Returns whether a polygon keeps its distance from all taken ones.

        Args:
            geometry: the polygon in W [m].
            clearance: least distance [m]; with 0 polygons may touch.
            ignore: a taken polygon that may be closer, but not overlapped.
        """
        x0, y0, x1, y1 = geometry.bounds
        taken = self._bounds[: len(self._geometries)]
        near = np.flatnonzero(
            (taken[:, 0] < x1 + clearance)
            & (taken[:, 1] < y1 + clearance)
            & (taken[:, 2] > x0 - clearance)
            & (taken[:, 3] > y0 - clearance)
        )
        for index in near:
            other = self._geometries[index]
            if clearance > 0 and other is not ignore:
                if other.distance(geometry) < clearance:
                    return False
            elif other.intersects(geometry) and not other.touches(geometry):
                return False
        return True
