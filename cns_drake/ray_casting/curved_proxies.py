"""Polyhedra about curved shapes.

A ray that misses the polyhedron misses the shape, unless it starts between the
two. Few rays then have to be cast on the shapes themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.scene.surface_merging import tessellate
from cns_drake.scene.surfaces import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
)

CurvedSurface = EllipsoidSurface | CylinderSurface | CapsuleSurface

# Sides of a circle.
_SIDES = 16
# Least distance between shape and polyhedron, above errors of single precision:
# a part of the radius, and [m].
_MARGIN = 0.005
_GAP = 1e-3


@lru_cache(maxsize=1000)
def circumscribe(surface: CurvedSurface) -> TriangleSurface:
    """Returns a polyhedron that contains a curved shape.

    It lies within 1.1 radii + 2 mm of the shape's axis, or centre.
    """
    # The faces of an inscribed ball are nearest to its centre at the equator.
    side = np.cos(np.pi / _SIDES)
    scale = (1.0 + _MARGIN) / side**2
    if isinstance(surface, EllipsoidSurface):
        wide = tuple(scale * a + _GAP for a in surface.semi_axes)
        return tessellate(EllipsoidSurface(wide), _SIDES)
    radius = scale * surface.radius + _GAP
    if isinstance(surface, CapsuleSurface):
        return tessellate(CapsuleSurface(radius, surface.length), _SIDES)
    length = surface.length + 2.0 * _GAP
    return tessellate(CylinderSurface(radius, length), _SIDES)


class NearCurvedShapes:
    """Finds the rays that start near curved shapes of groups that stay."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Takes the curved shapes of groups, which are placed."""
        rows: list[int] = []
        X_LGs, sizes = [], []
        for row, group in enumerate(groups):
            for _, X_LG, surface in group.members:
                if isinstance(surface, TriangleSurface | HalfSpaceSurface):
                    continue
                if isinstance(surface, EllipsoidSurface):
                    half, radius = 0.0, max(surface.semi_axes)
                else:
                    half, radius = surface.length / 2.0, surface.radius
                rows.append(row)
                X_LGs.append(X_LG.GetAsMatrix4())
                sizes.append((half, 1.1 * radius + 2.0 * _GAP))
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
        self._near = _Sorted(
            places[order],
            reaches[order],
            X_GOs[order],
            halves[order],
            radii[order],
            begins[order],
            np.maximum.accumulate((begins + 2.0 * reaches)[order]),
        )

    def contain(self, p_OSset: np.ndarray) -> np.ndarray:
        """Returns which of (K, 3) places are near a shape, (K,) bool.

        A place is near if it is in the shape's polyhedron.
        """
        result = np.zeros(len(p_OSset), bool)
        _find_near(self._near, p_OSset, result)
        return result


class _Sorted(NamedTuple):
    """M placed shapes, sorted by the start of their balls along x.

    Attributes:
        places: (M, 3) middles in O.
        reaches: (M,) radii of balls about them [m].
        X_GOs: (M, 4, 4) from O to their own frames; not rigid for an ellipsoid,
            which is a ball there.
        halves: (M,) half of the length along z.
        radii: (M,) around that line.
        begins: (M,) starts of their balls along x [m].
        ends: (M,) the farthest end along x of this ball and those before [m].
    """

    places: np.ndarray
    reaches: np.ndarray
    X_GOs: np.ndarray
    halves: np.ndarray
    radii: np.ndarray
    begins: np.ndarray
    ends: np.ndarray


@compiled
def _find_near(near: _Sorted, p_OSset: np.ndarray, result: np.ndarray) -> None:
    """Fills in the places near a shape; see `contain`."""
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
