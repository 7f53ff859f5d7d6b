"""Polyhedra around curved shapes, and capsules in closed form.

A ray that misses the polyhedron around a shape also misses the shape, unless
the ray starts between polyhedron and shape. Rays are therefore cast on the
polyhedra first, and only the few that hit are cast on the shapes themselves.

Rays that run along the axis of a capsule are cast in closed form, because
Embree's rounded segments lose most rays within 1e-3 rad of their axis. Only
rays that start in line with a capsule can run along its axis.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits, Rays
from cns_drake.scene.surfaces import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
    tessellate,
)

CurvedSurface = EllipsoidSurface | CylinderSurface | CapsuleSurface

# Sides of a circle.
_SIDES = 16
# Least distance between shape and polyhedron: a fraction of the radius, and
# [m]. It exceeds the errors of single precision.
_MARGIN = 0.005
_GAP = 1e-3
# Rays are cast in closed form up to this angle to a capsule's axis (sine).
_ALONG = 5e-3
# Hits whose ranges differ by less than this are the same [m].
_SAME = 1e-4


@lru_cache(maxsize=1000)
def circumscribe(surface: CurvedSurface) -> TriangleSurface:
    """Returns a polyhedron that contains a curved shape.

    No point of the polyhedron is farther than 1.1 radii + 2 mm from the shape's
    axis or centre.
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
    """Finds rays that start near curved shapes that never move."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Collects the curved shapes of groups.

        Args:
            groups: the groups, already placed (see `RayGroup.place`).
        """
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
        """Returns which points lie in a polyhedron around one of the shapes.

        Args:
            p_OSset: (K, 3) points in the scene's frame O [m].

        Returns:
            (K,) bool.
        """
        result = np.zeros(len(p_OSset), bool)
        _find_near(self._near, p_OSset, result)
        return result


class _Sorted(NamedTuple):
    """M shapes with bounding balls, sorted by the least x of the balls.

    Attributes:
        places: (M, 3) centres in O [m].
        reaches: (M,) radii of the balls [m].
        X_GOs: (M, 4, 4) maps from O to the shapes' own frames; not rigid for an
            ellipsoid, which is a ball in its own frame.
        halves, radii: (M,) half the length along z, and the radius around it.
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
def _find_near(near: _Sorted, p_OSset: np.ndarray, result: np.ndarray) -> None:
    """Sets `result` for places near a shape; see `contain`."""
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


class CapsuleAxes:
    """Casts rays along the axes of capsules, where Embree is not exact."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Collects the capsules of groups.

        Args:
            groups: the groups, already placed (see `RayGroup.place`).
        """
        found = [
            (row, index, X_LG, surface)
            for row, group in enumerate(groups)
            for index, X_LG, surface in group.members
            if isinstance(surface, CapsuleSurface)
        ]
        self._groups = np.array([row for row, *_ in found], np.int32)
        self._owners = np.array([index for _, index, *_ in found], np.int32)
        self._p_LCs = np.reshape(
            [X.translation() for *_, X, _ in found], (-1, 3)
        )
        self._axes = np.reshape(
            [X.rotation().matrix()[:, 2] for *_, X, _ in found], (-1, 3)
        )
        self._halves = np.array([one.length / 2.0 for *_, one in found])
        self._radii = np.array([one.radius for *_, one in found])
        self._X_OLs = np.reshape([group.X_OL for group in groups], (-1, 3, 4))
        self._is_still = np.array(
            [group.in_sight and group.motion is None for group in groups], bool
        )

    def place(self, placed: Placed) -> None:
        """Moves the capsules with their groups to the current poses."""
        self._X_OLs[placed.rows] = placed.X_OLs
        self._is_still[placed.rows] = placed.in_sight & ~placed.moves

    def cast(self, rays: Rays, hits: Hits) -> None:
        """Corrects the hits of rays that run along the axis of a capsule.

        Capsules that move during the turn are left out.

        Args:
            rays: N rays.
            hits: their hits as Embree found them, changed in place.
        """
        capsules = np.flatnonzero(self._is_still[self._groups])
        if not (len(capsules) and len(rays.d_Sset)):
            return
        X_OLs = self._X_OLs[self._groups[capsules]]
        p_OCs = _map(X_OLs[:, :, :3], self._p_LCs[capsules]) + X_OLs[:, :, 3]
        axes = _map(X_OLs[:, :, :3], self._axes[capsules])
        # Rays along an axis start in a cone about it.
        columns = np.ascontiguousarray(rays.p_OSset.T)
        low, high = columns.min(axis=1), columns.max(axis=1)
        spread = np.linalg.norm((high - low) / 2.0)
        away = (low + high) / 2.0 - p_OCs
        distance = np.linalg.norm(away, axis=1)
        along = (away * axes).sum(axis=1)
        reach = distance + spread + self._halves[capsules]
        reach = self._radii[capsules] + spread + 2.0 * _ALONG * reach
        near = np.flatnonzero(distance**2 - along**2 <= reach**2)
        if not len(near):
            return
        p_Oset, d_Oset = rays.p_Oset(), rays.d_Oset()
        x, y, z = np.ascontiguousarray(d_Oset.T)
        for k in near:
            # A sum over the last axis takes eight times as long.
            d_along = x * axes[k, 0] + y * axes[k, 1] + z * axes[k, 2]
            ray = np.flatnonzero(1.0 - d_along**2 <= _ALONG**2)
            if not len(ray):
                continue
            capsule = capsules[k]
            ranges, normals = _meet_capsule(
                p_Oset[ray] - p_OCs[k],
                d_Oset[ray],
                axes[k],
                self._halves[capsule],
                self._radii[capsule],
            )
            is_nearer = ranges <= rays.max_ranges_of(ray)
            is_nearer &= ranges < hits.ranges[ray] - _SAME
            ray = ray[is_nearer]
            hits.ranges[ray] = ranges[is_nearer]
            hits.owner[ray] = self._owners[capsule]
            hits.group[ray] = self._groups[capsule]
            if hits.normals.shape[1]:
                R_LO = X_OLs[k, :, :3].T
                hits.normals[ray] = _map(R_LO, normals[is_nearer])


def _map(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Returns products of (N, 3, 3) or (3, 3) matrices and (N, 3) vectors.

    Terms are added in a fixed order: the result of a matrix library depends on
    the processor.
    """
    return (matrices * vectors[:, None, :]).sum(axis=2)


def _meet_capsule(
    away: np.ndarray,
    d: np.ndarray,
    axis: np.ndarray,
    half: float,
    radius: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the hits of N rays on a capsule, in closed form.

    Origins are relative to its middle [m]. `half` is half the length of its
    straight part [m].

    Returns:
        (N,) ranges, inf for a miss [m]; and (N, 3) normals of any length.
    """
    along, d_along = (away * axis).sum(axis=1), (d * axis).sum(axis=1)
    square, toward = (away**2).sum(axis=1), (away * d).sum(axis=1)
    nearest = np.full(len(d), np.inf)

    def take(distance: np.ndarray, end: float) -> None:
        """Updates the ranges `nearest` with hits on one part of the capsule.

        Args:
            distance: (N,) ranges to the sphere or cylinder of this part [m].
            end: -1 or 1 for the hemisphere at that end of the axis, 0 for the
                straight part.
        """
        place = along + distance * d_along
        fits = np.abs(place) <= half
        if end:
            fits = (np.abs(place) >= half) & (place * end >= 0.0)
        fits &= (distance >= 0.0) & (distance < nearest)
        nearest[fits] = distance[fits]

    # NaN, which stands for no root, fails every comparison.
    with np.errstate(invalid="ignore", divide="ignore"):
        for end in (-1.0, 1.0):
            b = toward - end * half * d_along
            c = square - 2.0 * along * end * half + half**2 - radius**2
            root = np.sqrt(b * b - c)
            take(-b - root, end)
            take(-b + root, end)
        side, turn = (
            v - np.outer(v_along, axis)
            for v, v_along in ((away, along), (d, d_along))
        )
        across, slant = (side * turn).sum(axis=1), (turn**2).sum(axis=1)
        root = np.sqrt(across**2 - slant * (square - along**2 - radius**2))
        take((-across - root) / slant, 0.0)
        take((-across + root) / slant, 0.0)
        reached = away + nearest[:, None] * d
        place = np.clip(along + nearest * d_along, -half, half)
        return nearest, reached - np.outer(place, axis)
