"""Groups of primitives as one Embree scene."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
import ctypes
from typing import NamedTuple
import weakref

import numpy as np

from cns_drake.ray_casting import embree
from cns_drake.ray_casting.embree_motion import decompose_motion
from cns_drake.ray_casting.embree_packets import (
    BLOCK,
    Tree,
    cast_packets,
)
from cns_drake.ray_casting.embree_placing import Setters, place_instances
from cns_drake.ray_casting.embree_primitives import ALL, Primitives
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits, Rays


class _Built(NamedTuple):
    """The Embree scene of a group.

    Attributes:
        scene: the RTCScene, 0 if empty.
        owners: `Primitives.owners` of each of its geometries. A copy, which
            shares its scene, has one owner for all primitives.
    """

    scene: int
    owners: tuple[np.ndarray, ...]


class EmbreeHierarchy:
    """A bounding volume hierarchy over the primitives of groups.

    Rays are cast in packets marked as coherent, which makes a LiDAR's
    neighbouring beams cheap. Scenes are built robust, so that no ray passes
    through an edge that two triangles share.

    Attributes:
        rows: of the groups with primitives in this hierarchy.
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
            groups: all groups, placed.
            merge: makes primitives of a group; it may make none.
            num_threads: number of threads that share the rays of a cast.
            previous: a hierarchy of the same primitives, whose scenes of
                unchanged groups are reused.

        Raises:
            MemoryError: Embree cannot build it.
        """
        self._groups = groups
        self._num_threads = num_threads
        # Threads start at their first use.
        self._helpers = ThreadPoolExecutor(max(1, num_threads - 1))
        self._lib = embree.load()
        # Finding these addresses takes longer than placing ten instances.
        self._setters = Setters.of(self._lib)
        if previous is None:
            self._device = self._lib.rtcNewDevice(embree.ALONE)
        else:
            self._device = previous._device
            self._lib.rtcRetainDevice(self._device)
        self._scenes: list[int] = []
        weakref.finalize(self, _release, self._lib, self._device, self._scenes)
        known: dict[int, _Built] = {}
        copied: dict[int, _Built] = {}
        if previous is not None:
            known, copied = previous._built_of(), previous._copied()
        self._built: dict[int, _Built] = {}
        for row, group in enumerate(groups):
            built = known.get(id(group))
            if built is None and group.is_copy:
                built = copied.get(id(group.members[0][2]))
            if built is None:
                built = self._build(list(merge(group)))
                if group.is_copy:
                    copied[id(group.members[0][2])] = built
            elif built.scene:
                self._lib.rtcRetainScene(built.scene)
                self._scenes.append(built.scene)
            if group.is_copy:
                owner = np.array([group.members[0][0]], np.int32)
                built = built._replace(owners=(owner,))
            self._built[row] = built
        self.rows = [row for row, built in self._built.items() if built.scene]
        fixed = [row for row in self.rows if groups[row].is_merged_world]
        moving = [row for row in self.rows if row not in fixed]
        self._top = 0
        # Instances of groups, if they have one, and the states of these.
        self._instances = np.zeros(len(groups), np.uintp)
        self._is_disabled = np.zeros(len(groups), bool)
        self._in_motion = np.zeros(len(groups), bool)
        if moving:
            self._top = self._new_scene()
            for row in moving:
                scene = self._built[row].scene
                self._instances[row] = self._new_instance(scene)
            self.place(Placed.of(groups, moving))
        error = self._lib.rtcGetDeviceError(self._device)
        if error:
            raise MemoryError(f"Embree cannot build the scene: error {error}")
        # Rows of groups in the order of `Tree.first_primitive`.
        rows = [fixed[0] if fixed else -1, *moving]
        self._arguments = embree.IntersectArguments(
            embree.COHERENT_RAYS, embree.INVALID_ID
        )
        nothing = _Built(0, ())
        copies = {row for row, group in enumerate(groups) if group.is_copy}
        lanes, intersect = embree.native_packet(self._lib, self._device)
        self._tree = Tree(
            intersect,
            lanes,
            self._built[fixed[0]].scene if fixed else 0,
            self._top,
            ctypes.addressof(self._arguments),
            *_list_owners(
                [self._built.get(row, nothing).owners for row in rows]
            ),
            np.array([row not in copies for row in rows], np.int64),
            np.array(rows, np.int32),
        )

    def _built_of(self) -> dict[int, _Built]:
        """Returns group's `id` -> its Embree scene."""
        return {
            id(self._groups[row]): built for row, built in self._built.items()
        }

    def _copied(self) -> dict[int, _Built]:
        """Returns surface's `id` -> the Embree scene of its copies."""
        return {
            id(self._groups[row].members[0][2]): built
            for row, built in self._built.items()
            if self._groups[row].is_copy
        }

    def place(self, placed: Placed) -> None:
        """Moves groups to their places, if they are in sight."""
        for row in placed.rows[placed.in_sight & placed.moves]:
            if self._instances[row]:
                self._set_motion(row)
        has_changed = place_instances(
            self._setters,
            placed,
            self._instances,
            self._is_disabled,
            self._in_motion,
        )
        if has_changed:
            self._lib.rtcJoinCommitScene(self._top)

    def _set_motion(self, row: int) -> None:
        """Gives Embree the motion of a group during a cast."""
        steps = decompose_motion(self._groups[row])
        handle = int(self._instances[row])
        self._lib.rtcSetGeometryTimeStepCount(handle, len(steps))
        for k, step in enumerate(steps):
            self._lib.rtcSetGeometryTransformQuaternion(
                handle, k, step.ctypes.data
            )
        self._lib.rtcCommitGeometry(handle)

    def cast(
        self,
        rays: Rays,
        *,
        mask: int = ALL,
        with_normals: bool = False,
    ) -> Hits:
        """Casts rays.

        Args:
            rays: N of them.
            mask: the geometries that rays can hit.
            with_normals: whether to return normals.
        """
        num_rays = len(rays.d_Sset)
        hits = Hits.room_for(num_rays, with_normals)
        # All threads draw from one iterator, which gives each part once.
        parts = iter(_divide(num_rays, self._num_threads))

        def cast() -> None:
            for first, last in parts:
                cast_packets(self._tree, mask, rays, hits, first, last)

        num_helpers = min(self._num_threads, -(-num_rays // BLOCK)) - 1
        helpers = [self._helpers.submit(cast) for _ in range(num_helpers)]
        cast()
        for helper in helpers:
            helper.result()
        return hits

    def _new_scene(self) -> int:
        scene = self._lib.rtcNewScene(self._device)
        self._lib.rtcSetSceneFlags(scene, embree.ROBUST_SCENE)
        self._scenes.append(scene)
        return scene

    def _build(self, parts: Sequence[Primitives]) -> _Built:
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


def _divide(num_rays: int, num_threads: int) -> list[tuple[int, int]]:
    """Returns the ranges of rays that threads take, the largest first.

    Some directions meet more geometry than others: a thread that ends early
    takes another range. Ranges get shorter, so that all threads end together.
    """
    parts, first = [], 0
    while first < num_rays:
        share = (num_rays - first) // (2 * num_threads)
        size = max(share // BLOCK, 1) * BLOCK if num_threads > 1 else num_rays
        parts.append((first, min(first + size, num_rays)))
        first += size
    return parts


def _list_owners(
    scenes: Collection[Sequence[np.ndarray]],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns `Tree.first_primitive` and `Tree.owner_of_primitive`."""
    first = np.zeros((len(scenes), max(1, *map(len, scenes))), np.int64)
    owners = [np.zeros(0, np.int32)]
    count = 0
    for row, parts in enumerate(scenes):
        for k, part in enumerate(parts):
            first[row, k] = count
            owners.append(part)
            count += len(part)
    return first, np.concatenate(owners)


def _release(lib: ctypes.CDLL, device: int, scenes: Sequence[int]) -> None:
    for scene in reversed(scenes):
        lib.rtcReleaseScene(scene)
    lib.rtcReleaseDevice(device)
