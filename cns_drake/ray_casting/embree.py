"""The functions of Embree's C interface that ray casting needs.

Embree is the shared library in the `embreex` wheel.

Formats and values of the C interface: Embree 4 manual,
https://github.com/RenderKit/embree, headers `rtcore_*.h`.
"""

import ctypes
from functools import lru_cache
import importlib
import importlib.util
from pathlib import Path

import numba
from numba import types

# With this import, numba accepts functions as arguments of compiled functions.
from numba.extending import intrinsic, register_jitable, typeof_impl

# Types of geometries (`RTC_GEOMETRY_TYPE_...`).
TRIANGLE = 0
CONE = 15
ROUND_SEGMENT = 16
SPHERE = 50
DISC = 52
USER = 120
INSTANCE = 121
# Types of buffers (`RTC_BUFFER_TYPE_...`).
INDEX_BUFFER = 0
VERTEX_BUFFER = 1
NORMAL_BUFFER = 3
# Formats of buffers (`RTC_FORMAT_...`).
UINT = 0x5001
UINT3 = 0x5003
FLOAT3 = 0x9003
FLOAT4 = 0x9004
FLOAT3X4_ROW_MAJOR = 0x9134
# Flag of a scene (`RTC_SCENE_FLAG_ROBUST`).
ROBUST_SCENE = 1 << 2
# Quality of a scene's hierarchy (`RTC_BUILD_QUALITY_LOW`): quick to build, slow
# to traverse.
LOW_QUALITY = 0
# Error of a device (`RTC_ERROR_OUT_OF_MEMORY`).
OUT_OF_MEMORY = 4
# Flag of a query (`RTC_RAY_QUERY_FLAG_COHERENT`).
COHERENT_RAYS = 1 << 16
# Id of a geometry or instance if there is no hit (`RTC_INVALID_GEOMETRY_ID`).
INVALID_ID = 0xFFFFFFFF
# Setting of a device: room for more user threads than a machine has.
# `rtcJoinCommitScene` then builds a scene in the calling thread only, without
# Embree's own threads. Once woken, Embree's threads keep looking for work,
# although hundreds of instances have none; and a forked process would lack
# these threads.
ALONE = b"user_threads=65536"
# Rays in a packet, and RTC_DEVICE_PROPERTY_NATIVE_RAY<rays>_SUPPORTED.
_NATIVE_PACKETS = ((8, 33), (16, 34))


# Numba's own addresses are unsigned numbers.
_PACKET_TYPE = types.FunctionType(
    types.void(types.uintp, types.intp, types.uintp, types.intp)
)


class IntersectArguments(ctypes.Structure):
    """Embree's C struct RTCIntersectArguments."""

    _fields_ = (
        ("flags", ctypes.c_uint),
        ("feature_mask", ctypes.c_uint),
        ("context", ctypes.c_void_p),
        ("filter", ctypes.c_void_p),
        ("intersect", ctypes.c_void_p),
    )


@lru_cache(maxsize=1)
def load() -> ctypes.CDLL:
    """Loads Embree; returns its C interface with typed signatures."""
    package = importlib.util.find_spec("embreex")
    assert package is not None
    assert package.origin is not None
    folder = Path(package.origin).parent
    places = [folder, folder.parent / "embreex.libs", folder / ".dylibs"]
    files = [f for place in places for f in sorted(place.glob("*embree4*"))]
    # The wheel has Embree's dependencies beside it. Its extension module finds
    # them, and is loaded first.
    importlib.import_module("embreex.rtcore_scene")
    embree = ctypes.CDLL(str(files[0]))
    pointer, integer, uint = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint
    size = ctypes.c_size_t
    for name, result, arguments in [
        ("rtcNewDevice", pointer, [ctypes.c_char_p]),
        ("rtcRetainDevice", None, [pointer]),
        ("rtcReleaseDevice", None, [pointer]),
        ("rtcGetDeviceError", integer, [pointer]),
        ("rtcGetDeviceProperty", ctypes.c_ssize_t, [pointer, integer]),
        ("rtcNewScene", pointer, [pointer]),
        ("rtcSetSceneFlags", None, [pointer, integer]),
        ("rtcSetSceneBuildQuality", None, [pointer, integer]),
        ("rtcJoinCommitScene", None, [pointer]),
        ("rtcRetainScene", None, [pointer]),
        ("rtcReleaseScene", None, [pointer]),
        ("rtcNewGeometry", pointer, [pointer, integer]),
        ("rtcCommitGeometry", None, [pointer]),
        ("rtcEnableGeometry", None, [pointer]),
        ("rtcDisableGeometry", None, [pointer]),
        ("rtcReleaseGeometry", None, [pointer]),
        ("rtcAttachGeometry", uint, [pointer, pointer]),
        ("rtcSetGeometryMask", None, [pointer, uint]),
        ("rtcSetGeometryUserPrimitiveCount", None, [pointer, uint]),
        ("rtcSetGeometryUserData", None, [pointer, pointer]),
        ("rtcSetGeometryBoundsFunction", None, [pointer, pointer, pointer]),
        ("rtcSetGeometryIntersectFunction", None, [pointer, pointer]),
        ("rtcSetGeometryInstancedScene", None, [pointer, pointer]),
        ("rtcSetGeometryTransform", None, [pointer, uint, integer, pointer]),
        ("rtcSetGeometryTransformQuaternion", None, [pointer, uint, pointer]),
        ("rtcSetGeometryTimeStepCount", None, [pointer, uint]),
        (
            "rtcSetNewGeometryBuffer",
            pointer,
            [pointer, integer, uint, integer, size, size],
        ),
    ]:
        function = getattr(embree, name)
        function.restype, function.argtypes = result, arguments
    return embree


class PacketFunction(types.WrapperAddressProtocol):
    """A C function that casts a packet of rays, for compiled code.

    The function takes the addresses of four things: the mask of active rays,
    the scene, the packet and the arguments. Unlike a ctypes function, it can be
    an argument of a compiled function whose machine code numba keeps on disk.
    """

    def __init__(self, function: object):
        """Takes rtcIntersect4, rtcIntersect8 or rtcIntersect16."""
        self._address = ctypes.cast(function, ctypes.c_void_p).value  # type: ignore[arg-type]  # A function is a pointer.

    def __wrapper_address__(self) -> int | None:
        return self._address

    def signature(self) -> object:
        return _PACKET_TYPE.signature


@typeof_impl.register(PacketFunction)  # type: ignore[untyped-decorator]  # numba has no hints.
def _typeof_packet_function(*_: object) -> types.Type:
    """Returns numba's type; without this, numba makes one for each call."""
    return _PACKET_TYPE


def native_packet(
    embree: ctypes.CDLL, device: int
) -> tuple[int, PacketFunction]:
    """Returns the number of rays in a packet, and the function that casts it.

    The number is the width of the processor's vector units, such as 16 with
    AVX-512 and 8 with AVX2. In a larger packet, Embree would cast the rays one
    by one.

    Args:
        embree: Embree's C interface.
        device: address of an Embree device.
    """
    lanes = 4
    for more, supported in _NATIVE_PACKETS:
        if embree.rtcGetDeviceProperty(device, supported):
            lanes = more
    return lanes, PacketFunction(getattr(embree, f"rtcIntersect{lanes}"))


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _pointer(context: object, address: object) -> tuple:
    """In compiled code, the pointer that an integer stands for."""

    def cast(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        kind = context.get_value_type(signature.return_type)
        return builder.inttoptr(arguments[0], kind)

    return numba.types.voidptr(address), cast


@register_jitable  # type: ignore[untyped-decorator]  # numba has no hints.
def array_at(address: int, shape: object, dtype: object) -> object:
    """In compiled code, the array at an address."""
    return numba.carray(_pointer(address), shape, dtype)
