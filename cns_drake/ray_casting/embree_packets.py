"""Rays through Embree in packets.

numba compiles the loop that fills the packets: one Python call per packet would
cost more than its rays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from numba import types
from numba.extending import intrinsic
import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.embree import INVALID_ID
from cns_drake.ray_casting.foreign_calls import POINTER, void_call

if TYPE_CHECKING:
    from cns_drake.ray_casting.rays import Hits, Rays


class Tree(NamedTuple):
    """Scenes of Embree's, with the owners of their primitives.

    Attributes:
        intersect: address of the C function that casts a packet.
        lanes: the number of rays in a packet.
        fixed: address of the RTCScene of static geometry, or 0.
        instances: address of the RTCScene of I instances, or 0.
        arguments: address of the RTCIntersectArguments.
        first_primitive: (1 + I, G) int64, the index in `owner_of_primitive` of
            the first primitive of geometry g in the fixed scene (first row) and
            in each instance.
        owner_of_primitive: (P,) int32.
        steps: (1 + I,) int64, from one primitive to the next in
            `owner_of_primitive`: 1, or 0 where all have the same owner.
        groups: (1 + I,) int32 row of the group of the fixed scene and of each
            instance.
    """

    intersect: int
    lanes: int
    fixed: int
    instances: int
    arguments: int
    first_primitive: np.ndarray
    owner_of_primitive: np.ndarray
    steps: np.ndarray
    groups: np.ndarray


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_intersect(
    typing_context: Any,
    function: types.Type,
    valid: types.Type,
    scene: types.Type,
    rays: types.Type,
    arguments: types.Type,
) -> tuple[Any, Callable[..., Any]]:
    """Calls rtcIntersect4, rtcIntersect8 or rtcIntersect16."""
    signature = types.void(function, valid, scene, rays, arguments)
    return signature, void_call(POINTER, POINTER, POINTER, POINTER)


# Embree takes smaller components for positive, of either sign. A packet that
# mixes such rays with truly positive ones loses hits.
_TINY = 1e-18
# The least rays that a thread takes at once: whole packets of any size, and
# enough that the call costs little.
BLOCK = 1024


@compiled
def cast_packets(
    tree: Tree, mask: int, rays: Rays, hits: Hits, first: int, last: int
) -> None:
    """Casts the rays from `first` to before `last`.

    Directions are rotated here, in double precision and in a fixed order: the
    result of a matrix library depends on the processor.

    Args:
        tree: a `Tree`.
        mask: the geometries that rays can hit.
        rays: `Rays`.
        hits: `Hits` to fill.
        first, last: select the rays.
    """
    # A packet is an RTCRayHit16, or one of fewer lanes: 12 ray fields and 9 hit
    # fields (10 with room for the primitive of an instance array). It and the
    # mask of lanes are aligned to 64 bytes, as Embree's vector loads demand.
    lanes = tree.lanes
    storage = np.zeros((12 + 10 + 1) * lanes + 16, np.float32)
    start = (-storage.ctypes.data % 64) // 4
    aligned = storage[start : start + 23 * lanes].reshape(23, lanes)
    packet, valid = aligned[:22], aligned[22].view(np.int32)
    packet_id = packet.view(np.uint32)
    num_origins, num_rotations = len(rays.p_OSset), len(rays.R_OSset)
    num_ranges = len(rays.max_ranges)
    # Indices are counted along: remainders would cost a tenth of the casting.
    origin, rotation = first % num_origins, first % num_rotations
    reach, time = first % num_ranges, first % len(rays.times)
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
        packet_id[18:20] = INVALID_ID
        # Two calls are faster than one scene of two levels: the second call
        # keeps a hit unless it finds a nearer one.
        for scene in (tree.fixed, tree.instances):
            if scene != 0:
                _call_intersect(
                    tree.intersect,
                    valid.ctypes.data,
                    scene,
                    packet.ctypes.data,
                    tree.arguments,
                )
        for lane in range(count):
            ray = begin + lane
            hit = packet_id[18, lane]
            if hit == INVALID_ID:
                hits.ranges[ray] = np.inf
                hits.owner[ray] = hits.group[ray] = -1
                for axis in range(hits.normals.shape[1]):
                    hits.normals[ray, axis] = 0.0
                continue
            hits.ranges[ray] = packet[8, lane]
            instance = packet_id[19, lane]
            row = 0 if instance == INVALID_ID else 1 + np.int64(instance)
            primitive = np.int64(packet_id[17, lane]) * tree.steps[row]
            primitive += tree.first_primitive[row, hit]
            hits.owner[ray] = tree.owner_of_primitive[primitive]
            hits.group[ray] = tree.groups[row]
            for axis in range(hits.normals.shape[1]):
                hits.normals[ray, axis] = packet[12 + axis, lane]
