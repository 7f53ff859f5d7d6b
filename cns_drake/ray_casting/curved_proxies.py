"""Polyhedra around curved shapes, on which rays are cast first.

A ray that misses the polyhedron around a shape also misses the shape, unless
the ray starts between polyhedron and shape. Rays are therefore cast on the
polyhedra first, and only the few rays that hit a polyhedron are cast on the
shapes themselves.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.base import compiled
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
    tessellate,
)

CurvedSurface = EllipsoidSurface | CylinderSurface | CapsuleSurface

# Sides of a circle. Polyhedra of a world with more shapes have few sides: they
# take a quarter of the memory, and a few more rays are cast twice.
_SIDES = 16
_FEW_SIDES = 8
_MANY_SHAPES = 2000
# Least distance between shape and polyhedron, as a fraction of the radius.
_MARGIN = 0.005
# Least distance in addition [m]. It exceeds the errors of single precision.
_GAP = 1e-3
# No point of a polyhedron is farther than this from the axis or centre of its
# shape: a multiple of the shape's radius, by the number of sides, and a length
# in addition [m].
_BOUND_RATIOS = {_SIDES: 1.1, _FEW_SIDES: 1.2}
_BOUND_GAP = 2.0 * _GAP


def num_sides(num_shapes: int) -> int:
    """Returns the number of sides of the polyhedra of a group of shapes."""
    return _SIDES if num_shapes <= _MANY_SHAPES else _FEW_SIDES


@lru_cache(maxsize=1000)
def circumscribe(
    surface: CurvedSurface, sides: int = _SIDES
) -> TriangleSurface:
    """Returns a polyhedron that contains a curved shape.

    No point of the polyhedron is farther from the shape's axis or centre than
    `_BOUND_RATIOS[sides]` radii + `_BOUND_GAP`.
    """
    # The faces of an inscribed ball are nearest to its centre at the equator.
    side = np.cos(np.pi / sides)
    scale = (1.0 + _MARGIN) / side**2
    if isinstance(surface, EllipsoidSurface):
        wide = tuple(scale * a + _GAP for a in surface.semi_axes)
        return tessellate(EllipsoidSurface(wide), sides)
    radius = scale * surface.radius + _GAP
    if isinstance(surface, CapsuleSurface):
        return tessellate(CapsuleSurface(radius, surface.length), sides)
    length = surface.length + 2.0 * _GAP
    return tessellate(CylinderSurface(radius, length), sides)


def curved_members(
    group: RayGroup,
) -> list[tuple[RigidTransform, CurvedSurface]]:
    """Returns the poses X_LG and the surfaces of a group's curved shapes."""
    return [
        (X_LG, surface)
        for _, X_LG, surface in group.members
        if not isinstance(surface, TriangleSurface | HalfSpaceSurface)
    ]


class NearCurvedShapes:
    """Finds rays that start near curved shapes that never move."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Collects the curved shapes of groups.

        Args:
            groups: the groups, already placed (see `RayGroup.place`).
        """
        rows: list[int] = []
        X_LGs, sizes = [], []
        for row, group in enumerate(groups):
            curved = curved_members(group)
            ratio = _BOUND_RATIOS[num_sides(len(curved))]
            for X_LG, surface in curved:
                if isinstance(surface, EllipsoidSurface):
                    half, radius = 0.0, max(surface.semi_axes)
                else:
                    half, radius = surface.length / 2.0, surface.radius
                rows.append(row)
                X_LGs.append(X_LG.GetAsMatrix4())
                sizes.append((half, ratio * radius + _BOUND_GAP))
        X_LGset = np.reshape(X_LGs, (-1, 4, 4))
        halves, radii = np.reshape(sizes, (-1, 2)).T
        # Greatest stretch of a vector from G to O.
        stretches = np.array(
            [np.linalg.norm(group.X_FL[:3, :3], 2) for group in groups]
        )
        X_OLs = np.tile(np.eye(4), (len(groups), 1, 1))
        for row, group in enumerate(groups):
            X_OLs[row, :3] = group.X_OL
        places = (X_OLs[rows] @ X_LGset[:, :, 3:])[:, :3, 0]
        reaches = stretches[rows] * (halves + radii)
        X_GOs = np.linalg.inv(X_LGset) @ np.linalg.inv(X_OLs[rows])
        begins = places[:, 0] - reaches
        order = np.argsort(begins)
        self._near = _SortedBalls(
            places[order],
            reaches[order],
            X_GOs[order],
            halves[order],
            radii[order],
            begins[order],
            np.maximum.accumulate((begins + 2.0 * reaches)[order]),
        )

    def contain(self, p_OSset: np.ndarray) -> np.ndarray:
        """Returns which points lie in a polyhedron around one of the shapes.

        Args:
            p_OSset: (K, 3) points in the scene's frame O [m].

        Returns:
            (K,) bool.
        """
        result = np.zeros(len(p_OSset), bool)
        _mark_near(self._near, p_OSset, result)
        return result


class _SortedBalls(NamedTuple):
    """Balls around M shapes, sorted by the least x of the balls.

    Attributes:
        places: (M, 3) centres in O [m].
        reaches: (M,) radii of the balls [m].
        X_GOs: (M, 4, 4) maps from O to the shapes' own frames; not rigid for an
            ellipsoid, which is a ball in its own frame.
        halves: (M,) half the length of each shape along its own z axis.
        radii: (M,) greatest distance of a polyhedron from its shape's axis, or
            from the shape's centre, in the shape's own frame.
        begins: (M,) least x of each ball [m].
        ends: (M,) greatest x of this ball and all balls before it [m].
    """

    places: np.ndarray
    reaches: np.ndarray
    X_GOs: np.ndarray
    halves: np.ndarray
    radii: np.ndarray
    begins: np.ndarray
    ends: np.ndarray


@compiled
def _mark_near(
    near: _SortedBalls, p_OSset: np.ndarray, result: np.ndarray
) -> None:
    """Sets `result` to True for points near a shape; see `contain`."""
    p_GS = np.empty(3)
    for i in range(len(p_OSset)):
        p = p_OSset[i]
        k = np.searchsorted(near.begins, p[0], side="right")
        while k > 0 and not result[i]:
            k -= 1
            if near.ends[k] < p[0]:
                break
            square = 0.0
            for axis in range(3):
                square += (p[axis] - near.places[k, axis]) ** 2
            if square > near.reaches[k] ** 2:
                continue
            for axis in range(3):
                p_GS[axis] = near.X_GOs[k, axis, 3]
                for column in range(3):
                    p_GS[axis] += near.X_GOs[k, axis, column] * p[column]
            # Distance to the nearest place on the line.
            p_GS[2] -= min(max(p_GS[2], -near.halves[k]), near.halves[k])
            square = p_GS[0] ** 2 + p_GS[1] ** 2 + p_GS[2] ** 2
            result[i] = square <= near.radii[k] ** 2
