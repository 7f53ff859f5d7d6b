"""Polyhedra about curved shapes.

A ray that misses the polyhedron misses the shape, unless it starts between
the two: few rays then have to be cast on the shapes themselves.
"""

from __future__ import annotations

from functools import lru_cache

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


def ball_about(p_OSset: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Returns centre and radius of a ball about (K, 3) places, if any."""
    if len(p_OSset) == 0:
        return None
    center = (p_OSset.min(axis=0) + p_OSset.max(axis=0)) / 2.0
    return center, float(np.linalg.norm(p_OSset - center, axis=1).max())


class NearCurvedShapes:
    """Tells whether rays start near the curved shapes of a group."""

    def __init__(self, group: RayGroup):
        """Takes the shapes of a group."""
        rows = []
        for _, X_LG, surface in group.members:
            if isinstance(surface, TriangleSurface | HalfSpaceSurface):
                continue
            if isinstance(surface, EllipsoidSurface):
                half, radius = 0.0, max(surface.semi_axes)
            else:
                half, radius = surface.length / 2.0, surface.radius
            axis = X_LG.rotation().matrix()[:, 2]
            reach = 1.1 * radius + 2.0 * _GAP
            rows.append([*X_LG.translation(), *axis, half, reach])
        self._group = group
        self._shapes = np.array(rows).reshape(-1, 8)
        self._is_rigid = np.array_equal(group.X_FL[:3, :3], np.eye(3))
        # A ball about L's origin with all of them.
        shapes = self._shapes
        self._radius = float(
            np.max(
                np.linalg.norm(shapes[:, :3], axis=1)
                + shapes[:, 6]
                + shapes[:, 7],
                initial=0.0,
            )
        )

    def contain(self, center: np.ndarray, spread: float) -> bool:
        """Tells whether a ball meets a shape's polyhedron.

        Args:
            center: (3,) of a ball about all origins of rays, in O.
            spread: its radius.
        """
        X_OL = self._group.X_OL
        if self._group.motion is None and self._is_rigid:
            dx, dy, dz = (center - X_OL[:, 3]).tolist()
            far = self._radius + spread
            if dx * dx + dy * dy + dz * dz > far * far:
                return False
        spread += self._travel()
        R_LO = np.linalg.inv(X_OL[:, :3])
        p_LS = R_LO @ (center - X_OL[:, 3])
        return _is_near(
            self._shapes, p_LS, spread * float(np.linalg.norm(R_LO))
        )

    def _travel(self) -> float:
        """Returns how far a shape goes at most during a turn."""
        motion = self._group.motion
        if motion is None or len(self._shapes) == 0:
            return 0.0
        stretch = np.linalg.norm(self._group.X_OL[:, :3], 2)
        p_FG = np.linalg.norm(self._shapes[:, :3], axis=1) + self._shapes[:, 7]
        arm = np.linalg.norm(self._group.X_FL[:3, 3]) + stretch * p_FG.max()
        angle = np.linalg.norm(motion.w) * motion.duration
        way = np.linalg.norm(motion.v) * motion.duration
        return float(way + min(angle, 2.0) * arm)


@compiled
def _is_near(shapes: np.ndarray, p_LS: np.ndarray, spread: float) -> bool:
    """Tells whether a ball meets a segment that is widened by its reach.

    Args:
        shapes: (M, 8) middle of a segment, its unit direction, half its
            length, and its reach.
        p_LS: (3,) centre of the ball.
        spread: its radius.
    """
    for k in range(len(shapes)):
        along = 0.0
        for axis in range(3):
            along += (p_LS[axis] - shapes[k, axis]) * shapes[k, 3 + axis]
        along = min(max(along, -shapes[k, 6]), shapes[k, 6])
        square = 0.0
        for axis in range(3):
            nearest = shapes[k, axis] + along * shapes[k, 3 + axis]
            square += (p_LS[axis] - nearest) ** 2
        if square <= (shapes[k, 7] + spread) ** 2:
            return True
    return False
