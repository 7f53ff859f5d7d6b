"""Groups of geometry as two Embree hierarchies.

Curved shapes are not tessellated: Embree intersects spheres, cones, discs and
rounded segments exactly (in float32), and an ellipsoid is an instance of the
unit sphere. A curved shape in a scene slows down all rays of the scene by a
third (measured), even rays that hit only triangles. Curved shapes that never
move are therefore in a second hierarchy. The first hierarchy contains polyhedra
around these shapes; only the few rays that hit a polyhedron are cast on the
second hierarchy. Curved shapes that move are in the first hierarchy themselves,
as instances, which few rays enter. Embree loses rays along the axis of a
rounded segment; such rays are therefore cast in closed form (`CapsuleAxes`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.ray_casting.capsule_axes import CapsuleAxes
from cns_drake.ray_casting.curved_proxies import NearCurvedShapes
from cns_drake.ray_casting.embree_hierarchy import EmbreeHierarchy
from cns_drake.ray_casting.embree_primitives import (
    PROXY_OWNER,
    SOLID,
    merge_first,
    merge_second,
)
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits, Rays


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
        self._axes = CapsuleAxes(groups)

    def place(self, placed: Placed) -> None:
        """Moves all groups to their current poses."""
        self._first.place(placed)

    def cast_rays(self, rays: Rays, with_normals: bool) -> Hits:
        """Casts rays on the scene; returns the hits.

        Args:
            rays: the rays.
            with_normals: whether to find normals as well.
        """
        hits = self._first.cast(rays, with_normals=with_normals)
        if self._second.rows:
            self._cast_on_curved_shapes(rays, hits, with_normals)
        self._axes.cast(rays, hits)
        return hits

    def _cast_on_curved_shapes(
        self, rays: Rays, hits: Hits, with_normals: bool
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
            )
            is_first = in_first.owner >= 0
            for result, first, second in zip(
                hits, in_first, in_second, strict=True
            ):
                second[is_first] = first[is_first]
                result[again] = second
