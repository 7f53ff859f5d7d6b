"""Occupied ground: whether an area keeps clear of what stands there."""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry


class Occupancy:
    """The occupied ground: a growing set of polygons in W."""

    def __init__(self) -> None:
        self._geometries: list[BaseGeometry] = []
        self._bounds: np.ndarray = np.zeros((64, 4))

    def add(self, geometry: BaseGeometry) -> None:
        """Marks the area of a polygon in W as occupied."""
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
        """Returns whether an area in W is clear of all occupied ground.

        Args:
            geometry: the area.
            clearance: least distance from occupied ground [m]; with 0, areas
                may touch.
            ignore: an occupied polygon that may be closer than `clearance`, but
                must not be overlapped.
        """
        # One comparison of all bounding boxes finds the few candidates.
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
