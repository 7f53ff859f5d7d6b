"""Groups of geometry as Embree scenes.

Curved shapes are not tessellated: Embree intersects spheres, cones, discs
and rounded segments exactly (in float32), and an ellipsoid is an instance of
the unit sphere. A curved shape in a scene slows down all its rays by a third
(measured), even those that meet only triangles. Curved shapes that stay
therefore have a second hierarchy. Polyhedra about them in the first one select
the few rays to cast on it. Those that move are instances, which few rays enter:
they are in the first hierarchy themselves. Embree loses rays along the axis of
a rounded segment, which are therefore cast in closed form (`CapsuleAxes`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.ray_casting.curved_shapes import CapsuleAxes, NearCurvedShapes
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
    """A bounding volume hierarchy over groups; see `RayCastingScene`."""

    def __init__(
        self,
        groups: Sequence[RayGroup],
        num_threads: int,
        previous: EmbreeScene | None = None,
    ):
        """Builds the scene of groups that are placed.

        Args:
            previous: a scene whose parts for unchanged groups are reused.

        Raises:
            MemoryError: Embree cannot build it.
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
        self._near = NearCurvedShapes(
            [groups[row] for row in self._second.rows]
        )
        self._axes = CapsuleAxes(groups)

    def place(self, placed: Placed) -> None:
        """Moves groups to their places."""
        self._first.place(placed)
        self._axes.place(placed)

    def cast_rays(self, rays: Rays, with_normals: bool) -> Hits:
        """Casts rays."""
        hits = self._first.cast(rays, with_normals=with_normals)
        if self._second.rows:
            self._cast_again(rays, hits, with_normals)
        self._axes.cast(rays, hits)
        return hits

    def _cast_again(self, rays: Rays, hits: Hits, with_normals: bool) -> None:
        """Updates the hits of rays that may meet curved shapes that stay."""
        is_near = self._near.contain(rays.p_OSset)
        is_unsure = hits.owner == PROXY_OWNER
        if is_near.any():  # Origins are taken in turn.
            is_unsure |= np.resize(is_near, len(is_unsure))
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
