"""Polyhedra about curved shapes.

A ray that misses the polyhedron misses the shape, unless it starts between
the two: few rays then have to be cast on the shapes themselves.
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
# What lies between shape and polyhedron at least, beyond what single
# precision confuses: a part of the radius, and [m].
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
    """Tells which rays start near curved shapes of groups."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Takes the curved shapes of groups."""
        self._groups = groups
        rows, X_LGs, sizes = [], [], []
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
        self._rows = np.array(rows, int)
        X_LGset = np.reshape(X_LGs, (-1, 4, 4))
        self._p_LGs, self._X_GLs = X_LGset[:, :, 3:], np.linalg.inv(X_LGset)
        self._sizes = np.reshape(sizes, (-1, 2))
        # How much longer an arrow of G can be in O.
        self._stretches = np.array(
            [np.linalg.norm(group.X_FL[:3, :3], 2) for group in groups]
        )
        self._near: _Sorted | None = None

    def forget_places(self) -> None:
        """Has the shapes placed anew where their groups are now."""
        self._near = None

    def contain(self, p_OSset: np.ndarray) -> np.ndarray:
        """Tells which of (K, 3) places lie near a shape, (K,) bool.

        That is, within what a shape's polyhedron sweeps during the turn.
        """
        result = np.zeros(len(p_OSset), bool)
        if len(self._rows):
            if self._near is None:
                self._near = self._place()
            _find_near(self._near, p_OSset, result)
        return result

    def _place(self) -> _Sorted:
        X_OLs = np.tile(np.eye(4), (len(self._groups), 1, 1))
        X_OLs[:, :3] = [group.X_OL for group in self._groups]
        X_GOs = self._X_GLs @ np.linalg.inv(X_OLs)[self._rows]
        places = (X_OLs[self._rows] @ self._p_LGs)[:, :3, 0]
        stretches = self._stretches[self._rows]
        reaches = stretches * self._sizes.sum(axis=1)
        travels = self._travels(places, reaches)
        # Bounds the largest of its singular values.
        shrink = np.linalg.norm(X_GOs[:, :3, :3], axis=(1, 2))
        reaches += travels
        order = np.argsort(places[:, 0] - reaches)
        return _Sorted(
            places[order],
            reaches[order],
            X_GOs[order],
            self._sizes[order, 0],
            (self._sizes[:, 1] + shrink * travels)[order],
            (places[:, 0] - reaches)[order],
            2.0 * reaches.max(),
        )

    def _travels(self, places: np.ndarray, reaches: np.ndarray) -> np.ndarray:
        """Returns how far each shape goes at most during a turn."""
        ways, angles = np.zeros((2, len(self._groups)))
        p_OFs = np.zeros((len(self._groups), 3))
        for row, group in enumerate(self._groups):
            if group.motion is None:
                continue
            angle = np.linalg.norm(group.motion.w) * group.motion.duration
            angles[row] = min(float(angle), 2.0)
            ways[row] = np.linalg.norm(group.motion.v) * group.motion.duration
            p_OFs[row] = group.X_OL @ np.linalg.inv(group.X_FL)[:, 3]
        arms = np.linalg.norm(places - p_OFs[self._rows], axis=1) + reaches
        return ways[self._rows] + angles[self._rows] * arms


class _Sorted(NamedTuple):
    """M shapes where they are, by where their balls begin along x.

    Attributes:
        places: (M, 3) middles in O.
        reaches: (M,) radii of balls about them [m].
        X_GOs: (M, 4, 4) from O to their own frames; not rigid for an
            ellipsoid, which is there a ball.
        halves: (M,) half of the length along z.
        radii: (M,) of what is about that line.
        begins: (M,) where their balls begin along x [m].
        width: of the widest ball [m].
    """

    places: np.ndarray
    reaches: np.ndarray
    X_GOs: np.ndarray
    halves: np.ndarray
    radii: np.ndarray
    begins: np.ndarray
    width: float


@compiled
def _find_near(near: _Sorted, p_OSset: np.ndarray, result: np.ndarray) -> None:
    """Fills in which places lie near a shape; see `contain`."""
    p_GS = np.empty(3)
    for i in range(len(p_OSset)):
        p = p_OSset[i]
        k = np.searchsorted(near.begins, p[0], side="right")
        while k > 0 and not result[i]:
            k -= 1
            if near.begins[k] + near.width < p[0]:
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
            # To the nearest place on the line.
            p_GS[2] -= min(max(p_GS[2], -near.halves[k]), near.halves[k])
            square = p_GS[0] ** 2 + p_GS[1] ** 2 + p_GS[2] ** 2
            result[i] = square <= near.radii[k] ** 2
