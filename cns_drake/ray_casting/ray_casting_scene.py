"""Ray casting on a SceneGraph's geometry."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

from cns_drake.ray_casting import moving_groups
from cns_drake.ray_casting.embree_scene import EmbreeScene
from cns_drake.ray_casting.known_poses import NOTHING_KNOWN, KnownPoses
from cns_drake.ray_casting.ray_groups import Motion, group_geometries, serves
from cns_drake.ray_casting.rays import Hits, Rays
from cns_drake.scene import PerceptionGeometry
from evaluation.base import compiled

_IDENTITY = np.eye(3)
_AT_ONCE = np.zeros(1, np.float32)


@dataclass(frozen=True)
class SceneHits:
    """The first hits of N rays.

    Attributes:
        ranges: (N,) float32 distance along the ray [m], inf for a miss.
        geometry: (N,) int32 index into the scene's geometries, -1 for a miss.
        normals_W: (N, 3) float32 unit normal in the world, facing the ray's
            origin, zero for a miss; (N, 0) unless requested.
        is_outside: (N,) bool, whether the ray hit the outside of a surface,
            according to the winding of its triangles; (0,) unless normals are
            requested.
    """

    ranges: np.ndarray
    geometry: np.ndarray
    normals_W: np.ndarray
    is_outside: np.ndarray


class SurfaceFrames(NamedTuple):
    """The R frames L with which the surfaces of G geometries move.

    Attributes:
        row: (G,) row of each geometry's frame L in the other arrays.
        normal_matrices: (R, 3, 3) inverse transpose of the linear part of each
            X_WL.
        p_WLset: (R, 3) origin of each L in the world [m].
    """

    row: np.ndarray
    normal_matrices: np.ndarray
    p_WLset: np.ndarray


class RayCastingScene:
    """Geometry on which rays can be cast, in a bounding volume hierarchy.

    Geometry on frames that never move is merged, in world coordinates. The
    geometry of every other frame is an instance, which `set_frame_poses` moves.
    Rays on half spaces are computed in closed form.

    Coordinates are relative to a point O in the middle of the merged geometry,
    so that float32 resolves 1e-5 m within 200 m of O, wherever the world's
    origin is. If the sensor is more than 1 km from this middle, O is near the
    sensor instead.
    """

    def __init__(
        self,
        geometries: Sequence[PerceptionGeometry],
        anchored_frames: Collection[FrameId],
        calc_X_WF: Callable[[FrameId], RigidTransform],
        *,
        num_threads: int = 1,
        previous: RayCastingScene | None = None,
        p_WS: np.ndarray | None = None,
    ):
        """Builds the scene.

        Args:
            geometries: the geometries that rays can hit. A hit contains the
                index of its geometry in this sequence.
            anchored_frames: frames that never move.
            calc_X_WF: function that returns the pose of a frame in the world.
            num_threads: number of threads that share the rays of a cast; hits
                do not depend on this number.
            previous: a scene of similar geometry, which the new scene replaces.
                Parts of the previous scene are reused where the surfaces are
                still the same objects. None to build all anew.
            p_WS: (3,) position of the sensor in the world [m]; None if it is
                not known.
        """
        self._p_WO, self._groups = group_geometries(
            enumerate(geometries),
            anchored_frames,
            calc_X_WF,
            p_WS=p_WS,
        )
        for group in self._groups:
            group.place(self._p_WO, calc_X_WF)
        solid = [group for group in self._groups if not group.is_half_space]
        self._planes = dict(list(enumerate(self._groups))[len(solid) :])
        self._scene: EmbreeScene = EmbreeScene(
            solid, num_threads, None if previous is None else previous._scene
        )
        self._moving = moving_groups.MovingGroups(self._groups, self._p_WO)
        self._owners = np.array([g.members[0][0] for g in self._groups], int)
        self._normal_matrices: np.ndarray | None = None
        self._group_of = np.zeros(len(geometries), np.int64)
        for row, group in enumerate(self._groups):
            self._group_of[[index for index, *_ in group.members]] = row

    def serves(self, p_WS: np.ndarray) -> bool:
        """Returns whether ranges are precise for a sensor at p_WS (3,) [m].

        If not, make a new scene for the sensor's position.
        """
        return serves(self._p_WO, self._groups, p_WS)

    def set_frame_poses(
        self,
        calc_X_WF: Callable[[FrameId], RigidTransform],
        motions: Mapping[FrameId, Motion] = moving_groups.NO_MOTIONS,
        known: KnownPoses = NOTHING_KNOWN,
        seen: moving_groups.Ball = moving_groups.EVERYWHERE,
    ) -> None:
        """Moves the geometry of the frames that are not anchored.

        Args:
            calc_X_WF: function that returns the pose of a frame in the world.
            motions: motions of frames that move during the LiDAR's revolution.
            known: known poses, for which `calc_X_WF` is not called.
            seen: ball that contains all rays; geometry outside of the ball is
                not moved.
        """
        placed = self._moving.place(calc_X_WF, motions, known, seen)
        if len(placed.rows):
            if self._planes:  # Half spaces are the last groups.
                placed = placed.below(min(self._planes))
            self._scene.place(placed)
            self._normal_matrices = None

    def surface_frames(self) -> SurfaceFrames:
        """Returns the frame L with which the surface of each geometry moves.

        For merged geometry L is the world, otherwise the geometry's own frame.
        """
        p_WLset = [
            np.zeros(3) if g.is_merged_world else g.X_OL[:, 3] + self._p_WO
            for g in self._groups
        ]
        matrices = self._calc_normal_matrices()
        return SurfaceFrames(
            self._group_of, matrices, np.reshape(p_WLset, (-1, 3))
        )

    def cast_rays(
        self,
        p_WSset: np.ndarray,
        d_Sset: np.ndarray,
        max_range: float | np.ndarray,
        *,
        R_WSset: np.ndarray = _IDENTITY,
        times: np.ndarray = _AT_ONCE,
        with_normals: bool = False,
    ) -> SceneHits:
        """Returns the first hits of N rays from one or several poses of S.

        S is a sensor, such as a LiDAR, which may move during its revolution.
        Ray i has direction i. From every other array, ray i uses entry i mod n,
        where n is the length of the array.

        Args:
            p_WSset: (3,) or (K, 3) origins in the world [m].
            d_Sset: (N, 3) unit directions, expressed in S.
            max_range: greatest range [m], one for all rays or (M,).
            R_WSset: (3, 3) or (L, 3, 3) orientations of S in the world.
            times: (T,) times at which rays are cast, from 0 at the start of the
                revolution to 1 at its end; by default 0.
            with_normals: whether to also return the normals of the surfaces, as
                they are at the start of the revolution.

        Raises:
            ValueError: N is not a multiple of K, L, M or T.
        """
        p_OSset = np.ascontiguousarray(
            np.atleast_2d(p_WSset) - self._p_WO, dtype=float
        )
        R_WSset = np.reshape(R_WSset, (-1, 3, 3))
        max_ranges = np.atleast_1d(np.asarray(max_range, np.float32))
        for count, what in (
            (len(p_OSset), "origins"),
            (len(max_ranges), "ranges"),
            (len(R_WSset), "frames"),
            (len(times), "times"),
        ):
            if len(d_Sset) % max(count, 1) or (count == 0 and len(d_Sset)):
                raise ValueError(f"{count} {what} for {len(d_Sset)} rays")
        rays = Rays(
            p_OSset,
            np.ascontiguousarray(R_WSset, dtype=float),
            max_ranges,
            np.ascontiguousarray(d_Sset, dtype=float),
            np.ascontiguousarray(times, dtype=np.float32),
        )
        if self._planes:
            hits = self._cast_on_planes(rays, with_normals)
        else:
            hits = self._scene.cast_rays(rays, with_normals)
        is_outside = np.zeros(0, bool)
        if with_normals:
            matrices = self._calc_normal_matrices()
            is_outside = _face_origins(hits, matrices, rays.d_Oset())
        return SceneHits(hits.ranges, hits.owner, hits.normals, is_outside)

    def _cast_on_planes(self, rays: Rays, with_normals: bool) -> Hits:
        """Casts rays on half spaces first, and then on all other geometry.

        A ray that hits a plane is followed no farther than that. Rays hit a
        plane from both sides, like any other surface.
        """
        repeats = len(rays.d_Sset) // max(len(rays.max_ranges), 1)
        limits = np.tile(rays.max_ranges, repeats)
        met = np.full(len(limits), -1, np.int32)
        for row, group in self._planes.items():
            times = _AT_ONCE if group.motion is None else rays.times
            _cast_on_plane(group.X_OL_at(times).copy(), rays, row, limits, met)
        hits = self._scene.cast_rays(
            rays._replace(max_ranges=limits), with_normals
        )
        _take_plane_hits(met, limits, self._owners, hits)
        return hits

    def _calc_normal_matrices(self) -> np.ndarray:
        """Returns (G, 3, 3) maps of normals from groups' frames to O."""
        if self._normal_matrices is None:
            rotations = [
                np.eye(3) if group.is_merged_world else group.X_OL[:, :3]
                for group in self._groups
            ]
            # Normals transform by the inverse transpose.
            maps = np.linalg.inv(np.reshape(rotations, (-1, 3, 3)))
            self._normal_matrices = np.ascontiguousarray(
                maps.transpose(0, 2, 1)
            )
        return self._normal_matrices


@compiled
def _face_origins(
    hits: Hits, normal_matrices: np.ndarray, d_Oset: np.ndarray
) -> np.ndarray:
    """Makes normals unit vectors in O that face the origins of rays.

    The (G, 3, 3) matrices map normals from a group's frame to O. The function
    is compiled, because NumPy would take a quarter of a frame's time.

    Returns:
        (N,) whether each ray has met the outside of a surface, according to the
        winding of the surface's triangles.
    """
    is_outside = np.zeros(len(hits.group), np.bool_)
    n = np.empty(3)
    normals, group = hits.normals, hits.group
    for ray in range(len(normals)):
        if group[ray] < 0:
            continue
        M = normal_matrices[group[ray]]
        square = along = 0.0
        for i in range(3):
            n[i] = (
                M[i, 0] * normals[ray, 0]
                + M[i, 1] * normals[ray, 1]
                + M[i, 2] * normals[ray, 2]
            )
            square += n[i] * n[i]
            along += n[i] * d_Oset[ray, i]
        is_outside[ray] = along <= 0.0
        scale = np.sqrt(square) if square > 0.0 else 1.0
        for i in range(3):
            normals[ray, i] = n[i] / (-scale if along > 0.0 else scale)
    return is_outside


@compiled
def _cast_on_plane(
    X_OLs: np.ndarray,
    rays: Rays,
    row: int,
    limits: np.ndarray,
    met: np.ndarray,
) -> None:
    """Casts rays on a half space: the plane z = 0 of its group's frame L.

    The function is compiled, because NumPy would take as long as all other
    geometry.

    Args:
        X_OLs: (K, 3, 4) poses of L; ray i takes pose i mod K.
        row: row of the group.
        limits: (N,) greatest ranges; set to the range of each hit [m].
        met: (N,) row of the group that each ray hit; set to `row` for each hit.
    """
    counts = len(rays.p_OSset), len(rays.R_OSset), len(X_OLs)
    origin = turn = pose = -1
    height = 0.0
    normal_S = np.empty(3)
    for ray in range(len(rays.d_Sset)):
        if ray == 0 or max(counts) > 1:
            # Indices are incremented, because remainders take long.
            origin = origin + 1 if origin + 1 < counts[0] else 0
            turn = turn + 1 if turn + 1 < counts[1] else 0
            pose = pose + 1 if pose + 1 < counts[2] else 0
            R = rays.R_OSset[turn]
            X = X_OLs[pose]
            height = 0.0
            for i in range(3):
                height += X[i, 2] * (X[i, 3] - rays.p_OSset[origin, i])
                normal_S[i] = (
                    R[0, i] * X[0, 2] + R[1, i] * X[1, 2] + R[2, i] * X[2, 2]
                )
        along = 0.0
        for i in range(3):
            along += normal_S[i] * rays.d_Sset[ray, i]
        # Rays parallel to the plane, or away from it, do not hit it.
        if along == 0.0 or height * along < 0.0:
            continue
        distance = height / along
        is_first = met[ray] < 0 and distance == limits[ray]
        if distance < limits[ray] or is_first:
            limits[ray], met[ray] = distance, row


@compiled
def _take_plane_hits(
    met: np.ndarray, limits: np.ndarray, owners: np.ndarray, hits: Hits
) -> None:
    """Sets the hits of rays that hit a plane and nothing nearer.

    Args:
        met: (N,) row of the half space's group that each ray hit; -1 for none.
        limits: (N,) ranges of these hits [m].
        owners: (G,) index of the first geometry of each group.
        hits: hits of the rays on all other geometry, changed in place.
    """
    for ray in range(len(met)):
        row = np.int64(met[ray])
        if row >= 0 and hits.owner[ray] == -1:
            hits.ranges[ray] = limits[ray]
            hits.owner[ray], hits.group[ray] = owners[row], row
            for axis in range(hits.normals.shape[1]):
                hits.normals[ray, axis] = axis == 2
