"""Groups of geometry as two Embree hierarchies.

Curved shapes are not tessellated: Embree intersects spheres, cones, discs and
rounded segments exactly (in float32), and an ellipsoid is an instance of the
unit sphere. A curved shape in a scene slows down all rays of the scene by a
third (measured), even rays that hit only triangles. Curved shapes that never
move are therefore in a second hierarchy. The first hierarchy contains polyhedra
around these shapes; only the few rays that hit a polyhedron are cast on the
second hierarchy. Curved shapes that move are in the first hierarchy themselves,
as instances, which few rays enter. Embree loses rays along the axis of a
rounded segment; such rays are therefore cast in closed form (`_CapsuleAxes`).
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from cns_drake.base import product, rotated
from cns_drake.ray_casting.curved_proxies import NearCurvedShapes
from cns_drake.ray_casting.embree_hierarchy import EmbreeHierarchy
from cns_drake.ray_casting.embree_primitives import (
    PROXY_OWNER,
    SOLID,
    merge_first,
    merge_second,
)
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import Motion, RayGroup
from cns_drake.ray_casting.rays import Hits, Rays
from cns_drake.scene import CapsuleSurface

# Rays are cast in closed form if the sine of their angle to a capsule's axis is
# below this.
_LARGEST_SINE = 5e-3
# Hits whose ranges differ by less than this are the same [m].
_RANGE_TOLERANCE = 1e-4


class EmbreeScene:
    """Casts rays on groups of geometry with Embree.

    It is a part of `cns_drake.ray_casting.ray_casting_scene.RayCastingScene`.
    """

    def __init__(
        self,
        groups: Sequence[RayGroup],
        num_threads: int,
        previous: EmbreeScene | None = None,
    ):
        """Builds the scene.

        Args:
            groups: the groups, already placed (see `RayGroup.place`).
            num_threads: number of threads that share the rays of a cast.
            previous: scene from which unchanged groups are reused; None to
                build all anew.

        Raises:
            MemoryError: Embree has no memory for the scene.
            RuntimeError: Embree cannot build the scene for another reason.
        """
        first, second = None, None
        if previous is not None:
            first, second = previous._first, previous._second
        self._first: EmbreeHierarchy = EmbreeHierarchy(
            groups, merge_first, num_threads, first
        )
        self._second: EmbreeHierarchy = EmbreeHierarchy(
            groups, merge_second, 1, second
        )
        self._proxies = NearCurvedShapes(
            [groups[row] for row in self._second.rows]
        )
        self._axes = _CapsuleAxes(groups)

    def place(self, placed: Placed) -> None:
        """Moves all groups to their current poses."""
        self._first.place(placed)

    def cast_rays(
        self, rays: Rays, with_normals: bool, doubt_all: bool
    ) -> Hits:
        """Casts rays on the scene; returns the hits.

        Args:
            rays: the rays.
            with_normals: whether to find normals as well.
            doubt_all: whether to meet all triangles in double precision.
        """
        hits = self._first.cast(
            rays, with_normals=with_normals, doubt_all=doubt_all
        )
        if self._second.rows:
            self._cast_on_curved_shapes(rays, hits, with_normals, doubt_all)
        self._axes.cast(rays, hits)
        return hits

    def _cast_on_curved_shapes(
        self, rays: Rays, hits: Hits, with_normals: bool, doubt_all: bool
    ) -> None:
        """Updates hits of rays that may meet curved shapes that never move."""
        is_near = self._proxies.contain(rays.p_OSset)
        is_unsure = hits.owner == PROXY_OWNER
        if is_near.any():  # Origins are taken in turn.
            is_unsure |= is_near[np.arange(len(is_unsure)) % len(is_near)]
        again = np.flatnonzero(is_unsure)
        if len(again):
            rest = rays.select(again, rays.max_ranges_of(again))
            in_second = self._second.cast(rest, with_normals=with_normals)
            # Nearer hits can only be in the other hierarchy.
            reach = np.minimum(in_second.ranges, rest.max_ranges)
            in_first = self._first.cast(
                rest._replace(max_ranges=reach),
                mask=SOLID,
                with_normals=with_normals,
                doubt_all=doubt_all,
            )
            is_first = in_first.owner >= 0
            for result, first, second in zip(
                hits, in_first, in_second, strict=True
            ):
                second[is_first] = first[is_first]
                result[again] = second


class _CapsuleAxes:
    """Casts rays along the axes of capsules, in closed form.

    Embree's rounded segments lose most rays within 1e-3 rad of their axis. Only
    rays that start in line with a capsule can run along its axis.
    """

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
        seen = [entry for entry in self._found if entry[1].in_sight]
        if not (seen and len(rays.d_Sset)):
            return
        _, groups, _, matrices, sizes = zip(*seen, strict=True)
        X_LCs = np.array(matrices)
        half, radius = np.transpose(sizes)
        X_OCs = product(np.array([group.X_OL for group in groups]), X_LCs)
        angle, way = np.transpose(
            [_greatest_motion(group.motion) for group in groups]
        )
        # Rays along an axis start in a cone about it, which is wider if the
        # capsule moves.
        columns = np.ascontiguousarray(rays.p_OSset.T)
        low, high = columns.min(axis=1), columns.max(axis=1)
        way += np.linalg.norm((high - low) / 2.0)
        way += angle * np.linalg.norm(X_LCs[:, :3, 3], axis=1)
        away = (low + high) / 2.0 - X_OCs[:, :, 3]
        distance = np.linalg.norm(away, axis=1)
        along = (away * X_OCs[:, :, 2]).sum(axis=1)
        reach = (2.0 * _LARGEST_SINE + angle) * (distance + way + half)
        reach += radius + way
        R_SOset = rays.R_OSset.swapaxes(1, 2)
        for k in np.flatnonzero(distance**2 - along**2 <= reach**2):
            row, group, index, X_LC, size = seen[k]
            times = rays.times if group.motion else rays.times[:1]
            axes = product(group.X_OL_at(times), X_LC)[:, :, 2]
            cycle = np.arange(np.lcm(len(axes), len(R_SOset)))
            axes_S = rotated(
                R_SOset[cycle % len(R_SOset)], axes[cycle % len(axes)]
            )
            d_Sset = rays.d_Sset.reshape(-1, len(cycle), 3)
            # A sum over the last axis takes twenty times as long.
            d_along = sum(d_Sset[:, :, n] * axes_S[:, n] for n in range(3))
            ray = np.flatnonzero(d_along**2 >= 1.0 - _LARGEST_SINE**2)
            near = rays.select(ray, rays.max_ranges_of(ray))
            X_OC = product(group.X_OL_at(near.times), X_LC)
            R_CO = X_OC[:, :, :3].swapaxes(1, 2)
            ranges, normals_C = _meet_capsule(
                rotated(R_CO, near.p_OSset - X_OC[:, :, 3]),
                rotated(R_CO, near.d_Oset()),
                *size,
            )
            is_nearer = ranges <= near.max_ranges
            is_nearer &= ranges < hits.ranges[ray] - _RANGE_TOLERANCE
            ray = ray[is_nearer]
            hits.ranges[ray] = ranges[is_nearer]
            hits.owner[ray], hits.group[ray] = index, row
            if hits.normals.shape[1]:
                normals_L = rotated(X_LC[:3, :3], normals_C[is_nearer])
                hits.normals[ray] = normals_L


def _greatest_motion(motion: Motion | None) -> tuple[float, float]:
    """Returns the greatest rotation [rad] and displacement [m] of a frame."""
    if motion is None:
        return 0.0, 0.0
    time = motion.duration + abs(motion.start)
    return math.hypot(*motion.w) * time, math.hypot(*motion.v) * time


def _meet_capsule(
    p: np.ndarray, d: np.ndarray, half: float, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the hits of N rays on a capsule along z, in closed form.

    Args:
        p: (N, 3) origins, relative to the capsule's middle [m].
        d: (N, 3) unit directions.
        half: half the length of the capsule's straight part [m].
        radius: radius of the capsule [m].

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
