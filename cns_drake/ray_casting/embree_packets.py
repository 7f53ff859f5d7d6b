"""Packets of rays, cast on Embree's scenes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting import embree
from cns_drake.ray_casting.rays import Hits, Rays

# Embree treats smaller direction components as positive, whatever their sign. A
# packet that mixes such rays with rays of truly positive components loses hits.
_TINY = 1e-18


class PacketScenes(NamedTuple):
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


@compiled
def cast_packets(
    intersect: embree.PacketFunction,
    scenes: PacketScenes,
    mask: int,
    rays: Rays,
    hits: Hits,
    first: int,
    last: int,
) -> None:
    """Casts the rays `first` to `last` - 1.

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
