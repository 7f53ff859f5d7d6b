"""Groups of geometry in an Embree hierarchy, and packets of rays cast on it.

Embree works in single precision. Where a ray runs nearly in the plane of a
triangle, or the triangle is slender, Embree's hit can be metres beside the
triangle; and a ray through a vertex can pass between the triangles that share
the vertex. Such hits and misses are therefore doubted. A doubtful hit is kept
if double precision says that its point is on the triangle. Otherwise the ray is
cast again, on the boxes of the triangles: Embree finds the boxes, and the ray
meets the triangles in double precision.
"""

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
import operator
from typing import NamedTuple
import weakref

from numba import carray
import numpy as np
from pydrake.math import RotationMatrix, inv

from cns_drake.base import compiled, compiled_callback, product, rotated
from cns_drake.ray_casting import embree
from cns_drake.ray_casting.embree_primitives import ALL, FLAT, Primitives
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import CERTAIN, MISSED, Hits, Rays
from cns_drake.scene import TriangleSurface

# Least number of rays that a thread takes at once: a multiple of every packet
# size, and large enough that the call costs little.
_BLOCK = 1024
# Embree treats smaller direction components as positive, whatever their sign. A
# packet that mixes such rays with rays of truly positive components loses hits.
_TINY = 1e-18
# Hits on triangles are right if their ranges are wrong by less than this [m]:
# two steps of the coordinates that a LiDAR stores by default.
_TOLERANCE = 2.0**-9
# Points are on a triangle if they are at most this far away [m].
_GAP = 2.0**-11
# A hit on a triangle is sure if the square of its longest edge, multiplied by
# the distances from which its range follows, is less than this multiple of the
# product of the ray's direction and the triangle's normal (of twice its area).
# The error of its range is then less than `_TOLERANCE` (measured; see
# `test_doubtful_hits.py`): coordinates are typically wrong by 2^-26 of
# themselves.
_SURE = np.float32(_TOLERANCE / 2.0**-26)
# A miss is doubtful if rays hit that are turned by this angle to either side of
# the ray [rad].
_TURN_ASIDE = 1e-5
# Tolerance of a hit beside an edge, in double precision, as a share of the
# triangle's size. With it, no ray passes between two triangles that share an
# edge.
_EDGE_TOLERANCE = 1e-9
# Additional tolerance for rounding, relative to the numbers that are rounded.
_ROUNDING_TOLERANCE = 1e-14
# Greatest error of a hit by rounding, as a share of the triangle's size.
_LARGEST_ERROR = 1e-3
# Margin of the boxes of triangles: more than single precision moves a ray
# within 1 km of its origin, if the origin is within 1 km of the scene's [m].
_MARGIN = 2e-3


class _Built(NamedTuple):
    """What Embree has of a group.

    Attributes:
        scene: address of the RTCScene, 0 if it is empty.
        owners: owners of the primitives of each geometry.
        surface: the triangles of the first geometry, in double precision; None
            if rays hit no triangles.
    """

    scene: int
    owners: tuple[np.ndarray, ...]
    surface: TriangleSurface | None


_EMPTY = _Built(0, (), None)


class _Tables(NamedTuple):
    """What `_PacketScenes` tells of the primitives of scenes.

    Attributes:
        scenes: the scenes.
        first_primitive, primitives, vertices, triangles: see `_PacketScenes`.
    """

    scenes: Sequence[_Built]
    first_primitive: np.ndarray
    primitives: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray

    def are_of(self, scenes: Sequence[_Built]) -> bool:
        """Returns whether the tables are those of certain scenes."""
        return len(scenes) == len(self.scenes) and all(
            map(operator.is_, scenes, self.scenes)
        )


class _Places(NamedTuple):
    """The places of G groups, in a scene's frame O.

    Attributes:
        X_OLs: (G, 3, 4) float64 maps from each group's local frame L to O at
            the start of a revolution.
        p_FLs: (G, 3) position of L in the frame F that moves, in axes of O [m].
        rotvecs: (G, 2, 3) rotation vector of F at the start of a revolution,
            and what is added during the revolution [rad].
        ways: (G, 2, 3) displacement of F, likewise [m].
        turns: (G,) float32 greatest angle by which F turns [rad].
        in_sight: (G,) bool, whether rays can meet each group.
    """

    X_OLs: np.ndarray
    p_FLs: np.ndarray
    rotvecs: np.ndarray
    ways: np.ndarray
    turns: np.ndarray
    in_sight: np.ndarray

    @classmethod
    def of(cls, groups: Sequence[RayGroup]) -> _Places:
        """Returns the places of groups at rest."""
        count = len(groups)
        return cls(
            np.reshape([group.X_OL for group in groups], (-1, 3, 4)),
            np.zeros((count, 3)),
            np.zeros((count, 2, 3)),
            np.zeros((count, 2, 3)),
            np.zeros(count, np.float32),
            np.ones(count, bool),
        )

    def place(self, row: int, group: RayGroup, is_in_motion: bool) -> None:
        """Sets the motion of the group with a given row."""
        self.rotvecs[row] = self.ways[row] = 0.0
        if is_in_motion:
            assert group.motion is not None
            motion = group.motion
            spans = np.array([[motion.start], [motion.duration]])
            self.rotvecs[row] = spans * motion.w
            self.ways[row] = spans * motion.v
            p_LF = rotated(inv(group.X_FL[:3, :3]), group.X_FL[:3, 3])
            self.p_FLs[row] = rotated(group.X_OL[:, :3], p_LF)
        self.turns[row] = np.abs(self.rotvecs[row]).sum()


class _PacketScenes(NamedTuple):
    """The scenes on which packets are cast, and the owners of their primitives.

    Attributes:
        lanes: the number of rays in a packet.
        fixed: address of the RTCScene of static geometry, or 0.
        instances: address of the RTCScene of I instances, or 0.
        arguments: address of the RTCIntersectArguments.
        first_primitive: (1 + I, G) int64, the index in `primitives` of the
            first primitive of geometry g in the fixed scene (first row) and in
            each instance.
        primitives: (P,) records of `owner`, the number of the member of the
            group to which each primitive belongs; and of `span`, the square of
            a triangle's longest edge [m^2], 0 for other shapes and proxies.
        groups: (1 + I,) int32 row of a group: first of the group of the fixed
            scene (-1 if there is no fixed scene), then of the group of each
            instance.
        first_member: (1 + I,) int64 index in `geometries` of each group's first
            member.
        geometries: (M,) int32 index of the geometry of each member.
        vertices: (V, 3) float64 vertices of the triangles that rays hit, in the
            frame L of their group [m].
        triangles: (P, 3) int32 vertices of each of these triangles.
        places: the places of G groups.
    """

    lanes: int
    fixed: int
    instances: int
    arguments: int
    first_primitive: np.ndarray
    primitives: np.ndarray
    groups: np.ndarray
    first_member: np.ndarray
    geometries: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray
    places: _Places


class _Boxes(NamedTuple):
    """The boxes of all triangles, and what their callback reads and writes.

    Attributes:
        scenes: (1 + I,) int64 address of the RTCScene of boxes of the fixed
            scene and of each instance, or 0.
        p_LRset: (lanes, 3) float64 origins of the rays of a packet [m].
        d_Lset: (lanes, 3) float64 their directions.
        best: (lanes,) float64 their greatest ranges, then the ranges of their
            hits [m].
        met: (lanes,) int64 the triangles that they meet, -1 for none.
        controls: (S, 7) int64 of each scene of boxes: the addresses of its
            triangles, of all vertices and of the four arrays above; and the
            number of vertices.
    """

    scenes: np.ndarray
    p_LRset: np.ndarray
    d_Lset: np.ndarray
    best: np.ndarray
    met: np.ndarray
    controls: np.ndarray


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
        self._in_motion: set[int] = set()
        self._places = _Places.of(groups)
        self._has_triangles = any(b.surface is not None for b in self._built)
        if moving:
            self._top = self._new_scene()
            for row in moving:
                scene = self._built[row].scene
                self._instances[row] = self._new_instance(scene)
            self.place(Placed.of(groups, moving))
        self._check_device()
        self._coherent, self._scattered = (
            embree.IntersectArguments(flags, embree.INVALID_ID)
            for flags in (embree.COHERENT_RAYS, 0)
        )
        lanes, self._intersect = embree.native_packet(self._lib, self._device)
        self._packet_scenes = self._make_packet_scenes(
            lanes, fixed, moving, previous
        )
        # Few rays in all directions: each for itself.
        self._scattered_scenes = self._packet_scenes._replace(
            arguments=ctypes.addressof(self._scattered)
        )
        self._boxes: _Boxes | None = None

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
        self._places.X_OLs[placed.rows] = placed.X_OLs
        self._places.in_sight[placed.rows] = placed.in_sight
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
                self._places.place(row, self._groups[row], True)
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
                    self._places.place(row, self._groups[row], False)
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
        doubt_all: bool = False,
    ) -> Hits:
        """Casts rays on the geometry; returns the hits.

        Args:
            rays: the rays.
            mask: bits of the geometry that can be hit, such as `SOLID`.
            with_normals: whether to find normals as well.
            doubt_all: whether to meet all triangles in double precision, not
                only where single precision is doubtful.
        """
        hits = self._cast(self._packet_scenes, rays, mask, with_normals)
        if self._has_triangles:
            if doubt_all:
                wrong = np.arange(len(hits.owner))
            else:
                wrong = np.flatnonzero(hits.doubt != CERTAIN)
            if len(wrong) and not doubt_all:
                wrong = _keep_wrong(
                    self._intersect,
                    self._scattered_scenes,
                    mask,
                    rays,
                    hits,
                    wrong,
                )
            if len(wrong):
                self._cast_again(rays, mask, hits, wrong)
        return hits

    def _cast(
        self, scenes: _PacketScenes, rays: Rays, mask: int, with_normals: bool
    ) -> Hits:
        """Casts rays in single precision, and marks doubtful hits.

        Args:
            scenes: the scenes, for coherent or for scattered rays.
            rays: the rays.
            mask: bits of the geometry that can be hit.
            with_normals: whether to find normals as well.
        """
        num_rays = len(rays.d_Sset)
        hits = Hits.misses(num_rays, with_normals)
        # All threads take parts from one iterator, which yields each part once.
        ranges = _ray_ranges(num_rays, self._num_threads)
        parts = iter(ranges)

        def cast() -> None:
            for first, last in parts:
                _cast_packets(
                    self._intersect,
                    scenes,
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
        for first, _ in ranges[1:]:
            _doubt_lone_misses(hits, first - 2, first + 2)
        return hits

    def _cast_again(
        self, rays: Rays, mask: int, hits: Hits, wrong: np.ndarray
    ) -> None:
        """Replaces hits and misses: triangles are met in double precision.

        Args:
            rays: all rays.
            mask: bits of the geometry that can be hit.
            hits: their hits, changed in place.
            wrong: indices of the rays to cast again.
        """
        near = rays.select(wrong, rays.max_ranges_of(wrong))
        others = self._cast(
            self._scattered_scenes,
            near,
            mask & ~FLAT,
            bool(hits.normals.shape[1]),
        )
        if self._boxes is None:
            self._boxes = self._make_boxes()
        _cast_on_boxes(
            self._intersect, self._scattered_scenes, self._boxes, near, others
        )
        for field, other in zip(hits, others, strict=True):
            field[wrong] = other

    def _make_boxes(self) -> _Boxes:
        """Builds the boxes of the triangles of all groups."""
        scenes = self._packet_scenes
        flat = [
            (row, self._built[group])
            for row, group in enumerate(scenes.groups.tolist())
            if group >= 0 and self._built[group].surface is not None
        ]
        lanes = scenes.lanes
        boxes = _Boxes(
            np.zeros(len(scenes.groups), np.int64),
            np.zeros((lanes, 3)),
            np.zeros((lanes, 3)),
            np.zeros(lanes),
            np.zeros(lanes, np.int64),
            np.zeros((len(flat), 7), np.int64),
        )
        known: dict[int, int] = {}
        for control, (row, built) in zip(boxes.controls, flat, strict=True):
            if built.scene not in known:
                assert built.surface is not None
                first = scenes.first_primitive[row, 0]
                arrays = (
                    scenes.triangles[first:],
                    scenes.vertices,
                    boxes.p_LRset,
                    boxes.d_Lset,
                    boxes.best,
                    boxes.met,
                )
                control[:6] = [array.ctypes.data for array in arrays]
                control[6] = len(scenes.vertices)
                known[built.scene] = self._build_boxes(
                    control.ctypes.data, len(built.surface.triangles)
                )
            boxes.scenes[row] = known[built.scene]
        self._check_device()
        return boxes

    def _build_boxes(self, control: int, count: int) -> int:
        """Returns the address of a scene of `count` boxes of triangles."""
        lib = self._lib
        handle = lib.rtcNewGeometry(self._device, embree.USER)
        lib.rtcSetGeometryUserPrimitiveCount(handle, count)
        lib.rtcSetGeometryUserData(handle, control)
        lib.rtcSetGeometryBoundsFunction(
            handle, compiled_callback(_bound_triangle), None
        )
        lib.rtcSetGeometryIntersectFunction(
            handle, compiled_callback(_meet_triangle)
        )
        lib.rtcSetGeometryMask(handle, ALL)
        lib.rtcCommitGeometry(handle)
        scene = self._new_scene()
        # A scan casts a few rays on the boxes.
        lib.rtcSetSceneBuildQuality(scene, embree.LOW_QUALITY)
        lib.rtcAttachGeometry(scene, handle)
        lib.rtcReleaseGeometry(handle)
        lib.rtcJoinCommitScene(scene)
        return scene

    def _check_device(self) -> None:
        """Raises an error if a call of Embree has failed."""
        error = self._lib.rtcGetDeviceError(self._device)
        if error:
            fault = f"Embree cannot build the scene: error {error}"
            if error == embree.OUT_OF_MEMORY:
                raise MemoryError(fault)
            raise RuntimeError(fault)

    def _make_packet_scenes(
        self,
        lanes: int,
        fixed: Sequence[int],
        moving: Sequence[int],
        previous: EmbreeHierarchy | None,
    ) -> _PacketScenes:
        """Returns the scenes for `_cast_packets`.

        Args:
            lanes: number of rays in a packet.
            fixed: row of the group of static geometry; empty if there is none.
            moving: rows of all other groups in the hierarchy.
            previous: hierarchy whose tables are taken if it has these groups.
        """
        # Without static geometry, the first row belongs to no group. No ray
        # meets it, and the first members of group -1 are never read.
        rows = [*(fixed or [-1]), *moving]
        built = [self._built[row] if row >= 0 else _EMPTY for row in rows]
        tables = None if previous is None else previous._tables
        if tables is None or not tables.are_of(built):
            tables = _Tables(
                built, *_list_primitives(built), *_list_triangles(built)
            )
        self._tables: _Tables = tables
        counts = [len(group.members) for group in self._groups]
        indices = [index for g in self._groups for index, *_ in g.members]
        return _PacketScenes(
            lanes=lanes,
            fixed=built[0].scene,
            instances=self._top,
            arguments=ctypes.addressof(self._coherent),
            first_primitive=tables.first_primitive,
            primitives=tables.primitives,
            groups=np.array(rows, np.int32),
            first_member=np.cumsum([0, *counts])[rows],
            geometries=np.array(indices, np.int32),
            vertices=tables.vertices,
            triangles=tables.triangles,
            places=self._places,
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
            return _EMPTY
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
        owners = tuple(part.owners for part in parts)
        return _Built(scene, owners, parts[0].surface)

    def _new_instance(self, scene: int) -> int:
        handle = self._lib.rtcNewGeometry(self._device, embree.INSTANCE)
        self._lib.rtcSetGeometryInstancedScene(handle, scene)
        self._lib.rtcSetGeometryMask(handle, ALL)
        self._lib.rtcAttachGeometry(self._top, handle)
        self._lib.rtcReleaseGeometry(handle)  # The scene owns it.
        return handle


@compiled
def _cast_packets(
    intersect: embree.PacketFunction,
    scenes: _PacketScenes,
    mask: int,
    rays: Rays,
    hits: Hits,
    first: int,
    last: int,
) -> None:
    """Casts the rays `first` to `last` - 1, and marks doubtful hits and misses.

    A hit on a triangle is doubtful if single precision can move it by more than
    `_TOLERANCE`. A miss is doubtful between two hits on one geometry: of the
    rays of a scan, a ray through a vertex of a mesh is the only one.

    Directions are rotated here, in double precision and in a fixed order,
    because the result of a matrix library depends on the processor. The
    function is compiled, because a Python call per packet would take longer
    than its rays.
    """
    lanes = scenes.lanes
    packet, valid = _new_packet(lanes)
    packet_id = packet.view(np.uint32)
    along_normal = np.empty(lanes, np.float32)
    # The error of a hit grows with the coordinates from which it follows.
    size = np.float32(np.abs(rays.p_OSset).max())
    # The last geometry that was hit, and the misses since.
    last_owner, num_missed = np.int32(-1), 0
    num_origins, num_rotations = len(rays.p_OSset), len(rays.R_OSset)
    num_ranges = len(rays.max_ranges)
    # Indices are incremented: remainders would take a tenth of the casting
    # time.
    origin, rotation = first % num_origins, first % num_rotations
    reach = first % num_ranges
    time = first % len(rays.times)
    for begin in range(first, last, lanes):
        count = min(lanes, last - begin)
        valid[:] = 0
        for lane in range(count):
            p = rays.p_OSset[origin]
            R = rays.R_OSset[rotation]
            d = rays.d_Sset[begin + lane]
            valid[lane] = -1
            for axis in range(3):
                packet[axis, lane] = p[axis]
                along = (
                    R[axis, 0] * d[0] + R[axis, 1] * d[1] + R[axis, 2] * d[2]
                )
                packet[4 + axis, lane] = along if abs(along) >= _TINY else 0.0
            packet[7, lane] = rays.times[time]
            packet[8, lane] = rays.max_ranges[reach]
            origin = origin + 1 if origin + 1 < num_origins else 0
            rotation = rotation + 1 if rotation + 1 < num_rotations else 0
            reach = reach + 1 if reach + 1 < num_ranges else 0
            time = time + 1 if time + 1 < len(rays.times) else 0
        _prepare(packet_id, mask)
        # Two calls are faster than one scene of two levels: the second call
        # keeps a hit unless it finds a nearer one.
        for scene in (scenes.fixed, scenes.instances):
            if scene != 0:
                intersect(
                    valid.ctypes.data,
                    scene,
                    packet.ctypes.data,
                    scenes.arguments,
                )
        # In lanes, because the compiler makes few instructions of it.
        for lane in range(lanes):
            along_normal[lane] = abs(
                packet[4, lane] * packet[12, lane]
                + packet[5, lane] * packet[13, lane]
                + packet[6, lane] * packet[14, lane]
            )
        for lane in range(count):
            ray = begin + lane
            hit = packet_id[18, lane]
            if hit == embree.INVALID_ID:
                num_missed += 1
                continue
            hits.ranges[ray] = packet[8, lane]
            instance = packet_id[19, lane]
            row = 0 if instance == embree.INVALID_ID else 1 + np.int64(instance)
            primitive = np.int64(packet_id[17, lane])
            primitive += scenes.first_primitive[row, hit]
            owner = scenes.primitives[primitive].owner
            if owner >= 0:
                owner = scenes.geometries[scenes.first_member[row] + owner]
            group = scenes.groups[row]
            hits.owner[ray] = owner
            hits.group[ray] = group
            for axis in range(hits.normals.shape[1]):
                hits.normals[ray, axis] = packet[12 + axis, lane]
            if num_missed == 1 and owner == last_owner and owner >= 0:
                hits.doubt[ray - 1] = MISSED
            last_owner, num_missed = owner, 0
            # The error along the ray, on a triangle that may be slender and
            # seen along its plane.
            error = (size + packet[8, lane]) * scenes.primitives[primitive].span
            if row == 0:
                towards = along_normal[lane]
            elif error > 0.0:
                towards = _along_moved_normal(
                    scenes.places, group, packet, lane
                )
            else:
                continue
            if error > _SURE * towards:
                hits.doubt[ray] = primitive


@compiled
def _along_moved_normal(
    places: _Places, group: int, packet: np.ndarray, lane: int
) -> np.float32:
    """Returns a lower limit of how far a ray's direction points to the surface.

    That is the size of the product of the direction and the normal, wherever
    the group is during the revolution.
    """
    X_OL = places.X_OLs[group]
    towards = length = np.float32(0.0)
    for axis in range(3):
        length += abs(packet[12 + axis, lane])
        for other in range(3):
            towards += (
                packet[12 + axis, lane]
                * packet[4 + other, lane]
                * X_OL[other, axis]
            )
    return np.float32(abs(towards) - places.turns[group] * length)


@compiled
def _doubt_lone_misses(hits: Hits, first: int, last: int) -> None:
    """Marks misses between two hits on one geometry; see `_cast_packets`.

    Args:
        hits: all hits.
        first: the first hit that is considered.
        last: the one after the last hit.
    """
    owner = hits.owner
    for ray in range(max(first, 0) + 1, min(last, len(owner)) - 1):
        if owner[ray] == -1 and owner[ray - 1] == owner[ray + 1] >= 0:
            hits.doubt[ray] = MISSED


@compiled
def _keep_wrong(
    intersect: embree.PacketFunction,
    scenes: _PacketScenes,
    mask: int,
    rays: Rays,
    hits: Hits,
    doubtful: np.ndarray,
) -> np.ndarray:
    """Returns which doubtful hits and misses are wrong.

    A hit is wrong if double precision refutes it, and a miss is wrong if rays
    turned to either side of the ray hit.

    Args:
        intersect: Embree's function.
        scenes: the scenes, for scattered rays.
        mask: bits of the geometry that can be hit.
        rays: all rays.
        hits: their hits.
        doubtful: (M,) indices of the doubtful hits and misses.
    """
    packet, valid = _new_packet(scenes.lanes)
    packet_id = packet.view(np.uint32)
    kept = np.empty(len(doubtful), np.bool_)
    aside, d = np.empty(3), np.empty(3)
    for k in range(len(doubtful)):
        ray = doubtful[k]
        if hits.doubt[ray] != MISSED:
            kept[k] = _is_wrong(scenes, rays, ray, hits)
            continue
        R = rays.R_OSset[ray % len(rays.R_OSset)]
        for side in range(2):
            angle = _TURN_ASIDE if side == 0 else -_TURN_ASIDE
            for i in range(3):
                # Not parallel to the ray, but for one direction.
                aside[i] = (
                    rays.d_Sset[ray, i] + angle * rays.d_Sset[ray, (i + 1) % 3]
                )
            _rotate(R, aside, d)
            _load_ray(
                packet,
                side,
                rays.p_OSset[ray % len(rays.p_OSset)],
                d,
                rays.times[ray % len(rays.times)],
                rays.max_ranges[ray % len(rays.max_ranges)],
            )
            valid[side] = -1
        _prepare(packet_id, mask)
        for scene in (scenes.fixed, scenes.instances):
            if scene != 0:
                intersect(
                    valid.ctypes.data,
                    scene,
                    packet.ctypes.data,
                    scenes.arguments,
                )
        kept[k] = (
            packet_id[18, 0] != embree.INVALID_ID
            and packet_id[18, 1] != embree.INVALID_ID
        )
    return doubtful[kept]


@compiled
def _new_packet(lanes: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a packet, and the mask of its lanes, all inactive.

    A packet is an RTCRayHit16, or one of fewer lanes: 12 ray fields and 9 hit
    fields (10 with room for the primitive of an instance array). It and the
    mask of lanes are aligned to 64 bytes, as Embree's vector loads demand.
    """
    storage = np.zeros((12 + 10 + 1) * lanes + 16, np.float32)
    start = (-storage.ctypes.data % 64) // 4
    aligned = storage[start : start + 23 * lanes].reshape(23, lanes)
    return aligned[:22], aligned[22].view(np.int32)


@compiled
def _rotate(R: np.ndarray, v: np.ndarray, rotated_v: np.ndarray) -> None:
    """Sets `rotated_v` to R v."""
    for i in range(3):
        rotated_v[i] = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]


@compiled
def _load_ray(
    packet: np.ndarray,
    lane: int,
    p: np.ndarray,
    d: np.ndarray,
    time: float,
    reach: float,
) -> None:
    """Sets a ray of a packet."""
    for axis in range(3):
        packet[axis, lane] = p[axis]
        packet[4 + axis, lane] = d[axis] if abs(d[axis]) >= _TINY else 0.0
    packet[7, lane] = time
    packet[8, lane] = reach


@compiled
def _prepare(packet_id: np.ndarray, mask: int) -> None:
    """Sets what the rays of a packet share; it hits nothing yet.

    Args:
        packet_id: the packet as numbers, uint32.
        mask: bits of the geometry that can be hit.
    """
    packet_id[3] = 0
    packet_id[9] = mask
    packet_id[10:12] = 0
    packet_id[18:20] = embree.INVALID_ID


@compiled
def _pose_at(places: _Places, group: int, time: float, X: np.ndarray) -> None:
    """Sets X (3, 4) to the map from a group's frame L to O at a time.

    The time is a fraction of the revolution; see `RayGroup.X_OL_at`.
    """
    X_OL = places.X_OLs[group]
    rotvecs, ways = places.rotvecs[group], places.ways[group]
    r, p = np.empty(3), np.empty(3)
    angle = 0.0
    for i in range(3):
        r[i] = rotvecs[0, i] + time * rotvecs[1, i]
        angle += r[i] * r[i]
        p[i] = ways[0, i] + time * ways[1, i]
    angle = np.sqrt(angle)
    # Rodrigues' formula.
    along = np.sin(angle) / angle if angle > 0.0 else 1.0
    half = np.sin(angle / 2.0) / angle if angle > 0.0 else 0.5
    across = 2.0 * half * half
    for column in range(4):
        v = X_OL[:, column] if column < 3 else places.p_FLs[group]
        inner = r[0] * v[0] + r[1] * v[1] + r[2] * v[2]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            turned = along * (r[j] * v[k] - r[k] * v[j])
            turned += across * (r[i] * inner - angle * angle * v[i])
            X[i, column] = X_OL[i, column] + turned
            if column == 3:
                X[i, 3] += p[i]


@compiled
def _is_wrong(scenes: _PacketScenes, rays: Rays, ray: int, hits: Hits) -> bool:
    """Returns whether a doubtful hit on a triangle is wrong.

    If the ray passes the triangle, the hit is right if the point is on the
    triangle all the same.
    """
    X = np.empty((3, 4))
    c, d, q = np.empty((3, 3)), np.empty(3), np.empty(3)
    time = np.float64(rays.times[ray % len(rays.times)])
    distance = np.float64(hits.ranges[ray])
    _pose_at(scenes.places, hits.group[ray], time, X)
    p = rays.p_OSset[ray % len(rays.p_OSset)]
    R = rays.R_OSset[ray % len(rays.R_OSset)]
    d_S = rays.d_Sset[ray]
    for i in range(3):
        d[i] = R[i, 0] * d_S[0] + R[i, 1] * d_S[1] + R[i, 2] * d_S[2]
        q[i] = p[i] + distance * d[i]
    for corner in range(3):
        v = scenes.vertices[scenes.triangles[hits.doubt[ray], corner]]
        for i in range(3):
            c[corner, i] = (
                X[i, 0] * v[0] + X[i, 1] * v[1] + X[i, 2] * v[2] + X[i, 3]
            )
    error = abs(_meet(c, p, d) - distance)
    if _TOLERANCE < error < np.inf:
        return True
    return bool(error > _GAP and _distance(c, q) > _GAP)


@compiled
def _cast_on_boxes(
    intersect: embree.PacketFunction,
    scenes: _PacketScenes,
    boxes: _Boxes,
    rays: Rays,
    hits: Hits,
) -> None:
    """Casts N rays on triangles in double precision.

    Args:
        intersect: Embree's function.
        scenes: the scenes.
        boxes: the boxes of their triangles.
        rays: the rays, each with an origin, an orientation, a maximum range and
            a time of its own.
        hits: their hits on other shapes, changed in place.
    """
    lanes = scenes.lanes
    packet, valid = _new_packet(lanes)
    packet_id = packet.view(np.uint32)
    X, d = np.empty((3, 4)), np.empty(3)
    for row in range(len(boxes.scenes)):
        group = scenes.groups[row]
        if boxes.scenes[row] == 0 or not scenes.places.in_sight[group]:
            continue
        first_primitive = scenes.first_primitive[row, 0]
        for begin in range(0, len(rays.d_Sset), lanes):
            count = min(lanes, len(rays.d_Sset) - begin)
            valid[:] = 0
            for lane in range(count):
                ray = begin + lane
                _pose_at(scenes.places, group, rays.times[ray], X)
                _rotate(rays.R_OSset[ray], rays.d_Sset[ray], d)
                p = rays.p_OSset[ray]
                p_L, d_L = boxes.p_LRset[lane], boxes.d_Lset[lane]
                for i in range(3):
                    p_L[i] = d_L[i] = 0.0
                    # The inverse of a rotation is its transpose.
                    for j in range(3):
                        p_L[i] += X[j, i] * (p[j] - X[j, 3])
                        d_L[i] += X[j, i] * d[j]
                limit = min(hits.ranges[ray], rays.max_ranges[ray])
                boxes.best[lane], boxes.met[lane] = limit, -1
                _load_ray(packet, lane, p_L, d_L, 0.0, limit)
                valid[lane] = -1
            _prepare(packet_id, ALL)
            for lane in range(count):
                packet_id[10, lane] = lane
            intersect(
                valid.ctypes.data,
                boxes.scenes[row],
                packet.ctypes.data,
                scenes.arguments,
            )
            for lane in range(count):
                if boxes.met[lane] < 0:
                    continue
                ray = begin + lane
                primitive = first_primitive + boxes.met[lane]
                member = scenes.primitives[primitive].owner
                member += scenes.first_member[row]
                hits.ranges[ray] = boxes.best[lane]
                hits.owner[ray] = scenes.geometries[member]
                hits.group[ray] = group
                if hits.normals.shape[1] == 0:
                    continue
                corners = scenes.triangles[primitive]
                a, b, c = (
                    scenes.vertices[corners[0]],
                    scenes.vertices[corners[1]],
                    scenes.vertices[corners[2]],
                )
                for i in range(3):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    hits.normals[ray, i] = (b[j] - a[j]) * (c[k] - a[k]) - (
                        b[k] - a[k]
                    ) * (c[j] - a[j])


# Callbacks of Embree, for the boxes of triangles. Their argument is a struct of
# numbers of 8 bytes.


def _bound_triangle(arguments: object) -> None:
    """Sets a triangle's bounds (RTCBoundsFunctionArguments)."""
    words = carray(arguments, 3, np.int64)
    control = embree.array_at(words[0], 7, np.int64)
    primitive = words[1] & 0xFFFFFFFF
    corners = embree.array_at(control[0] + 12 * primitive, 3, np.int32)
    vertices = embree.array_at(control[1], (control[6], 3), np.float64)
    bounds = embree.array_at(words[2], 8, np.float32)
    for i in range(3):
        a, b, c = (
            vertices[corners[0], i],
            vertices[corners[1], i],
            vertices[corners[2], i],
        )
        bounds[i] = min(a, b, c) - _MARGIN
        bounds[4 + i] = max(a, b, c) + _MARGIN


def _meet_triangle(arguments: object) -> None:
    """Casts a packet on a triangle (RTCIntersectFunctionNArguments)."""
    words = carray(arguments, 6, np.int64)
    control = embree.array_at(words[1], 7, np.int64)
    primitive = words[2] & 0xFFFFFFFF
    lanes = words[5] & 0xFFFFFFFF
    valid = embree.array_at(words[0], lanes, np.int32)
    packet = embree.array_at(words[4], (12, lanes), np.float32)
    packet_id = embree.array_at(words[4], (12, lanes), np.uint32)
    corners = embree.array_at(control[0] + 12 * primitive, 3, np.int32)
    vertices = embree.array_at(control[1], (control[6], 3), np.float64)
    c = np.empty((3, 3))
    for corner in range(3):
        for i in range(3):
            c[corner, i] = vertices[corners[corner], i]
    for lane in range(lanes):
        if valid[lane] == 0:
            continue
        ray = np.int64(packet_id[10, lane])
        p = embree.array_at(control[2] + 24 * ray, 3, np.float64)
        d = embree.array_at(control[3] + 24 * ray, 3, np.float64)
        best = embree.array_at(control[4] + 8 * ray, 1, np.float64)
        met = embree.array_at(control[5] + 8 * ray, 1, np.int64)
        distance = _meet(c, p, d)
        # Of triangles at the same range, the first, in whatever order they are
        # tried.
        if distance < best[0] or (
            distance == best[0] and not 0 <= met[0] < primitive
        ):
            best[0], met[0] = distance, primitive
            # A little farther, because it is rounded.
            packet[8, lane] = distance * (1.0 + 1e-6)


@compiled
def _meet(c: np.ndarray, p: np.ndarray, d: np.ndarray) -> float:
    """Returns the range at which a ray meets a triangle; inf for a miss [m].

    After Moeller and Trumbore (1997), with a tolerance at edges.

    Args:
        c: (3, 3) corners of the triangle [m].
        p: (3,) origin [m].
        d: (3,) unit direction.
    """
    a, b, s, n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    longest = far = det = 0.0
    for i in range(3):
        a[i], b[i], s[i] = c[1, i] - c[0, i], c[2, i] - c[0, i], p[i] - c[0, i]
        longest += abs(a[i]) + abs(b[i])
        far += abs(s[i])
    for i in range(3):
        j, m = (i + 1) % 3, (i + 2) % 3
        n[i] = a[j] * b[m] - a[m] * b[j]
        det -= n[i] * d[i]
    rounding = _ROUNDING_TOLERANCE * longest * far
    # In the plane of the triangle, as far as numbers tell: the ray meets the
    # edge of a neighbour instead.
    if rounding >= _LARGEST_ERROR * abs(det):
        return np.inf
    u = v = 0.0
    for i in range(3):
        j, m = (i + 1) % 3, (i + 2) % 3
        across = s[j] * d[m] - s[m] * d[j]
        u += b[i] * across
        v -= a[i] * across
    slack = _EDGE_TOLERANCE * abs(det) + rounding
    if det < 0.0:
        u, v = -u, -v
    if min(u, v, abs(det) - u - v) < -slack:
        return np.inf
    distance = (n[0] * s[0] + n[1] * s[1] + n[2] * s[2]) / det
    return distance if distance > 0.0 else np.inf


@compiled
def _distance(c: np.ndarray, q: np.ndarray) -> float:
    """Returns the distance of a point q (3,) from a triangle [m].

    Args:
        c: (3, 3) corners of the triangle [m].
        q: (3,) the point [m].
    """
    nearest = height = np.inf
    is_inside = True
    n = np.cross(c[1] - c[0], c[2] - c[0])
    square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    for k in range(3):
        edge, away = c[(k + 1) % 3] - c[k], q - c[k]
        side = np.cross(edge, away)
        over = length = inward = 0.0
        for i in range(3):
            inward += side[i] * n[i]
            over += edge[i] * away[i]
            length += edge[i] * edge[i]
        is_inside = is_inside and inward >= 0.0
        part = min(max(over / length, 0.0), 1.0) if length > 0.0 else 0.0
        gap = away - part * edge
        gap_square = gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]
        nearest = min(nearest, np.sqrt(gap_square))
        height = abs(away[0] * n[0] + away[1] * n[1] + away[2] * n[2])
    if is_inside and square > 0.0:
        return height / np.sqrt(square)
    return nearest


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


def _list_primitives(
    scenes: Collection[_Built],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns `first_primitive` and `primitives` of a scene."""
    widest = max(1, *(len(built.owners) for built in scenes))
    first = np.zeros((len(scenes), widest), np.int64)
    kind = np.dtype([("owner", np.int32), ("span", np.float32)])
    records = [np.zeros(0, kind)]
    count = 0
    known: dict[int, int] = {}
    for row, built in enumerate(scenes):
        same = known.setdefault(built.scene, row)
        if same < row:
            first[row] = first[same]
            continue
        for k, owners in enumerate(built.owners):
            first[row, k] = count
            part = np.zeros(len(owners), kind)
            part["owner"] = owners
            if k == 0 and built.surface is not None:
                part["span"] = _spans(built.surface)
            records.append(part)
            count += len(part)
    return first, np.concatenate(records)


def _list_triangles(
    scenes: Collection[_Built],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns `vertices` and `triangles` of a scene."""
    vertices, triangles = [np.zeros((0, 3))], [np.zeros((0, 3), np.int32)]
    count = 0
    for built in {built.scene: built for built in scenes}.values():
        for k, owners in enumerate(built.owners):
            part = np.zeros((len(owners), 3), np.int32)
            if k == 0 and built.surface is not None:
                part[:] = built.surface.triangles + count
                vertices.append(built.surface.p_GVset)
                count += len(built.surface.p_GVset)
            triangles.append(part)
    return np.concatenate(vertices), np.concatenate(triangles)


def _spans(surface: TriangleSurface) -> np.ndarray:
    """Returns the square of the longest edge of each triangle [m^2]."""
    corners = [surface.p_GVset[column] for column in surface.triangles.T]
    spans = np.zeros(len(surface.triangles), np.float32)
    for i in range(3):
        # The sum over an axis of three takes four times as long.
        x, y, z = (corners[i] - corners[i - 1]).T
        np.maximum(spans, x * x + y * y + z * z, out=spans, casting="unsafe")
    return spans


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
