"""The functions of Embree's C interface that ray casting needs.

Embree is the shared library in the `embreex` wheel.

Formats and values of the C interface: Embree 4 manual,
https://github.com/RenderKit/embree, headers `rtcore_*.h`.
"""

from collections.abc import Callable
import ctypes
from functools import lru_cache
import importlib
import importlib.util
from pathlib import Path

from numba import types
from numba.core.cgutils import ir

# With this import, numba accepts functions as arguments of compiled functions.
from numba.extending import intrinsic

# Types of geometries (`RTC_GEOMETRY_TYPE_...`).
TRIANGLE = 0
INSTANCE = 121
# Types of buffers (`RTC_BUFFER_TYPE_...`).
INDEX_BUFFER = 0
VERTEX_BUFFER = 1
# Formats of buffers (`RTC_FORMAT_...`).
UINT3 = 0x5003
FLOAT3 = 0x9003
FLOAT3X4_ROW_MAJOR = 0x9134
# Flag of a scene (`RTC_SCENE_FLAG_ROBUST`).
ROBUST_SCENE = 1 << 2
# Error of a device (`RTC_ERROR_OUT_OF_MEMORY`).
OUT_OF_MEMORY = 4
# Flags of a query (`RTC_RAY_QUERY_FLAG_...`): coherent rays, and the filter in
# the arguments for all geometries.
COHERENT_RAYS = 1 << 16
FILTERED_RAYS = 1 << 1
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
        ("rtcJoinCommitScene", None, [pointer]),
        ("rtcRetainScene", None, [pointer]),
        ("rtcReleaseScene", None, [pointer]),
        ("rtcNewGeometry", pointer, [pointer, integer]),
        ("rtcCommitGeometry", None, [pointer]),
        ("rtcEnableGeometry", None, [pointer]),
        ("rtcDisableGeometry", None, [pointer]),
        ("rtcReleaseGeometry", None, [pointer]),
        ("rtcAttachGeometry", uint, [pointer, pointer]),
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


def native_packet(embree: ctypes.CDLL, device: int) -> tuple[int, int]:
    """Returns the number of rays in a packet, and what casts it.

    That is the address of rtcIntersect4, rtcIntersect8 or rtcIntersect16.

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
    function = getattr(embree, f"rtcIntersect{lanes}")
    address = ctypes.cast(function, ctypes.c_void_p).value
    assert address is not None
    return lanes, address


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def cast_packet(
    context: object,
    function: object,
    valid: object,
    scene: object,
    packet: object,
    arguments: object,
) -> tuple:
    """In compiled code, calls rtcIntersect4, rtcIntersect8 or rtcIntersect16.

    All arguments are addresses.
    """
    address = types.intp

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        number = context.get_data_type(address)
        kind = ir.FunctionType(ir.VoidType(), [number] * 4)
        place = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(place, arguments[1:])
        return context.get_dummy_value()

    return types.void(*[address] * 5), generate


def _reader(stored: types.Type, taken: types.Type) -> Callable:
    """Returns a function of compiled code that reads a number at an address."""

    @intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
    def read(context: object, address: object) -> tuple:
        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            kind = context.get_data_type(stored).as_pointer()
            place = builder.inttoptr(arguments[0], kind)
            return context.cast(builder, builder.load(place), stored, taken)

        return taken(types.intp), generate

    return read


def _writer(stored: types.Type, taken: types.Type) -> Callable:
    """Returns a function of compiled code that writes a number."""

    @intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
    def write(context: object, address: object, value: object) -> tuple:
        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            kind = context.get_data_type(stored).as_pointer()
            place = builder.inttoptr(arguments[0], kind)
            number = context.cast(builder, arguments[1], taken, stored)
            builder.store(number, place)
            return context.get_dummy_value()

        return types.void(types.intp, taken), generate

    return write


# What compiled code reads and writes at addresses. Numbers are of 8 bytes once
# they are read: few types of numbers are quick to compile.
read_int32 = _reader(types.int32, types.int64)
read_uint32 = _reader(types.uint32, types.int64)
read_int64 = _reader(types.int64, types.int64)
read_single = _reader(types.float32, types.float64)
read_double = _reader(types.float64, types.float64)
write_int32 = _writer(types.int32, types.int64)
write_int64 = _writer(types.int64, types.int64)
write_single = _writer(types.float32, types.float64)
write_double = _writer(types.float64, types.float64)


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def prefetch(context: object, address: object) -> tuple:
    """In compiled code, makes the processor load a line of its cache."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        byte, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag])
        function = builder.module.declare_intrinsic(
            "llvm.prefetch", [byte], kind
        )
        place = builder.inttoptr(arguments[0], byte)
        # To read, as near as possible, data.
        builder.call(function, [place, flag(0), flag(3), flag(1)])
        return context.get_dummy_value()

    return types.void(types.intp), generate
