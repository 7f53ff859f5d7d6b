"""Groups of geometry in an Embree hierarchy, and packets of rays cast on it.

Embree works in single precision. Where a ray runs nearly in the plane of a
triangle, or the triangle is slender, Embree's hit can be metres beside the
triangle; and a ray through a vertex can pass between the triangles that share
the vertex. Such hits and misses are therefore doubted. A doubtful hit is kept
if double precision says that its point is on the triangle. Otherwise a bundle
of rays around the ray finds the triangles near the ray, and the ray meets these
in double precision.
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
from typing import NamedTuple
import weakref

import numpy as np
from pydrake.math import RotationMatrix

from cns_drake.base import compiled, product, rotated
from cns_drake.ray_casting import embree
from cns_drake.ray_casting.embree_primitives import ALL, Primitives
from cns_drake.ray_casting.moving_groups import Placed
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import CERTAIN, Hits, Rays
from cns_drake.scene import TriangleSurface

# Least number of rays that a thread takes at once: a multiple of every packet
# size, and large enough that the call costs little.
_BLOCK = 1024
_NO_TURN = np.eye(3)[None]
# Embree treats smaller direction components as positive, whatever their sign. A
# packet that mixes such rays with rays of truly positive components loses hits.
_TINY = 1e-18
# Hits on triangles are right if their ranges are wrong by less than this [m]:
# two steps of the coordinates that a LiDAR stores by default.
_TOLERANCE = 2.0**-9
# Points are on a triangle if they are at most this far away [m].
_GAP = 2.0**-11
# Typical error of a coordinate in single precision, as a share of the distances
# from which the coordinate follows. With it, the error that is expected of a
# range is less than `_TOLERANCE` only if the true error is (measured; see
# `test_doubtful_hits.py`).
_ROUNDING = 2.0**-26
# Lateral distance between rays that ask for the same hit, as a share of the
# distances from which their coordinates follow: some roundings.
_ASIDE = 2.0**-20
# These rays, in units of `_ASIDE` across the ray: it, and two rings around it.
_BUNDLE = np.array(
    [(0.0, 0.0)]
    + [
        (r * np.cos(a), r * np.sin(a))
        for r, count in ((1.0, 8), (0.4, 7))
        for a in np.linspace(0.1, 0.1 + 2.0 * np.pi, count, endpoint=False)
    ]
)
# Greatest number of surfaces that are tried for each ray of a bundle.
_MOST_LAYERS = 16
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


class _PacketScenes(NamedTuple):
    """The scenes on which packets are cast, and the owners of their primitives.

    Attributes:
        lanes: the number of rays in a packet.
        fixed: address of the RTCScene of static geometry, or 0.
        instances: address of the RTCScene of I instances, or 0.
        arguments: address of the RTCIntersectArguments.
        first_primitive: (1 + I, G) int64, the index in `owner_of_primitive` of
            the first primitive of geometry g in the fixed scene (first row) and
            in each instance.
        owner_of_primitive: (P,) int32 number of the member of the group to
            which each primitive belongs.
        groups: (1 + I,) int32 row of a group: first of the group of the fixed
            scene (-1 if there is no fixed scene), then of the group of each
            instance.
        first_member: (1 + I,) int64 index in `geometries` of each group's first
            member.
        geometries: (M,) int32 index of the geometry of each member.
        spans: (P,) float32 square of the longest edge of each triangle that
            rays hit [m^2]; 0 for all other primitives.
        R_OLs: (G, 3, 3) float64 orientation of the frame L of each group in O,
            at the start of a revolution.
        in_motion: (G,) bool, whether each group moves during the revolution.
    """

    lanes: int
    fixed: int
    instances: int
    arguments: int
    first_primitive: np.ndarray
    owner_of_primitive: np.ndarray
    groups: np.ndarray
    first_member: np.ndarray
    geometries: np.ndarray
    spans: np.ndarray
    R_OLs: np.ndarray
    in_motion: np.ndarray


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
        self._R_OLs = np.reshape([g.X_OL[:, :3] for g in groups], (-1, 3, 3))
        self._in_motion = np.zeros(len(groups), bool)
        self._has_triangles = any(b.surface is not None for b in self._built)
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
        self._R_OLs[placed.rows] = placed.X_OLs[:, :, :3]
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
                self._in_motion[row] = True
                steps = _decompose_motion(self._groups[row])
                lib.rtcSetGeometryTimeStepCount(handle, len(steps))
                for step in range(len(steps)):
                    lib.rtcSetGeometryTransformQuaternion(
                        handle, step, steps[step].ctypes.data
                    )
            else:
                if self._in_motion[row]:
                    lib.rtcSetGeometryTimeStepCount(handle, 1)
                    self._in_motion[row] = False
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
        hits = self._cast(rays, mask, with_normals)
        if self._has_triangles:
            wrong = np.concatenate(
                [
                    self._find_wrong_hits(rays, hits),
                    self._find_wrong_misses(rays, mask, hits),
                ]
            )
            if len(wrong):
                self._cast_again(rays, mask, hits, wrong)
        return hits

    def _cast(
        self,
        rays: Rays,
        mask: int,
        with_normals: bool,
        tolerance: float = _TOLERANCE,
    ) -> Hits:
        """Casts rays in single precision.

        Args:
            rays: the rays.
            mask: bits of the geometry that can be hit.
            with_normals: whether to find normals as well.
            tolerance: error of a certain hit on a triangle [m]; if it is
                negative, all hits on triangles are doubtful.
        """
        num_rays = len(rays.d_Sset)
        hits = Hits.misses(num_rays, with_normals)
        # All threads take parts from one iterator, which yields each part once.
        parts = iter(_ray_ranges(num_rays, self._num_threads))

        def cast() -> None:
            for first, last in parts:
                _cast_packets(
                    self._intersect,
                    self._packet_scenes,
                    mask,
                    rays,
                    hits,
                    first,
                    last,
                    tolerance,
                )

        num_helpers = min(self._num_threads, -(-num_rays // _BLOCK)) - 1
        helpers = [self._helpers.submit(cast) for _ in range(num_helpers)]
        cast()
        for helper in helpers:
            helper.result()
        return hits

    def _find_wrong_hits(self, rays: Rays, hits: Hits) -> np.ndarray:
        """Returns the indices of doubtful hits that double precision refutes.

        A hit is right if the ray meets the triangle at the same range, or if
        the ray passes the triangle so closely that the point is on it.
        """
        doubtful = np.flatnonzero(hits.doubt != CERTAIN)
        if not len(doubtful):
            return doubtful
        corners, _ = self._find_corners(
            hits.group[doubtful],
            hits.doubt[doubtful],
            rays.times[doubtful % len(rays.times)],
        )
        return doubtful[_are_wrong(rays, hits.ranges, doubtful, corners)]

    def _find_wrong_misses(
        self, rays: Rays, mask: int, hits: Hits
    ) -> np.ndarray:
        """Returns the indices of misses that rays on either side contradict.

        Only a miss between two successive hits on one geometry is examined (and
        the miss of a ray that is cast alone): among other rays, a ray that
        passes through a vertex is the only one.
        """
        owner = hits.owner
        rows = 1 + np.flatnonzero(
            (owner[1:-1] == -1) & (owner[:-2] == owner[2:]) & (owner[2:] != -1)
        )
        if len(owner) == 1:
            rows = np.flatnonzero(owner == -1)
        for angle in (_TURN_ASIDE, -_TURN_ASIDE):
            if len(rows):
                near = rays.select(rows, rays.max_ranges_of(rows))
                # Not parallel to the ray, but for one direction.
                aside = near.d_Sset + angle * near.d_Sset[:, [1, 2, 0]]
                beside = self._cast(near._replace(d_Sset=aside), mask, False)
                rows = rows[beside.owner != -1]
        return rows

    def _cast_again(
        self, rays: Rays, mask: int, hits: Hits, wrong: np.ndarray
    ) -> None:
        """Replaces wrong hits and misses.

        The triangles near a ray are those that rays around it hit, one behind
        the other. The ray meets these triangles in double precision, and all
        other shapes in single precision.

        Args:
            rays: all rays.
            mask: bits of the geometry that can be hit.
            hits: their hits, changed in place.
            wrong: indices of the rays to cast again.
        """
        near = rays.select(wrong, rays.max_ranges_of(wrong))
        p, d, best = near.p_OSset, near.d_Oset(), near.max_ranges.astype(float)
        times = near.times
        nothing = Hits.misses(len(wrong), bool(hits.normals.shape[1]))
        for field, none in zip(hits, nothing, strict=True):
            field[wrong] = none
        p_set, d_set = (x.reshape(-1, 3) for x in _move_aside(p, d, _BUNDLE))
        begins = np.zeros(len(p_set))
        lanes = np.arange(len(p_set))
        for _ in range(_MOST_LAYERS):
            ray = lanes // len(_BUNDLE)
            starts = p_set[lanes] + begins[lanes, None] * d_set[lanes]
            reach = best[ray] + _TOLERANCE - begins[lanes]
            found = self._cast(
                Rays(
                    starts,
                    _NO_TURN,
                    reach.astype(np.float32),
                    d_set[lanes],
                    times[ray],
                ),
                mask,
                True,
                -1.0,
            )
            is_flat = found.doubt != CERTAIN
            ranges = begins[lanes] + found.ranges
            begins[lanes] = ranges + _step_behind(starts, ranges)
            # Only the ray itself meets other shapes.
            ranges[~is_flat & (lanes % len(_BUNDLE) > 0)] = np.inf
            flat = np.flatnonzero(is_flat)
            corners, corners_L = self._find_corners(
                found.group[flat], found.doubt[flat], times[ray[flat]]
            )
            ranges[flat] = _meet_each(corners, p[ray[flat]], d[ray[flat]])
            found.normals[flat] = np.cross(
                corners_L[:, 1] - corners_L[:, 0],
                corners_L[:, 2] - corners_L[:, 0],
            )
            # The nearest last: it overwrites all others.
            order = np.argsort(-ranges, kind="stable")
            order = order[ranges[order] <= best[ray[order]]]
            to = wrong[ray[order]]
            best[ray[order]] = hits.ranges[to] = ranges[order]
            hits.owner[to] = found.owner[order]
            hits.group[to] = found.group[order]
            if hits.normals.shape[1]:
                hits.normals[to] = found.normals[order]
            lanes = lanes[is_flat & (begins[lanes] < best[ray])]
            if not len(lanes):
                break

    def _find_corners(
        self, groups: np.ndarray, triangles: np.ndarray, times: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the corners of N triangles in O, and in their own frames L.

        Args:
            groups: (N,) row of the group of each triangle.
            triangles: (N,) its number in the group.
            times: (N,) fractions of the revolution.

        Returns:
            Two arrays (N, 3, 3) [m].
        """
        corners_O = np.empty((len(groups), 3, 3))
        corners_L = np.empty((len(groups), 3, 3))
        for row in np.unique(groups):
            chosen = np.flatnonzero(groups == row)
            surface = self._built[row].surface
            assert surface is not None
            corners = surface.p_GVset[surface.triangles[triangles[chosen]]]
            corners_L[chosen] = corners
            if not self._groups[row].is_merged_world:
                X_OL = self._groups[row].X_OL_at(times[chosen])
                corners = rotated(X_OL[:, None, :, :3], corners)
                corners = corners + X_OL[:, None, :, 3]
            corners_O[chosen] = corners
        return corners_O, corners_L

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
    ) -> _PacketScenes:
        """Returns the scenes for `_cast_packets`.

        Args:
            lanes: number of rays in a packet.
            fixed: row of the group of static geometry; empty if there is none.
            moving: rows of all other groups in the hierarchy.
        """
        # Without static geometry, the first row belongs to no group. No ray
        # meets it, and the first members of group -1 are never read.
        rows = [*(fixed or [-1]), *moving]
        nothing = _Built(0, (), None)
        built = [self._built[row] if row >= 0 else nothing for row in rows]
        first_primitive, owner_of_primitive, spans = _list_primitives(built)
        counts = [len(group.members) for group in self._groups]
        indices = [index for g in self._groups for index, *_ in g.members]
        return _PacketScenes(
            lanes=lanes,
            fixed=built[0].scene,
            instances=self._top,
            arguments=ctypes.addressof(self._arguments),
            first_primitive=first_primitive,
            owner_of_primitive=owner_of_primitive,
            groups=np.array(rows, np.int32),
            first_member=np.cumsum([0, *counts])[rows],
            geometries=np.array(indices, np.int32),
            spans=spans,
            R_OLs=self._R_OLs,
            in_motion=self._in_motion,
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
            return _Built(0, (), None)
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
    tolerance: float,
) -> None:
    """Casts the rays `first` to `last` - 1, and marks doubtful hits.

    A hit on a triangle is doubtful if single precision can move it by more than
    `tolerance` [m].

    Directions are rotated here, in double precision and in a fixed order,
    because the result of a matrix library depends on the processor. The
    function is compiled, because a Python call per packet would take longer
    than its rays.
    """
    # A packet is an RTCRayHit16, or one of fewer lanes: 12 ray fields and 9 hit
    # fields (10 with room for the primitive of an instance array). It and the
    # mask of lanes are aligned to 64 bytes, as Embree's vector loads demand.
    lanes = scenes.lanes
    storage = np.zeros((12 + 10 + 1) * lanes + 16, np.float32)
    start = (-storage.ctypes.data % 64) // 4
    aligned = storage[start : start + 23 * lanes].reshape(23, lanes)
    packet = aligned[:22]
    valid = aligned[22].view(np.int32)
    packet_id = packet.view(np.uint32)
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
        packet[3] = 0.0
        packet_id[9] = mask
        packet_id[10:12] = 0
        packet_id[18:20] = embree.INVALID_ID
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
        for lane in range(count):
            ray = begin + lane
            hit = packet_id[18, lane]
            if hit == embree.INVALID_ID:
                continue
            hits.ranges[ray] = packet[8, lane]
            instance = packet_id[19, lane]
            row = 0 if instance == embree.INVALID_ID else 1 + np.int64(instance)
            primitive = np.int64(packet_id[17, lane])
            primitive += scenes.first_primitive[row, hit]
            owner = scenes.owner_of_primitive[primitive]
            if owner >= 0:
                owner = scenes.geometries[scenes.first_member[row] + owner]
            hits.owner[ray] = owner
            hits.group[ray] = scenes.groups[row]
            for axis in range(hits.normals.shape[1]):
                hits.normals[ray, axis] = packet[12 + axis, lane]
            span = scenes.spans[primitive]
            if span == 0.0:
                continue
            # The error across the ray, in a triangle that may be slender and
            # seen along its plane.
            R_OL = scenes.R_OLs[scenes.groups[row]]
            along = size = 0.0
            for axis in range(3):
                along += packet[12 + axis, lane] * (
                    R_OL[0, axis] * packet[4, lane]
                    + R_OL[1, axis] * packet[5, lane]
                    + R_OL[2, axis] * packet[6, lane]
                )
                size = max(size, abs(packet[axis, lane]))
            error = _ROUNDING * (size + packet[8, lane]) * span
            is_unsure = error > tolerance * abs(along)
            if is_unsure or scenes.in_motion[scenes.groups[row]]:
                hits.doubt[ray] = packet_id[17, lane]


@compiled
def _are_wrong(
    rays: Rays, ranges: np.ndarray, rows: np.ndarray, corners: np.ndarray
) -> np.ndarray:
    """Returns which of M hits on triangles are wrong in double precision.

    If a ray passes its triangle, its hit is right if the point is on the
    triangle all the same.

    Args:
        rays: the N rays.
        ranges: (N,) ranges at which they were found to hit [m].
        rows: (M,) indices of the rays that are examined.
        corners: (M, 3, 3) corners of the triangle that each one hit [m].
    """
    wrong = np.empty(len(rows), np.bool_)
    d, q = np.empty(3), np.empty(3)
    for k in range(len(rows)):
        row = rows[k]
        p = rays.p_OSset[row % len(rays.p_OSset)]
        R = rays.R_OSset[row % len(rays.R_OSset)]
        d_S = rays.d_Sset[row]
        for i in range(3):
            d[i] = R[i, 0] * d_S[0] + R[i, 1] * d_S[1] + R[i, 2] * d_S[2]
            q[i] = p[i] + np.float64(ranges[row]) * d[i]
        error = abs(_meet(corners[k], p, d) - ranges[row])
        if _TOLERANCE < error < np.inf:
            wrong[k] = True
        else:
            wrong[k] = error > _GAP and _distance(corners[k], q) > _GAP
    return wrong


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
def _meet_each(corners: np.ndarray, p: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Returns the ranges of N rays on a triangle each; see `_meet`."""
    ranges = np.empty(len(corners))
    for k in range(len(corners)):
        ranges[k] = _meet(corners[k], p[k], d[k])
    return ranges


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


def _move_aside(
    p: np.ndarray, d: np.ndarray, steps: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns M rays around each of N rays: origins and directions, (N, M, 3).

    Args:
        p: (N, 3) origins [m].
        d: (N, 3) unit directions.
        steps: (M, 2) steps across the ray, in units of `_ASIDE`.
    """
    axis = np.eye(3)[np.argmin(np.abs(d), axis=1)]
    u = np.cross(d, axis)
    u /= np.sqrt((u * u).sum(axis=1))[:, None]
    v = np.cross(d, u)
    way = steps[:, :1] * u[:, None] + steps[:, 1:] * v[:, None]
    size = np.abs(p).max(axis=1)[:, None, None]
    return p[:, None] + _ASIDE * size * way, d[:, None] + _ASIDE * way


def _step_behind(p: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Returns how far behind a hit a ray starts to find the next one [m]."""
    return _ASIDE * (np.abs(p).max(axis=1, initial=0.0) + ranges) + 1e-6


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
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns `first_primitive`, `owner_of_primitive`, `spans` of a scene."""
    widest = max(1, *(len(built.owners) for built in scenes))
    first = np.zeros((len(scenes), widest), np.int64)
    owners = [np.zeros(0, np.int32)]
    spans = [np.zeros(0, np.float32)]
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
            is_flat = k == 0 and built.surface is not None
            spans.append(
                _spans(built.surface)
                if is_flat
                else np.zeros(len(part), np.float32)
            )
            count += len(part)
    return first, np.concatenate(owners), np.concatenate(spans)


def _spans(surface: TriangleSurface) -> np.ndarray:
    """Returns the square of the longest edge of each triangle [m^2]."""
    spans = np.zeros(len(surface.triangles), np.float32)
    for i in range(3):
        edge = surface.p_GVset[surface.triangles[:, i]]
        edge = edge - surface.p_GVset[surface.triangles[:, i - 1]]
        np.maximum(
            spans, (edge * edge).sum(axis=1), out=spans, casting="unsafe"
        )
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
