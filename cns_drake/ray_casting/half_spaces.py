"""Rays on the planes that bound half spaces, in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled

if TYPE_CHECKING:
    from cns_drake.ray_casting.ray_groups import RayGroup
    from cns_drake.ray_casting.rays import Hits, Rays


class Planes(NamedTuple):
    """Planes, each with its group.

    Attributes:
        equations: (T, H, 4) float64; a point p_O on plane h fulfils
            equations[t, h, :3] @ p_O = equations[t, h, 3] at the t-th of the
            rays' times, or always if T is 1.
        owners: (H,) int32 index of the geometry.
        groups: (H,) int32 row of the group.
    """

    equations: np.ndarray
    owners: np.ndarray
    groups: np.ndarray


def cast_on_planes(
    groups: Mapping[int, RayGroup], rays: Rays, hits: Hits
) -> None:
    """Updates `hits` where rays meet a plane first.

    Rays meet a plane from both sides, like any other surface.

    Args:
        groups: row -> group of one half space, placed.
        rays: N of them.
        hits: their hits so far.
    """
    times = np.zeros(1)
    if any(group.motion is not None for group in groups.values()):
        times = rays.times
    X_OLs = np.stack([group.X_OL_at(times) for group in groups.values()], 1)
    normals, origins = X_OLs[..., 2], X_OLs[..., 3]
    offsets = np.einsum("thi,thi->th", normals, origins)
    planes = Planes(
        np.concatenate([normals, offsets[..., None]], axis=-1),
        np.array([group.members[0][0] for group in groups.values()], np.int32),
        np.array(list(groups), np.int32),
    )
    _cast(planes, rays, hits)


@compiled
def _cast(planes: Planes, rays: Rays, hits: Hits) -> None:
    for ray in range(len(rays.d_Sset)):
        p = rays.p_OSset[ray % len(rays.p_OSset)]
        R = rays.R_OSset[ray % len(rays.R_OSset)]
        d = rays.d_Sset[ray]
        reach = rays.max_ranges[ray % len(rays.max_ranges)]
        equations = planes.equations[ray % len(planes.equations)]
        for h in range(len(equations)):
            toward, height = 0.0, equations[h, 3]
            for axis in range(3):
                n = equations[h, axis]
                height -= n * p[axis]
                toward += n * (
                    R[axis, 0] * d[0] + R[axis, 1] * d[1] + R[axis, 2] * d[2]
                )
            # A ray along the plane does not meet it.
            if toward == 0.0:
                continue
            distance = height / toward
            if 0.0 <= distance <= reach and distance < hits.ranges[ray]:
                hits.ranges[ray] = distance
                hits.owner[ray] = planes.owners[h]
                hits.group[ray] = planes.groups[h]
                for axis in range(hits.normals.shape[1]):
                    # In L, the plane is z = 0.
                    hits.normals[ray, axis] = 1.0 if axis == 2 else 0.0
