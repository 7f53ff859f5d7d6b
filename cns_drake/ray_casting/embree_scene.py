"""Groups of geometry in Embree's hierarchy, and rays that are cast on it.

Embree gets triangles that contain a margin around each shape (see `proxies`),
and what a ray meets follows in double precision (see `packets`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
import ctypes
from typing import NamedTuple
import weakref

import numpy as np
from pydrake.math import RotationMatrix

from cns_drake.ray_casting import embree
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.packets import PLACE_NUMBERS, Targets, cast_on
from cns_drake.ray_casting.proxies import SHAPE_NUMBERS, Proxies, make_proxies
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Hits, Rays
from evaluation.base import compiled, product, rotated

# Least number of rays that a thread takes at once: a multiple of every packet
# size, and large enough that the call costs little.
_BLOCK = 1024
_NO_SHAPES = np.zeros((0, SHAPE_NUMBERS))


class _Built(NamedTuple):
    """What rays meet in a group.

    Attributes:
        scene: address of its RTCScene, 0 if it is empty.
        records, shapes: see `Proxies`.
    """

    scene: int
    records: np.ndarray
    shapes: np.ndarray


class EmbreeScene:
    """Casts rays on groups of geometry with Embree.

    It is a part of `cns_drake.ray_casting.ray_casting_scene.RayCastingScene`.
    Rays are cast in packets that are marked as coherent. Such packets are fast
    for neighbouring beams of a LiDAR. Embree's robust mode is on, so that no
    ray passes through an edge that two triangles share.
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
        built = [self._scene_of_group(group, before) for group in groups]
        fixed = [k for k, group in enumerate(groups) if group.is_merged_world]
        fixed = [k for k in fixed if built[k].scene]
        moving = [
            k for k, one in enumerate(built) if one.scene and k not in fixed
        ]
        self._top = self._new_scene() if moving else 0
        # Row of a group -> handle of its instance.
        self._instances = {
            k: self._new_instance(built[k].scene) for k in moving
        }
        # Rows of groups that rays cannot meet.
        self._disabled: set[int] = set()
        # Without static geometry, row 0 belongs to no group, and no ray meets
        # it.
        rows = [*(fixed or [-1]), *moving]
        self._row_of = {group: row for row, group in enumerate(rows)}
        self._targets = self._make_targets(built, rows)
        shapes = [built[row].shapes if row >= 0 else _NO_SHAPES for row in rows]
        self._near = NearShapes(
            CurvedShapes.of(
                np.concatenate(shapes),
                np.repeat(np.arange(len(rows)), [len(one) for one in shapes]),
            )
        )
        self.place(Placed.of(groups, moving))
        self._check_device()

    def place(self, placed: Placed) -> None:
        """Moves the groups in sight to their poses, and disables all others.

        The fewer groups are enabled, the faster the hierarchy is rebuilt, and
        the faster rays are cast on it.
        """
        lib = self._lib
        matrices = np.ascontiguousarray(placed.X_OLs, np.float32)
        # Lists and one address: NumPy takes long for single values.
        address, size = matrices.ctypes.data, matrices.strides[0]
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
            place = self._targets.places[self._row_of[row]]
            place[:12] = placed.X_OLs[k].ravel()
            was_moving = place[-1] != 0.0
            place[-1] = moves[k]
            if moves[k]:
                _place_motion(self._groups[row], place)
                steps = _decompose_motion(self._groups[row])
                lib.rtcSetGeometryTimeStepCount(handle, len(steps))
                for step in range(len(steps)):
                    lib.rtcSetGeometryTransformQuaternion(
                        handle, step, steps[step].ctypes.data
                    )
            else:
                if was_moving:
                    lib.rtcSetGeometryTimeStepCount(handle, 1)
                lib.rtcSetGeometryTransform(
                    handle, 0, embree.FLOAT3X4_ROW_MAJOR, address + k * size
                )
            lib.rtcCommitGeometry(handle)
        if has_changed:
            lib.rtcJoinCommitScene(self._top)

    def cast_rays(self, rays: Rays, with_normals: bool) -> Hits:
        """Casts rays on the scene; returns the hits.

        Args:
            rays: the rays.
            with_normals: whether to find normals as well.
        """
        num_rays = len(rays.d_Sset)
        hits = Hits.misses(num_rays, with_normals)
        starts_near = self._near.contain(rays, self._targets.places)
        # All threads take parts from one iterator, which yields each part once.
        parts = iter(_ray_ranges(num_rays, self._num_threads))

        def cast() -> None:
            for first, last in parts:
                cast_on(self._targets, rays, starts_near, hits, first, last)

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

    def _make_targets(
        self, built: Sequence[_Built], rows: Sequence[int]
    ) -> Targets:
        """Returns what packets are cast on.

        Args:
            built: the scene of each group; kept as long as this object.
            rows: the group of each row, -1 for none.
        """
        lanes, intersect = embree.native_packet(self._lib, self._device)
        counts = [len(group.members) for group in self._groups]
        indices = [index for g in self._groups for index, *_ in g.members]
        tables = np.zeros((len(rows), 2), np.int64)
        for table, row in zip(tables, rows, strict=True):
            if row >= 0:
                arrays = built[row].records, built[row].shapes
                table[:] = [array.ctypes.data for array in arrays]
        return Targets(
            lanes,
            intersect,
            built[rows[0]].scene if rows[0] >= 0 else 0,
            self._top,
            tables,
            np.zeros((len(rows), PLACE_NUMBERS)),
            np.array(rows, np.int32),
            np.cumsum([0, *counts])[rows],
            np.array(indices, np.int32),
        )

    def _scene_of_group(
        self, group: RayGroup, before: Mapping[tuple, _Built]
    ) -> _Built:
        """Returns the scene of a group; groups of the same shapes share it.

        Args:
            before: content of a group -> its scene in an earlier hierarchy,
                which is reused.
        """
        content = group.content()
        if content not in self._by_content:
            built = before.get(content)
            if built is None:
                proxies = make_proxies(group.members)
                built = _Built(
                    self._build_scene(proxies), proxies.records, proxies.shapes
                )
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

    def _build_scene(self, proxies: Proxies) -> int:
        """Returns the address of a scene of proxies, 0 if there are none."""
        if not len(proxies.indices):
            return 0
        scene = self._new_scene()
        handle = self._lib.rtcNewGeometry(self._device, embree.TRIANGLE)
        for slot, form, array in (
            (embree.VERTEX_BUFFER, embree.FLOAT3, proxies.corners),
            (embree.INDEX_BUFFER, embree.UINT3, proxies.indices),
        ):
            address = self._lib.rtcSetNewGeometryBuffer(
                handle, slot, 0, form, array.strides[0], len(array)
            )
            if address is None:
                raise MemoryError("Embree has no room for the scene")
            ctypes.memmove(address, array.ctypes.data, array.nbytes)
        self._lib.rtcCommitGeometry(handle)
        self._lib.rtcAttachGeometry(scene, handle)
        self._lib.rtcReleaseGeometry(handle)
        self._lib.rtcJoinCommitScene(scene)
        return scene

    def _new_instance(self, scene: int) -> int:
        handle = self._lib.rtcNewGeometry(self._device, embree.INSTANCE)
        self._lib.rtcSetGeometryInstancedScene(handle, scene)
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


def _release_scenes(
    lib: ctypes.CDLL, device: int, scenes: Sequence[int]
) -> None:
    for scene in reversed(scenes):
        lib.rtcReleaseScene(scene)
    lib.rtcReleaseDevice(device)


def _place_motion(group: RayGroup, place: np.ndarray) -> None:
    """Sets the motion in the numbers of a group's place."""
    assert group.motion is not None
    motion = group.motion
    p_FL_L = rotated(group.X_FL[:3, :3].T, group.X_FL[:3, 3])
    place[12:15] = rotated(group.X_OL[:, :3], p_FL_L)
    spans = np.array([[motion.start], [motion.duration]])
    place[15:21] = (spans * motion.w).ravel()
    place[21:27] = (spans * motion.v).ravel()


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
    R_OL = group.X_OL[:, :3]
    p_FL_L = rotated(group.X_FL[:3, :3].T, group.X_FL[:3, 3])
    quaternions = [
        RotationMatrix.ProjectToRotationMatrix(R).ToQuaternion().wxyz()
        for R in product(R_OO, R_OL)
    ]
    steps = np.zeros((num_steps, 16))
    steps[:, 0:3] = 1.0
    steps[:, 6:9] = p_FL_L
    steps[:, 9:13] = quaternions
    steps[:, 13:16] = group.X_OL[:, 3] - rotated(R_OL, p_FL_L) + way_F
    return np.ascontiguousarray(steps, np.float32)


class CurvedShapes(NamedTuple):
    """M curved shapes of groups, and balls around their polyhedra.

    Attributes:
        numbers: (M, SHAPE_NUMBERS) float64, see `proxies`.
        rows: (M,) row of the group of each shape.
        p_LGs: (M, 3) centres of the balls in the group's frame L [m].
        reaches: (M,) radii of the balls [m].
    """

    numbers: np.ndarray
    rows: np.ndarray
    p_LGs: np.ndarray
    reaches: np.ndarray

    @classmethod
    def of(cls, numbers: np.ndarray, rows: np.ndarray) -> CurvedShapes:
        """Takes the numbers and the row of each shape."""
        X_GL = numbers[:, :12].reshape(-1, 3, 4)
        axes = np.linalg.inv(X_GL[:, :, :3])
        stretch = np.sqrt((axes**2).sum(axis=1).max(axis=1, initial=0.0))
        reaches = stretch * (numbers[:, 12] + numbers[:, 15])
        return cls(
            numbers, rows, -product(axes, X_GL[:, :, 3:])[:, :, 0], reaches
        )

    def select(self, order: np.ndarray) -> CurvedShapes:
        """Returns the shapes with certain indices."""
        return CurvedShapes(*(column[order] for column in self))


class NearShapes:
    """Finds rays that may start between a curved shape and its polyhedron.

    The group of row 0 never moves, and its frame L is the scene's frame O.
    """

    def __init__(self, shapes: CurvedShapes):
        """Takes the shapes of all groups."""
        still = shapes.select(shapes.rows == 0)
        begins = still.p_LGs[:, 0] - still.reaches
        order = np.argsort(begins, kind="stable")
        self._still = still.select(order)
        self._begins = begins[order]
        # The greatest x of each ball and of all balls before it.
        self._ends = np.maximum.accumulate(
            (begins + 2.0 * still.reaches)[order]
        )
        self._moving = shapes.select(shapes.rows > 0)

    def contain(self, rays: Rays, places: np.ndarray) -> np.ndarray:
        """Returns which origins of rays, (K,) bool, lie near a shape.

        Args:
            rays: the rays.
            places: (R, PLACE_NUMBERS) where each group is, see `packets`.
        """
        p_OSset = rays.p_OSset
        result = np.zeros(len(p_OSset), bool)
        if len(self._begins):
            _mark_near(self._still, self._begins, self._ends, p_OSset, result)
        if len(self._moving.rows) and len(p_OSset):
            self._mark_moving(p_OSset, places, result)
        return result

    def _mark_moving(
        self, p_OSset: np.ndarray, places: np.ndarray, result: np.ndarray
    ) -> None:
        """Marks the origins in the balls around shapes that can move."""
        shapes = self._moving
        place = places[shapes.rows]
        X_OL = place[:, :12].reshape(-1, 3, 4)
        p_LGs = shapes.p_LGs
        centres = (
            X_OL[:, :, 3] + product(X_OL[:, :, :3], p_LGs[:, :, None])[:, :, 0]
        )
        # What the motion of F adds to the balls.
        turns, ways, arms = (
            np.abs(place[:, columns]).sum(axis=1)
            for columns in (slice(15, 21), slice(21, 27), slice(12, 15))
        )
        arms += np.abs(p_LGs).sum(axis=1)
        reaches = shapes.reaches + place[:, -1] * (ways + turns * arms)
        low, high = p_OSset.min(axis=0), p_OSset.max(axis=0)
        away = np.abs(centres - (low + high) / 2.0) - (high - low) / 2.0
        for k in np.flatnonzero((away <= reaches[:, None]).all(axis=1)):
            x, y, z = (p_OSset - centres[k]).T
            result |= x * x + y * y + z * z <= reaches[k] ** 2


@compiled
def _mark_near(
    shapes: CurvedShapes,
    begins: np.ndarray,
    ends: np.ndarray,
    p_OSset: np.ndarray,
    result: np.ndarray,
) -> None:
    """Sets `result` to True for points in the polyhedra of shapes at rest.

    Args:
        shapes: M shapes, sorted by the least x of their balls.
        begins: (M,) least x of each ball [m].
        ends: (M,) greatest x of this ball and all balls before it [m].
        p_OSset: (K, 3) points [m].
        result: (K,) bool.
    """
    for i in range(len(p_OSset)):
        p_x, p_y, p_z = p_OSset[i, 0], p_OSset[i, 1], p_OSset[i, 2]
        low, k = 0, len(begins)
        while low < k:
            middle = (low + k) // 2
            if begins[middle] <= p_x:
                low = middle + 1
            else:
                k = middle
        while k > 0 and not result[i]:
            k -= 1
            if ends[k] < p_x:
                break
            x = p_x - shapes.p_LGs[k, 0]
            y = p_y - shapes.p_LGs[k, 1]
            z = p_z - shapes.p_LGs[k, 2]
            if x * x + y * y + z * z > shapes.reaches[k] ** 2:
                continue
            x = _coordinate(shapes.numbers, k, 0, p_x, p_y, p_z)
            y = _coordinate(shapes.numbers, k, 4, p_x, p_y, p_z)
            z = abs(_coordinate(shapes.numbers, k, 8, p_x, p_y, p_z))
            # Distance to the nearest place on the axis.
            z -= shapes.numbers[k, 12]
            z = z if z > 0.0 else 0.0
            result[i] = x * x + y * y + z * z <= shapes.numbers[k, 15] ** 2


@compiled
def _coordinate(
    numbers: np.ndarray, k: int, row: int, x: float, y: float, z: float
) -> float:
    """Returns a coordinate of a point in the frame G of shape k."""
    return (
        numbers[k, row] * x
        + numbers[k, row + 1] * y
        + numbers[k, row + 2] * z
        + numbers[k, row + 3]
    )
