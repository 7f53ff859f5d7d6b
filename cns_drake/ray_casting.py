"""Casting rays on perception geometry.

The only module that knows the ray-casting library: Embree, or Open3D on
platforms for which there is no wheel of Embree's C library.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
import importlib.util

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

from cns_drake.perception_geometry import PerceptionGeometry
from cns_drake.ray_groups import RayGroup, group_geometries

# The package whose wheel holds Embree's C library.
_EMBREE_PACKAGE = "embreex"


@dataclass(frozen=True)
class RayHits:
    """What N rays met first.

    Attributes:
        ranges: (N,) float32 distance along the ray [m], inf for a miss.
        geometry: (N,) int32 index into the scene's geometries, -1 for a miss.
        normals_W: (N, 3) float32 unit normal in the world, facing the ray's
            origin, zero for a miss; None unless asked for.
    """

    ranges: np.ndarray
    geometry: np.ndarray
    normals_W: np.ndarray | None = None


class RayCastingScene:
    """A bounding volume hierarchy over perception geometry.

    Geometry on frames that never move is merged, in world coordinates; the
    geometry of every other frame is an instance that `set_frame_poses`
    places. Coordinates are kept relative to a point O in the middle of the
    merged geometry, so that float32 resolves 1e-5 m within 200 m of it
    wherever the world's origin may be.
    """

    def __init__(
        self,
        geometries: Sequence[PerceptionGeometry],
        anchored_frames: Collection[FrameId],
        calc_X_WF: Callable[[FrameId], RigidTransform],
    ):
        """Builds the scene.

        Args:
            geometries: what rays can hit; hits give indices into it.
            anchored_frames: the frames that never move.
            calc_X_WF: gives the pose of a frame in the world.
        """
        self._p_WO, self._groups = group_geometries(
            geometries, anchored_frames, calc_X_WF
        )
        for group in self._groups:
            group.place(self._p_WO, calc_X_WF)
        self._scene = _make_scene(self._groups)
        self._moving = [
            row
            for row, group in enumerate(self._groups)
            if group.frame_id is not None
        ]

    def set_frame_poses(
        self, calc_X_WF: Callable[[FrameId], RigidTransform]
    ) -> None:
        """Moves the geometry of the frames that are not anchored."""
        for row in self._moving:
            self._groups[row].place(self._p_WO, calc_X_WF)
        if self._moving:
            self._scene.place(self._moving)

    def cast_rays(
        self,
        p_WSset: np.ndarray,
        d_Wset: np.ndarray,
        max_range: float,
        *,
        with_normals: bool = False,
        num_threads: int = 1,
    ) -> RayHits:
        """Casts N rays.

        Args:
            p_WSset: (3,) common origin or (N, 3) origins in the world [m].
            d_Wset: (N, 3) unit directions, expressed in the world.
            max_range: how far to look [m].
            with_normals: also return the normals of the surfaces.
            num_threads: how many threads to share the rays between; the
                result does not depend on it.
        """
        p_OSset = np.atleast_2d(p_WSset) - self._p_WO
        d_Wset = np.ascontiguousarray(d_Wset, dtype=np.float32)
        num_rays = len(d_Wset)
        if len(p_OSset) not in (1, num_rays):
            raise ValueError(f"{len(p_OSset)} origins for {num_rays} rays")
        normals = np.zeros((num_rays, 3 if with_normals else 0), np.float32)
        ranges, owner, group = self._scene.cast_rays(
            p_OSset.astype(np.float32), d_Wset, max_range, normals, num_threads
        )
        if not with_normals:
            return RayHits(ranges, owner)
        return RayHits(ranges, owner, self._face_rays(normals, group, d_Wset))

    def _face_rays(self, normals, group, d_Wset) -> np.ndarray:
        """Returns unit world normals, turned towards the rays' origins."""
        for row, placed in enumerate(self._groups):
            if not placed.is_merged_world:
                of_group = group == row
                # Normals transform by the inverse transpose.
                normals[of_group] @= np.linalg.inv(placed.X_OL[:, :3])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals /= np.where(length > 0.0, length, 1.0)
        normals[np.einsum("ij,ij->i", normals, d_Wset) > 0.0] *= -1.0
        return normals


def _make_scene(groups: Sequence[RayGroup]):
    if importlib.util.find_spec(_EMBREE_PACKAGE) is not None:
        from cns_drake.embree_scene import EmbreeScene

        return EmbreeScene(groups)
    from cns_drake.open3d_scene import Open3dScene

    return Open3dScene(groups)
