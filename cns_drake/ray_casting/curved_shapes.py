"""Polyhedra around curved shapes, and capsules in closed form.

A ray that misses the polyhedron around a shape also misses the shape, unless
the ray starts between polyhedron and shape. Rays are therefore cast on the
polyhedra first, and only the few rays that hit a polyhedron are cast on the
shapes themselves.

Rays that run along the axis of a capsule are cast in closed form, because
Embree's rounded segments lose most rays within 1e-3 rad of their axis. Only
rays that start in line with a capsule can run along its axis.
"""

from collections.abc import Sequence
from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.base.elementary import product, rotated
from cns_drake.ray_casting.ray_groups import Motion, RayGroup
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
# Least distance between shape and polyhedron, as a fraction of the radius.
_MARGIN = 0.005
# Least distance in addition [m]. It exceeds the errors of single precision.
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
        """Collects the capsules C of groups.

        Args:
            groups: the groups, already placed (see `RayGroup.place`). Each cast
                takes their current poses and motions.
        """
        self._found = [
            (row, group, index, X_LC.GetAsMatrix4(), (c.length / 2, c.radius))
            for row, group in enumerate(groups)
            for index, X_LC, c in group.members
            if isinstance(c, CapsuleSurface)
        ]

    def cast(self, rays: Rays, hits: Hits) -> None:
        """Corrects the hits of rays that run along the axis of a capsule.

        Args:
            rays: N rays.
            hits: hits of the N rays as Embree found them, changed in place.
        """
        seen = [one for one in self._found if one[1].in_sight]
        if not (seen and len(rays.d_Sset)):
            return
        _, groups, _, matrices, sizes = zip(*seen, strict=True)
        X_LCs = np.array(matrices)
        half, radius = np.transpose(sizes)
        X_OCs = product(np.array([group.X_OL for group in groups]), X_LCs)
        angle, way = np.transpose([_bound(group.motion) for group in groups])
        # Rays along an axis start in a cone about it, which is wider if the
        # capsule moves.
        columns = np.ascontiguousarray(rays.p_OSset.T)
        low, high = columns.min(axis=1), columns.max(axis=1)
        way += np.linalg.norm((high - low) / 2.0)
        way += angle * np.linalg.norm(X_LCs[:, :3, 3], axis=1)
        away = (low + high) / 2.0 - X_OCs[:, :, 3]
        distance = np.linalg.norm(away, axis=1)
        along = (away * X_OCs[:, :, 2]).sum(axis=1)
        reach = (2.0 * _ALONG + angle) * (distance + way + half)
        reach += radius + way
        R_SOset = rays.R_OSset.swapaxes(1, 2)
        for k in np.flatnonzero(distance**2 - along**2 <= reach**2):
            row, group, index, X_LC, size = seen[k]
            times = rays.times if group.motion else rays.times[:1]
            axes = product(group.X_OL_at(times), X_LC)[:, :, 2]
            turn = np.arange(np.lcm(len(axes), len(R_SOset)))
            axes_S = rotated(
                R_SOset[turn % len(R_SOset)], axes[turn % len(axes)]
            )
            d_Sset = rays.d_Sset.reshape(-1, len(turn), 3)
            # A sum over the last axis takes twenty times as long.
            d_along = sum(d_Sset[:, :, n] * axes_S[:, n] for n in range(3))
            ray = np.flatnonzero(d_along**2 >= 1.0 - _ALONG**2)
            some = rays.select(ray, rays.max_ranges_of(ray))
            X_OC = product(group.X_OL_at(some.times), X_LC)
            R_CO = X_OC[:, :, :3].swapaxes(1, 2)
            ranges, normals_C = _meet_capsule(
                rotated(R_CO, some.p_OSset - X_OC[:, :, 3]),
                rotated(R_CO, some.d_Oset()),
                *size,
            )
            is_nearer = ranges <= some.max_ranges
            is_nearer &= ranges < hits.ranges[ray] - _SAME
            ray = ray[is_nearer]
            hits.ranges[ray] = ranges[is_nearer]
            hits.owner[ray], hits.group[ray] = index, row
            if hits.normals.shape[1]:
                normals_L = rotated(X_LC[:3, :3], normals_C[is_nearer])
                hits.normals[ray] = normals_L


def _bound(motion: Motion | None) -> tuple[float, float]:
    """Returns how far a frame turns [rad] and moves [m] at most."""
    if motion is None:
        return 0.0, 0.0
    time = motion.duration + abs(motion.start)
    return math.hypot(*motion.w) * time, math.hypot(*motion.v) * time


def _meet_capsule(
    p: np.ndarray, d: np.ndarray, half: float, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the hits of N rays on a capsule along z, in closed form.

    Args:
        p: (N, 3) origins, relative to its middle [m].
        d: (N, 3) unit directions.
        half: half the length of its straight part [m].
        radius: its radius [m].

    Returns:
        (N,) ranges, inf for a miss [m]; and (N, 3) normals of any length.
    """
    nearest = np.full(len(d), np.inf)
    # NaN, which stands for no root, fails every comparison.
    with np.errstate(invalid="ignore", divide="ignore"):
        # The straight part, where z counts for nothing, and the half spheres.
        for end in (0.0, -1.0, 1.0):
            shown = (1.0, 1.0, abs(end))
            q, e = (p - (0.0, 0.0, end * half)) * shown, d * shown
            a, b = (e * e).sum(axis=1), (q * e).sum(axis=1)
            root = np.sqrt(b * b - a * ((q * q).sum(axis=1) - radius**2))
            for distance in ((-b - root) / a, (-b + root) / a):
                z = p[:, 2] + distance * d[:, 2]
                fits = np.where(np.abs(z) < half, 0.0, np.sign(z)) == end
                fits &= (distance >= 0.0) & (distance < nearest)
                nearest[fits] = distance[fits]
        normals = p + nearest[:, None] * d
    normals[:, 2] -= np.clip(normals[:, 2], -half, half)
    return nearest, normals
