"""The part of Embree's C interface that casting rays needs.

Embree comes as the shared object inside the `embreex` wheel. numba supplies
the loop that fills 16-ray packets, because one Python call per packet would
cost more than its rays. Only `cns_drake.ray_casting` uses this module.

Formats and values of the C interface: Embree 4 manual,
https://github.com/RenderKit/embree, headers `rtcore_*.h`.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache
import importlib
import importlib.util
from pathlib import Path

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
import numpy as np

TRIANGLE, CONE, ROUND_SEGMENT, SPHERE, DISC, INSTANCE = (
    0, 15, 16, 50, 52, 121,
)  # fmt: skip
# Kinds of geometry besides instances.
NUM_KINDS = 5
INDEX_BUFFER, VERTEX_BUFFER, NORMAL_BUFFER = 0, 1, 3
UINT, UINT3, FLOAT3, FLOAT4 = 0x5001, 0x5003, 0x9003, 0x9004
FLOAT3X4_ROW_MAJOR = 0x9134
ROBUST_SCENE = 1 << 2
COHERENT_RAYS = 1 << 16
INVALID_ID = 0xFFFFFFFF


class IntersectArguments(ctypes.Structure):
    """RTCIntersectArguments."""

    _fields_ = (
        ("flags", ctypes.c_uint),
        ("feature_mask", ctypes.c_uint),
        ("context", ctypes.c_void_p),
        ("filter", ctypes.c_void_p),
        ("intersect", ctypes.c_void_p),
    )


@lru_cache(maxsize=1)
def load() -> ctypes.CDLL:
    """Returns Embree's C interface with typed signatures."""
    package = importlib.util.find_spec("embreex")
    folder = Path(package.origin).parent
    places = [folder, folder.parent / "embreex.libs", folder / ".dylibs"]
    files = [f for place in places for f in sorted(place.glob("*embree4*"))]
    # The wheel keeps Embree's own dependencies beside it and finds them
    # through its extension module, which therefore is loaded first.
    importlib.import_module("embreex.rtcore_scene")
    embree = ctypes.CDLL(str(files[0]))
    pointer, integer, uint = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint
    size = ctypes.c_size_t
    for name, result, arguments in [
        ("rtcNewDevice", pointer, [ctypes.c_char_p]),
        ("rtcReleaseDevice", None, [pointer]),
        ("rtcGetDeviceError", integer, [pointer]),
        ("rtcNewScene", pointer, [pointer]),
        ("rtcSetSceneFlags", None, [pointer, integer]),
        ("rtcCommitScene", None, [pointer]),
        ("rtcReleaseScene", None, [pointer]),
        ("rtcNewGeometry", pointer, [pointer, integer]),
        ("rtcCommitGeometry", None, [pointer]),
        ("rtcReleaseGeometry", None, [pointer]),
        ("rtcAttachGeometry", uint, [pointer, pointer]),
        ("rtcSetGeometryInstancedScene", None, [pointer, pointer]),
        ("rtcSetGeometryTransform", None, [pointer, uint, integer, pointer]),
        (
            "rtcSetNewGeometryBuffer",
            pointer,
            [pointer, integer, uint, integer, size, size],
        ),
    ]:
        function = getattr(embree, name)
        function.restype, function.argtypes = result, arguments
    return embree


@intrinsic
def _call_intersect16(typing_context, function, valid, scene, rays, arguments):
    """Calls the C function at an address, from compiled code.

    An address that is a value, unlike a ctypes function, lets numba keep the
    compiled loop on disk, which saves a second at every start.
    """
    signature = types.void(function, valid, scene, rays, arguments)

    def generate(context, builder, signature, values):
        pointer = ir.IntType(8).as_pointer()
        function_type = ir.FunctionType(ir.VoidType(), [pointer] * 4)
        builder.call(
            builder.inttoptr(values[0], function_type.as_pointer()),
            [builder.inttoptr(value, pointer) for value in values[1:]],
        )
        return context.get_dummy_value()

    return signature, generate


@njit(cache=True, nogil=True)
def cast_packets(
    function, scene, arguments, p_set, d_set, max_range,
    first_primitive, owner_of_primitive, ranges, owner, group, normals,
):  # fmt: skip
    """Casts rays in packets of 16; see `RayCastingScene.cast_rays`.

    A packet is an RTCRayHit16: 12 ray fields and 9 hit fields (10 with room
    for the primitive of an instance array) of 16 lanes. It and the mask of
    lanes are aligned to 64 bytes, as Embree's vector loads demand.
    """
    lanes = 16
    storage = np.zeros((12 + 10 + 1 + 1) * lanes, np.float32)
    start = (-storage.ctypes.data % 64) // 4
    aligned = storage[start : start + 23 * lanes].reshape(23, lanes)
    packet, valid = aligned[:22], aligned[22].view(np.int32)
    packet_id = packet.view(np.uint32)
    num_rays = d_set.shape[0]
    one_origin = p_set.shape[0] == 1
    for begin in range(0, num_rays, lanes):
        count = min(lanes, num_rays - begin)
        for lane in range(lanes):
            ray = begin + min(lane, count - 1)
            origin = 0 if one_origin else ray
            valid[lane] = -1 if lane < count else 0
            for axis in range(3):
                packet[axis, lane] = p_set[origin, axis]
                packet[4 + axis, lane] = d_set[ray, axis]
            packet[3, lane] = 0.0
            packet[7, lane] = 0.0
            packet[8, lane] = max_range
            packet_id[9, lane] = INVALID_ID
            packet_id[10, lane] = 0
            packet_id[11, lane] = 0
            packet_id[18, lane] = INVALID_ID
            packet_id[19, lane] = INVALID_ID
        _call_intersect16(
            function, valid.ctypes.data, scene, packet.ctypes.data, arguments
        )
        for lane in range(count):
            ray = begin + lane
            hit = packet_id[18, lane]
            if hit == INVALID_ID:
                ranges[ray] = np.inf
                owner[ray] = -1
                group[ray] = -1
                continue
            ranges[ray] = packet[8, lane]
            instance = packet_id[19, lane]
            row = 0 if instance == INVALID_ID else np.int64(instance)
            primitive = first_primitive[row, hit] + packet_id[17, lane]
            owner[ray] = owner_of_primitive[primitive]
            group[ray] = row
            for axis in range(normals.shape[1]):
                normals[ray, axis] = packet[12 + axis, lane]
