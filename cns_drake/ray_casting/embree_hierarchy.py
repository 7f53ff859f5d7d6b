"""Groups of geometry in an Embree hierarchy, and packets of rays cast on it."""

from __future__ import annotations

from collections.abc import (
    Callable,
    Collection,
    Iterable,
    Mapping,
    Sequence,
)
from concurrent.futures import ThreadPoolExecutor
import ctypes
from typing import NamedTuple
import weakref

import numpy as np
from pydrake.math import RotationMatrix

from cns_drake.base.elementary import product, rotated
from cns_drake.ray_casting import embree
from cns_drake.ray_casting.embree_packets import PacketScenes, cast_packets
from cns_drake.ray_casting.embree_primitives import (
    ALL,
    Primitives,
)
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits, Rays

# Least number of rays that a thread takes at once: a multiple of every packet
# size, and large enough that the call costs little.
_BLOCK = 1024


class _Built(NamedTuple):
    """The RTCScene of a group (0 if empty), and the geometries' owners."""

    scene: int
    owners: tuple[np.ndarray, ...]


class EmbreeHierarchy:
    """A bounding volume hierarchy over the primitives of groups.

    Rays are cast in packets that are marked as coherent. Such packets are fast
    for neighbouring beams of a LiDAR. Embree's robust mode is on, so that no
    ray passes through an edge that two triangles share.

    Attributes:
        rows: indices of the groups that have primitives in the hierarchy.
    """

    def __init__(
        self,
        groups: Sequence[RayGroup],
        merge: Callable[[RayGroup], Iterable[Primitives]],
        num_threads: int = 1,
        previous: EmbreeHierarchy | None = None,
    ):
        """Builds the hierarchy.

        Args:
            groups: the groups, already placed (see `RayGroup.place`).
            merge: returns the primitives of a group, possibly none.
            num_threads: number of threads that share the rays of a cast.
            previous: hierarchy from which the scenes of unchanged groups are
                reused; None to build all anew.

        Raises:
            MemoryError: Embree has no memory for the hierarchy.
            RuntimeError: Embree cannot build the hierarchy for another reason.
        """
        self._groups = groups
        self._num_threads = num_threads
        # Threads start at their first use.
        self._helpers = ThreadPoolExecutor(max(1, num_threads - 1))
        self._lib = embree.load()
        if previous is None:
            self._device = self._lib.rtcNewDevice(embree.ALONE)
        else:
            self._device = previous._device
            self._lib.rtcRetainDevice(self._device)
        self._scenes: list[int] = []
        weakref.finalize(
            self, _release_scenes, self._lib, self._device, self._scenes
        )
        before = {} if previous is None else previous._by_content
        self._by_content: dict[tuple, _Built] = {}
        self._built = [
            self._scene_of_group(group, merge, before) for group in groups
        ]
        self.rows = [k for k, built in enumerate(self._built) if built.scene]
        fixed = [row for row in self.rows if groups[row].is_merged_world]
        moving = [row for row in self.rows if row not in fixed]
        self._top = 0
        # Row of a group -> handle of its instance.
        self._instances: dict[int, int] = {}
        # Rows of groups that rays cannot meet.
        self._disabled: set[int] = set()
        # Rows of groups that move during a revolution.
        self._in_motion: set[int] = set()
        if moving:
            self._top = self._new_scene()
            for row in moving:
                scene = self._built[row].scene
                self._instances[row] = self._new_instance(scene)
            self.place(Placed.of(groups, moving))
        self._check_device()
        self._arguments = embree.IntersectArguments(
            embree.COHERENT_RAYS, embree.INVALID_ID
        )
        lanes, self._intersect = embree.native_packet(self._lib, self._device)
        self._packet_scenes = self._make_packet_scenes(lanes, fixed, moving)

    def place(self, placed: Placed) -> None:
        """Moves the groups in sight to their poses, and disables all others.

        The fewer groups are enabled, the faster the hierarchy is rebuilt, and
        the faster rays are cast on it.
        """
        lib = self._lib
        places = np.ascontiguousarray(placed.X_OLs, np.float32)
        # Lists and one address: NumPy takes long for single values.
        address, size = places.ctypes.data, places.strides[0]
        in_sight, moves = placed.in_sight.tolist(), placed.moves.tolist()
        has_changed = False
        for k, row in enumerate(placed.rows.tolist()):
            handle = self._instances.get(row)
            if handle is None:
                continue
            if not in_sight[k]:
                if row not in self._disabled:
                    lib.rtcDisableGeometry(handle)
                    self._disabled.add(row)
                    has_changed = True
                continue
            has_changed = True
            if row in self._disabled:
                lib.rtcEnableGeometry(handle)
                self._disabled.remove(row)
            if moves[k]:
                self._in_motion.add(row)
                steps = _decompose_motion(self._groups[row])
                lib.rtcSetGeometryTimeStepCount(handle, len(steps))
                for step in range(len(steps)):
                    lib.rtcSetGeometryTransformQuaternion(
                        handle, step, steps[step].ctypes.data
                    )
            else:
                if row in self._in_motion:
                    lib.rtcSetGeometryTimeStepCount(handle, 1)
                    self._in_motion.remove(row)
                lib.rtcSetGeometryTransform(
                    handle, 0, embree.FLOAT3X4_ROW_MAJOR, address + k * size
                )
            lib.rtcCommitGeometry(handle)
        if has_changed:
            lib.rtcJoinCommitScene(self._top)

    def cast(
        self,
        rays: Rays,
        *,
        mask: int = ALL,
        with_normals: bool = False,
    ) -> Hits:
        """Casts rays on the geometry; returns the hits.

        Args:
            rays: the rays.
            mask: bits of the geometry that can be hit, such as `SOLID`.
            with_normals: whether to find normals as well.
        """
        num_rays = len(rays.d_Sset)
        hits = Hits.misses(num_rays, with_normals)
        # All threads take parts from one iterator, which yields each part once.
        parts = iter(_ray_ranges(num_rays, self._num_threads))

        def cast() -> None:
            for first, last in parts:
                cast_packets(
                    self._intersect,
                    self._packet_scenes,
                    mask,
                    rays,
                    hits,
                    first,
                    last,
                )

        num_helpers = min(self._num_threads, -(-num_rays // _BLOCK)) - 1
        helpers = [self._helpers.submit(cast) for _ in range(num_helpers)]
        cast()
        for helper in helpers:
            helper.result()
        return hits

    def _check_device(self) -> None:
        """Raises an error if a call of Embree has failed."""
        error = self._lib.rtcGetDeviceError(self._device)
        if error:
            fault = f"Embree cannot build the scene: error {error}"
            if error == embree.OUT_OF_MEMORY:
                raise MemoryError(fault)
            raise RuntimeError(fault)

    def _make_packet_scenes(
        self, lanes: int, fixed: Sequence[int], moving: Sequence[int]
    ) -> PacketScenes:
        """Returns the scenes for `cast_packets`.

        Args:
            lanes: number of rays in a packet.
            fixed: row of the group of static geometry; empty if there is none.
            moving: rows of all other groups in the hierarchy.
        """
        # Without static geometry, the first row belongs to no group. No ray
        # meets it, and the first members of group -1 are never read.
        rows = [*(fixed or [-1]), *moving]
        nothing = _Built(0, ())
        built = [self._built[row] if row >= 0 else nothing for row in rows]
        first_primitive, owner_of_primitive = _list_owners(built)
        counts = [len(group.members) for group in self._groups]
        indices = [index for g in self._groups for index, *_ in g.members]
        return PacketScenes(
            lanes=lanes,
            fixed=built[0].scene,
            instances=self._top,
            arguments=ctypes.addressof(self._arguments),
            first_primitive=first_primitive,
            owner_of_primitive=owner_of_primitive,
            groups=np.array(rows, np.int32),
            first_member=np.cumsum([0, *counts])[rows],
            geometries=np.array(indices, np.int32),
        )

    def _scene_of_group(
        self,
        group: RayGroup,
        merge: Callable[[RayGroup], Iterable[Primitives]],
        before: Mapping[tuple, _Built],
    ) -> _Built:
        """Returns the scene of a group; groups of the same shapes share it.

        Args:
            group: the group.
            merge: returns the primitives of a group, possibly none.
            before: content of a group -> its scene in an earlier hierarchy,
                which is reused.
        """
        content = group.content()
        if content not in self._by_content:
            built = before.get(content)
            if built is None:
                built = self._build_scene(list(merge(group)))
            elif built.scene:
                self._lib.rtcRetainScene(built.scene)
                self._scenes.append(built.scene)
            self._by_content[content] = built
        return self._by_content[content]

    def _new_scene(self) -> int:
        scene = self._lib.rtcNewScene(self._device)
        self._lib.rtcSetSceneFlags(scene, embree.ROBUST_SCENE)
        self._scenes.append(scene)
        return scene

    def _build_scene(self, parts: Sequence[Primitives]) -> _Built:
        if not parts:
            return _Built(0, ())
        scene = self._new_scene()
        for part in parts:
            handle = self._lib.rtcNewGeometry(self._device, part.kind)
            for slot, form, array in part.buffers:
                address = self._lib.rtcSetNewGeometryBuffer(
                    handle, slot, 0, form, array.strides[0], len(array)
                )
                if address is None:
                    raise MemoryError("Embree has no room for the scene")
                ctypes.memmove(address, array.ctypes.data, array.nbytes)
            self._lib.rtcSetGeometryMask(handle, part.mask)
            self._lib.rtcCommitGeometry(handle)
            self._lib.rtcAttachGeometry(scene, handle)
            self._lib.rtcReleaseGeometry(handle)
        self._lib.rtcJoinCommitScene(scene)
        return _Built(scene, tuple(part.owners for part in parts))

    def _new_instance(self, scene: int) -> int:
        handle = self._lib.rtcNewGeometry(self._device, embree.INSTANCE)
        self._lib.rtcSetGeometryInstancedScene(handle, scene)
        self._lib.rtcSetGeometryMask(handle, ALL)
        self._lib.rtcAttachGeometry(self._top, handle)
        self._lib.rtcReleaseGeometry(handle)  # The scene owns it.
        return handle


def _ray_ranges(num_rays: int, num_threads: int) -> list[tuple[int, int]]:
    """Returns ranges of ray indices for threads to take, the longest first.

    Some directions meet more geometry than others, so a thread that finishes
    early takes another range. Later ranges are shorter, so that all threads
    finish at about the same time.
    """
    parts = []
    first = 0
    while first < num_rays:
        share = (num_rays - first) // (2 * num_threads)
        size = max(share // _BLOCK, 1) * _BLOCK if num_threads > 1 else num_rays
        parts.append((first, min(first + size, num_rays)))
        first += size
    return parts


def _list_owners(scenes: Collection[_Built]) -> tuple[np.ndarray, np.ndarray]:
    """Returns `first_primitive` and `owner_of_primitive` of `PacketScenes`."""
    widest = max(1, *(len(built.owners) for built in scenes))
    first = np.zeros((len(scenes), widest), np.int64)
    owners = [np.zeros(0, np.int32)]
    count = 0
    known: dict[int, int] = {}
    for row, built in enumerate(scenes):
        same = known.setdefault(built.scene, row)
        if same < row:
            first[row] = first[same]
            continue
        for k, part in enumerate(built.owners):
            first[row, k] = count
            owners.append(part)
            count += len(part)
    return first, np.concatenate(owners)


def _release_scenes(
    lib: ctypes.CDLL, device: int, scenes: Sequence[int]
) -> None:
    for scene in reversed(scenes):
        lib.rtcReleaseScene(scene)
    lib.rtcReleaseDevice(device)


def _decompose_motion(group: RayGroup) -> np.ndarray:
    """Returns the poses of a moving group at evenly spaced times.

    Embree rotates F from one orientation to the next at a constant rate about
    F's origin, which moves in a straight line. That is the motion of a frame
    with constant velocities.

    Returns:
        (T, 16) float32, an RTCQuaternionDecomposition each: 3 scales, 3
        skews, shift, quaternion (real part first), translation. A point is
        scaled, shifted, turned, and translated.
    """
    assert group.motion is not None
    num_steps = group.motion.num_steps
    R_OO, way_F = group.motion.at(np.linspace(0.0, 1.0, num_steps))
    # The columns of both maps are the axes of L, rotated and stretched.
    scale = np.linalg.norm(group.X_FL[:3, :3], axis=0)
    R_OL = group.X_OL[:, :3] / scale
    p_FL_L = rotated((group.X_FL[:3, :3] / scale).T, group.X_FL[:3, 3])
    quaternions = [
        RotationMatrix.ProjectToRotationMatrix(R).ToQuaternion().wxyz()
        for R in product(R_OO, R_OL)
    ]
    steps = np.zeros((num_steps, 16))
    steps[:, 0:3] = scale
    steps[:, 6:9] = p_FL_L
    steps[:, 9:13] = quaternions
    steps[:, 13:16] = group.X_OL[:, 3] - rotated(R_OL, p_FL_L) + way_F
    return np.ascontiguousarray(steps, np.float32)
