"""Casting rays on perception geometry.

The only module that knows the ray-casting library, Embree (through
`cns_drake.embree`). Rays are cast in packets that Embree takes as coherent,
which is what makes a LiDAR's neighbouring beams cheap, and scenes are built
robust, so that no ray slips through an edge that two triangles share.

Curved shapes are not tessellated: Embree intersects spheres, cones, discs
and rounded segments exactly (in float32), and an ellipsoid is an instance of
the unit sphere.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
import ctypes
from dataclasses import dataclass
import weakref

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

from cns_drake import embree
from cns_drake.perception_geometry import (
    CylinderSurface,
    EllipsoidSurface,
    PerceptionGeometry,
    Surface,
    TriangleSurface,
)

# Threads take this many rays at a time: whole packets, and many enough that
# a call costs little beside them.
_BLOCK = 2048


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
        self._lib = embree.load()
        self._device = self._lib.rtcNewDevice(None)
        self._scenes: list[int] = []
        weakref.finalize(self, _release, self._lib, self._device, self._scenes)
        self._p_WO, groups = _group(geometries, anchored_frames, calc_X_WF)

        # Where a hit's (group, Embree geometry, primitive) is looked up.
        self._owners: list[np.ndarray] = []
        self._num_primitives = 0
        first_primitive = np.zeros(
            (max(1, len(groups)), embree.NUM_KINDS), np.int64
        )

        scenes = [
            self._build_scene(group, first_primitive[row])
            for row, group in enumerate(groups)
        ]
        # One level is faster than two. With two, the merged geometry is an
        # instance like the others, so that moving those never rebuilds it.
        self._instances: list[tuple[_Group, int]] = []
        if len(groups) == 1 and groups[0].is_merged_world:
            self._top = scenes[0]
        else:
            self._top = self._new_scene()
            for group, scene in zip(groups, scenes, strict=True):
                self._instances.append((group, self._new_instance(scene)))
            self._place(self._instances, calc_X_WF)
        error = self._lib.rtcGetDeviceError(self._device)
        if error:
            raise MemoryError(f"Embree cannot build the scene: error {error}")

        self._first_primitive = first_primitive
        self._owner_of_primitive = np.concatenate(
            [*self._owners, np.zeros(0, np.int32)]
        )
        self._arguments = embree.IntersectArguments(
            embree.COHERENT_RAYS, embree.INVALID_ID
        )

    def set_frame_poses(
        self, calc_X_WF: Callable[[FrameId], RigidTransform]
    ) -> None:
        """Moves the geometry of the frames that are not anchored."""
        moving = [i for i in self._instances if i[0].frame_id is not None]
        if moving:
            self._place(moving, calc_X_WF)

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
        ranges = np.empty(num_rays, np.float32)
        owner = np.empty(num_rays, np.int32)
        group = np.empty(num_rays, np.int32)
        normals = np.zeros((num_rays, 3 if with_normals else 0), np.float32)
        origins = p_OSset.astype(np.float32)

        def cast(block: slice) -> None:
            embree.cast_packets(
                ctypes.cast(self._lib.rtcIntersect16, ctypes.c_void_p).value,
                self._top,
                ctypes.addressof(self._arguments),
                origins if len(origins) == 1 else origins[block],
                d_Wset[block],
                np.float32(max_range),
                self._first_primitive,
                self._owner_of_primitive,
                ranges[block],
                owner[block],
                group[block],
                normals[block],
            )

        if num_threads == 1:
            cast(slice(0, num_rays))
        else:
            starts = range(0, num_rays, _BLOCK)
            with ThreadPoolExecutor(num_threads) as threads:
                # Consumed, so that an error in a thread is raised here.
                list(threads.map(cast, (slice(s, s + _BLOCK) for s in starts)))
        if not with_normals:
            return RayHits(ranges, owner)
        return RayHits(ranges, owner, self._face_rays(normals, group, d_Wset))

    def _face_rays(self, normals, group, d_Wset) -> np.ndarray:
        """Returns unit world normals, turned towards the rays' origins."""
        for row, (placed, _) in enumerate(self._instances):
            of_group = group == row
            # Normals transform by the inverse transpose.
            normals[of_group] @= np.linalg.inv(placed.X_OL[:, :3])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals /= np.where(length > 0.0, length, 1.0)
        normals[np.einsum("ij,ij->i", normals, d_Wset) > 0.0] *= -1.0
        return normals

    def _new_scene(self) -> int:
        scene = self._lib.rtcNewScene(self._device)
        self._lib.rtcSetSceneFlags(scene, embree.ROBUST_SCENE)
        self._scenes.append(scene)
        return scene

    def _build_scene(self, group: _Group, first_primitive) -> int:
        """Builds a group's scene and notes where its primitives are listed."""
        scene = self._new_scene()
        for k, (kind, buffers, owners) in enumerate(_merge(group.members)):
            handle = self._lib.rtcNewGeometry(self._device, kind)
            for slot, form, array in buffers:
                address = self._lib.rtcSetNewGeometryBuffer(
                    handle, slot, 0, form, array.strides[0], len(array)
                )
                ctypes.memmove(address, array.ctypes.data, array.nbytes)
            self._lib.rtcCommitGeometry(handle)
            self._lib.rtcAttachGeometry(scene, handle)
            self._lib.rtcReleaseGeometry(handle)
            first_primitive[k] = self._num_primitives
            self._owners.append(owners)
            self._num_primitives += len(owners)
        self._lib.rtcCommitScene(scene)
        return scene

    def _new_instance(self, scene: int) -> int:
        handle = self._lib.rtcNewGeometry(self._device, embree.INSTANCE)
        self._lib.rtcSetGeometryInstancedScene(handle, scene)
        self._lib.rtcAttachGeometry(self._top, handle)
        self._lib.rtcReleaseGeometry(handle)  # The scene keeps it.
        return handle

    def _place(self, instances, calc_X_WF) -> None:
        for group, handle in instances:
            X_OF = RigidTransform(-self._p_WO)
            if group.frame_id is not None:
                X_OF = X_OF @ calc_X_WF(group.frame_id)
            group.X_OL = X_OF.GetAsMatrix4()[:3] @ group.X_FL
            matrix = np.ascontiguousarray(group.X_OL, dtype=np.float32)
            self._lib.rtcSetGeometryTransform(
                handle, 0, embree.FLOAT3X4_ROW_MAJOR, matrix.ctypes.data
            )
            self._lib.rtcCommitGeometry(handle)
        self._lib.rtcCommitScene(self._top)


def _release(lib, device, scenes) -> None:
    for scene in reversed(scenes):
        lib.rtcReleaseScene(scene)
    lib.rtcReleaseDevice(device)


# What is built into one scene: index of a geometry, its pose, its surface.
_Member = tuple[int, RigidTransform, Surface]


@dataclass
class _Group:
    """Geometry that moves as one, in a local frame L.

    Attributes:
        frame_id: the frame F it is fixed to; None for the world.
        X_FL: (4, 4) affine map from L to F; not rigid for an ellipsoid,
            which in L is the unit sphere.
        members: what the group holds, posed in L.
        is_merged_world: whether L is the world, moved to O.
        X_OL: (3, 4) affine map from L to the scene's origin, once placed.
    """

    frame_id: FrameId | None
    X_FL: np.ndarray
    members: list[_Member]
    is_merged_world: bool = False
    X_OL: np.ndarray | None = None


def _group(geometries, anchored_frames, calc_X_WF):
    """Returns p_WO and the groups, the world's first if there is one."""
    by_frame: dict[FrameId | None, list[_Member]] = {}
    for index, geometry in enumerate(geometries):
        frame_id, X_FG = geometry.frame_id, geometry.X_FG
        if frame_id in anchored_frames:
            frame_id, X_FG = None, calc_X_WF(frame_id) @ X_FG
        member = (index, X_FG, geometry.surface)
        by_frame.setdefault(frame_id, []).append(member)

    p_WO = np.zeros(3)
    world = by_frame.pop(None, [])
    if world:
        places = np.array([X_WG.translation() for _, X_WG, _ in world])
        p_WO = np.round((places.min(axis=0) + places.max(axis=0)) / 2.0)

    groups, ellipsoids = [], []
    for frame_id, members in [(None, world), *by_frame.items()]:
        # Coordinates are relative to O before they are rounded to float32,
        # and relative to F where F moves.
        shift = p_WO if frame_id is None else np.zeros(3)
        X_FL, X_LF = RigidTransform(shift), RigidTransform(-shift)
        rest = []
        for index, X_FG, surface in members:
            if isinstance(surface, EllipsoidSurface) and not surface.is_sphere:
                stretch = np.diag([*surface.semi_axes, 1.0])
                unit_sphere = EllipsoidSurface((1.0, 1.0, 1.0))
                ellipsoids.append(
                    _Group(
                        frame_id,
                        X_FG.GetAsMatrix4() @ stretch,
                        [(index, RigidTransform(), unit_sphere)],
                    )
                )
            else:
                rest.append((index, X_LF @ X_FG, surface))
        if rest:
            groups.append(
                _Group(frame_id, X_FL.GetAsMatrix4(), rest, frame_id is None)
            )
    return p_WO, groups + ellipsoids


def _merge(members: Sequence[_Member]) -> Iterator[tuple]:
    """Merges surfaces into one Embree geometry per kind of primitive.

    Yields:
        Kind of geometry, its buffers (slot, format, array), and for each of
        its primitives the index of the geometry that it belongs to.
    """
    vertices, triangles, triangle_owners, num_vertices = [], [], [], 0
    cones, capsules, spheres = [], [], []
    for index, X_LG, surface in members:
        if isinstance(surface, TriangleSurface):
            vertices.append(
                surface.p_GVset @ X_LG.rotation().matrix().T
                + X_LG.translation()
            )
            triangles.append(surface.triangles + num_vertices)
            triangle_owners.append(np.full(len(surface.triangles), index))
            num_vertices += len(surface.p_GVset)
        elif isinstance(surface, EllipsoidSurface):
            radius = surface.semi_axes[0]
            spheres.append((index, [[*X_LG.translation(), radius]]))
        else:
            axis = X_LG.rotation().matrix()[:, 2]
            ends = [
                [*(X_LG.translation() + side * axis), surface.radius]
                for side in (-surface.length / 2.0, surface.length / 2.0)
            ]
            if isinstance(surface, CylinderSurface):
                cones.append((index, ends, [-axis, axis]))
            else:
                capsules.append((index, ends))

    if triangles:
        yield (
            embree.TRIANGLE,
            [
                (embree.VERTEX_BUFFER, embree.FLOAT3, _float32(vertices)),
                (embree.INDEX_BUFFER, embree.UINT3, _uint32(triangles)),
            ],
            np.concatenate(triangle_owners).astype(np.int32),
        )
    for kind, segments in [
        (embree.CONE, cones),
        (embree.ROUND_SEGMENT, capsules),
    ]:
        if segments:
            yield (
                kind,
                [
                    (
                        embree.VERTEX_BUFFER,
                        embree.FLOAT4,
                        _float32(s[1] for s in segments),
                    ),
                    (
                        embree.INDEX_BUFFER,
                        embree.UINT,
                        2 * np.arange(len(segments), dtype=np.uint32),
                    ),
                ],
                np.array([s[0] for s in segments], np.int32),
            )
    if cones:  # A cone is open at its ends: discs close it.
        yield (
            embree.DISC,
            [
                (
                    embree.VERTEX_BUFFER,
                    embree.FLOAT4,
                    _float32(c[1] for c in cones),
                ),
                (
                    embree.NORMAL_BUFFER,
                    embree.FLOAT3,
                    _float32(c[2] for c in cones),
                ),
            ],
            np.repeat([c[0] for c in cones], 2).astype(np.int32),
        )
    if spheres:
        yield (
            embree.SPHERE,
            [
                (
                    embree.VERTEX_BUFFER,
                    embree.FLOAT4,
                    _float32(s[1] for s in spheres),
                )
            ],
            np.array([s[0] for s in spheres], np.int32),
        )


def _float32(arrays) -> np.ndarray:
    return np.concatenate([np.asarray(a) for a in arrays]).astype(np.float32)


def _uint32(arrays) -> np.ndarray:
    return np.concatenate(list(arrays)).astype(np.uint32)
