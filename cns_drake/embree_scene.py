"""Groups of geometry as Embree scenes.

Rays are cast in packets that Embree takes as coherent, which is what makes a
LiDAR's neighbouring beams cheap, and scenes are built robust, so that no ray
slips through an edge that two triangles share.

Curved shapes are not tessellated: Embree intersects spheres, cones, discs
and rounded segments exactly (in float32), and an ellipsoid is an instance of
the unit sphere.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
import ctypes
import weakref

import numpy as np

from cns_drake import embree
from cns_drake.perception_geometry import (
    CylinderSurface,
    EllipsoidSurface,
    TriangleSurface,
)
from cns_drake.ray_groups import Member, RayGroup

# Threads take this many rays at a time: whole packets, and many enough that
# a call costs little beside them.
_BLOCK = 2048


class EmbreeScene:
    """A bounding volume hierarchy over groups; see `RayCastingScene`."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Builds the scene of groups that are placed.

        Raises:
            MemoryError: Embree cannot build it.
        """
        self._groups = groups
        self._lib = embree.load()
        self._device = self._lib.rtcNewDevice(None)
        self._scenes: list[int] = []
        weakref.finalize(self, _release, self._lib, self._device, self._scenes)

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
        self._instances: list[int] = []
        if len(groups) == 1 and groups[0].is_merged_world:
            self._top = scenes[0]
        else:
            self._top = self._new_scene()
            self._instances = [self._new_instance(scene) for scene in scenes]
            self.place(range(len(groups)))
            self._lib.rtcCommitScene(self._top)  # Of no groups, too.
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

    def place(self, rows: Collection[int]) -> None:
        """Moves groups to where their `X_OL` says."""
        for row in rows if self._instances else ():
            handle = self._instances[row]
            matrix = np.ascontiguousarray(self._groups[row].X_OL, np.float32)
            self._lib.rtcSetGeometryTransform(
                handle, 0, embree.FLOAT3X4_ROW_MAJOR, matrix.ctypes.data
            )
            self._lib.rtcCommitGeometry(handle)
        if self._instances:
            self._lib.rtcCommitScene(self._top)

    def cast_rays(
        self,
        p_OSset: np.ndarray,
        d_Oset: np.ndarray,
        max_range: float,
        normals_L: np.ndarray,
        num_threads: int,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Casts N rays.

        Args:
            p_OSset: (1, 3) or (N, 3) float32 origins.
            d_Oset: (N, 3) float32 unit directions.
            max_range: how far to look.
            normals_L: (N, 3) float32, gets the normals of the surfaces in
                their groups' frames, of any length; (N, 0) if none are
                wanted.
            num_threads: how many threads to share the rays between.

        Returns:
            (N,) float32 ranges, inf for a miss; (N,) int32 index of the
            geometry and (N,) int32 row of its group, -1 for a miss.
        """
        num_rays = len(d_Oset)
        ranges = np.empty(num_rays, np.float32)
        owner = np.empty(num_rays, np.int32)
        group = np.empty(num_rays, np.int32)

        def cast(block: slice) -> None:
            embree.cast_packets(
                ctypes.cast(self._lib.rtcIntersect16, ctypes.c_void_p).value,
                self._top,
                ctypes.addressof(self._arguments),
                p_OSset if len(p_OSset) == 1 else p_OSset[block],
                d_Oset[block],
                np.float32(max_range),
                self._first_primitive,
                self._owner_of_primitive,
                ranges[block],
                owner[block],
                group[block],
                normals_L[block],
            )

        if num_threads == 1:
            cast(slice(0, num_rays))
        else:
            starts = range(0, num_rays, _BLOCK)
            with ThreadPoolExecutor(num_threads) as threads:
                # Consumed, so that an error in a thread is raised here.
                list(threads.map(cast, (slice(s, s + _BLOCK) for s in starts)))
        return ranges, owner, group

    def _new_scene(self) -> int:
        scene = self._lib.rtcNewScene(self._device)
        self._lib.rtcSetSceneFlags(scene, embree.ROBUST_SCENE)
        self._scenes.append(scene)
        return scene

    def _build_scene(self, group: RayGroup, first_primitive) -> int:
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


def _release(lib, device, scenes) -> None:
    for scene in reversed(scenes):
        lib.rtcReleaseScene(scene)
    lib.rtcReleaseDevice(device)


def _merge(members: Sequence[Member]) -> Iterator[tuple]:
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
