"""Which rays start near curved shapes, where they may leave a polyhedron."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base import compiled, product
from cns_drake.ray_casting.rays import Rays


class CurvedShapes(NamedTuple):
    """M curved shapes of groups, and balls around their polyhedra.

    Attributes:
        numbers: (M, SHAPE_NUMBERS) float64, see `proxies`.
        rows: (M,) row of the group of each shape.
        p_LGs: (M, 3) centres of the balls in the group's frame L [m].
        reaches: (M,) radii of the balls [m].
    """

    numbers: np.ndarray
    rows: np.ndarray
    p_LGs: np.ndarray
    reaches: np.ndarray

    @classmethod
    def of(cls, numbers: np.ndarray, rows: np.ndarray) -> CurvedShapes:
        """Takes the numbers and the row of each shape."""
        X_GL = numbers[:, :12].reshape(-1, 3, 4)
        axes = np.linalg.inv(X_GL[:, :, :3])
        stretch = np.sqrt((axes**2).sum(axis=1).max(axis=1, initial=0.0))
        reaches = stretch * (numbers[:, 12] + numbers[:, 15])
        return cls(
            numbers, rows, -product(axes, X_GL[:, :, 3:])[:, :, 0], reaches
        )

    def select(self, order: np.ndarray) -> CurvedShapes:
        """Returns the shapes with certain indices."""
        return CurvedShapes(*(column[order] for column in self))


class NearShapes:
    """Finds rays that may start between a curved shape and its polyhedron.

    The group of row 0 never moves, and its frame L is the scene's frame O.
    """

    def __init__(self, shapes: CurvedShapes):
        """Takes the shapes of all groups."""
        still = shapes.select(shapes.rows == 0)
        begins = still.p_LGs[:, 0] - still.reaches
        order = np.argsort(begins)
        self._still = still.select(order)
        self._begins = begins[order]
        # The greatest x of each ball and of all balls before it.
        self._ends = np.maximum.accumulate(
            (begins + 2.0 * still.reaches)[order]
        )
        self._moving = shapes.select(shapes.rows > 0)

    def contain(self, rays: Rays, places: np.ndarray) -> np.ndarray:
        """Returns which origins of rays, (K,) bool, lie near a shape.

        Args:
            rays: the rays.
            places: (R, PLACE_NUMBERS) where each group is, see `packets`.
        """
        p_OSset = rays.p_OSset
        result = np.zeros(len(p_OSset), bool)
        if len(self._begins):
            _mark_near(self._still, self._begins, self._ends, p_OSset, result)
        if len(self._moving.rows) and len(p_OSset):
            self._mark_moving(p_OSset, places, result)
        return result

    def _mark_moving(
        self, p_OSset: np.ndarray, places: np.ndarray, result: np.ndarray
    ) -> None:
        """Marks the origins in the balls around shapes that can move."""
        shapes = self._moving
        place = places[shapes.rows]
        X_OL = place[:, :12].reshape(-1, 3, 4)
        p_LGs = shapes.p_LGs
        centres = (
            X_OL[:, :, 3] + product(X_OL[:, :, :3], p_LGs[:, :, None])[:, :, 0]
        )
        # What the motion of F adds to the balls.
        turns, ways, arms = (
            np.abs(place[:, columns]).sum(axis=1)
            for columns in (slice(15, 21), slice(21, 27), slice(12, 15))
        )
        arms += np.abs(p_LGs).sum(axis=1)
        reaches = shapes.reaches + place[:, -1] * (ways + turns * arms)
        low, high = p_OSset.min(axis=0), p_OSset.max(axis=0)
        away = np.abs(centres - (low + high) / 2.0) - (high - low) / 2.0
        for k in np.flatnonzero((away <= reaches[:, None]).all(axis=1)):
            x, y, z = (p_OSset - centres[k]).T
            result |= x * x + y * y + z * z <= reaches[k] ** 2


@compiled
def _mark_near(
    shapes: CurvedShapes,
    begins: np.ndarray,
    ends: np.ndarray,
    p_OSset: np.ndarray,
    result: np.ndarray,
) -> None:
    """Sets `result` to True for points in the polyhedra of shapes at rest.

    Args:
        shapes: M shapes, sorted by the least x of their balls.
        begins: (M,) least x of each ball [m].
        ends: (M,) greatest x of this ball and all balls before it [m].
        p_OSset: (K, 3) points [m].
        result: (K,) bool.
    """
    for i in range(len(p_OSset)):
        p_x, p_y, p_z = p_OSset[i, 0], p_OSset[i, 1], p_OSset[i, 2]
        low, k = 0, len(begins)
        while low < k:
            middle = (low + k) // 2
            if begins[middle] <= p_x:
                low = middle + 1
            else:
                k = middle
        while k > 0 and not result[i]:
            k -= 1
            if ends[k] < p_x:
                break
            x = p_x - shapes.p_LGs[k, 0]
            y = p_y - shapes.p_LGs[k, 1]
            z = p_z - shapes.p_LGs[k, 2]
            if x * x + y * y + z * z > shapes.reaches[k] ** 2:
                continue
            x = _coordinate(shapes.numbers, k, 0, p_x, p_y, p_z)
            y = _coordinate(shapes.numbers, k, 4, p_x, p_y, p_z)
            z = abs(_coordinate(shapes.numbers, k, 8, p_x, p_y, p_z))
            # Distance to the nearest place on the axis.
            z = max(z - shapes.numbers[k, 12], 0.0)
            result[i] = x * x + y * y + z * z <= shapes.numbers[k, 15] ** 2


@compiled
def _coordinate(
    numbers: np.ndarray, k: int, row: int, x: float, y: float, z: float
) -> float:
    """Returns a coordinate of a point in the frame G of shape k."""
    return (
        numbers[k, row] * x
        + numbers[k, row + 1] * y
        + numbers[k, row + 2] * z
        + numbers[k, row + 3]
    )
