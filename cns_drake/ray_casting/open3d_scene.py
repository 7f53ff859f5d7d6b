"""Groups of geometry as Open3D scenes, for platforms without Embree's wheel.

About a third as fast as `embree_hierarchy`, and curved shapes are polyhedra:
Open3D has triangles only.
"""

from collections.abc import Sequence
import functools
import sys

import numpy as np

from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits, Rays
from cns_drake.scene.surfaces import merge_triangles, tessellate

# Sides of the polyhedron of a round shape, true to 0.03 % of its radius.
_SIDES = 128


class Open3dScene:
    """An Open3D scene for each group; see `RayCastingScene`."""

    def __init__(self, groups: Sequence[RayGroup], num_threads: int):
        """Builds the scenes."""
        import open3d

        _say_once()
        self._open3d = open3d
        self._groups = groups
        self._num_threads = num_threads
        self._scenes = []
        self._owners = []
        for group in groups:
            merged, owners = merge_triangles(
                [
                    (index, X_LG, tessellate(shape, _SIDES))
                    for index, X_LG, shape in group.members
                ]
            )
            scene = open3d.t.geometry.RaycastingScene()
            scene.add_triangles(
                open3d.core.Tensor(merged.p_GVset.astype(np.float32)),
                open3d.core.Tensor(merged.triangles.astype(np.uint32)),
            )
            self._scenes.append(scene)
            self._owners.append(owners)

    def place(self, placed: Placed) -> None:
        """Does nothing: rays are brought to the groups when they are cast."""

    def cast_rays(self, rays: Rays, with_normals: bool) -> Hits:
        """Casts rays; see `EmbreeScene.cast_rays`."""
        num_rays = len(rays.d_Sset)
        p_Oset, d_Oset = rays.p_Oset(), rays.d_Oset()
        max_ranges = rays.max_ranges_of(np.arange(num_rays))
        times = rays.times[np.arange(num_rays) % len(rays.times)]
        result = Hits.misses(num_rays, with_normals)
        for row, group in enumerate(self._groups):
            if not group.in_sight:
                continue
            X_OL = group.X_OL_at(times[: None if group.motion else 1])
            R_LO = np.linalg.inv(X_OL[:, :, :3])
            # Directions are not normalised in a stretched group, so that
            # distances along the ray stay those in O.
            rays_L = np.empty((num_rays, 6), np.float32)
            p_OLset = p_Oset - X_OL[:, :, 3]
            rays_L[:, :3] = np.einsum("nij,nj->ni", R_LO, p_OLset)
            rays_L[:, 3:] = np.einsum("nij,nj->ni", R_LO, d_Oset)
            hits = self._scenes[row].cast_rays(
                self._open3d.core.Tensor(rays_L), nthreads=self._num_threads
            )
            distance = hits["t_hit"].numpy()
            nearer = np.flatnonzero(
                (distance < result.ranges) & (distance <= max_ranges)
            )
            result.ranges[nearer] = distance[nearer]
            primitive = hits["primitive_ids"].numpy()[nearer]
            result.owner[nearer] = self._owners[row][primitive]
            result.group[nearer] = row
            if with_normals:
                normals = hits["primitive_normals"].numpy()
                result.normals[nearer] = normals[nearer]
        return result


@functools.cache
def _say_once() -> None:
    print(
        "note: no embreex on this platform; casting rays with Open3D, which "
        "is slower and takes curved shapes as polyhedra",
        file=sys.stderr,
    )
