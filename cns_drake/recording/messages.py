"""ROS 2 messages of a recording, made from Python values.

Poses are given as Drake types, and time stamps in whole nanoseconds, so that
nothing is rounded here. Quaternions in messages have ROS order (x, y, z, w).
"""

from collections.abc import Sequence
import functools
import struct
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.sensors import CameraInfo

from evaluation.base import NS_PER_S, to_jpeg
from evaluation.drives import (
    BASE_FRAME,
    COMPRESSED_IMAGE,
    IMU,
    IMU_FRAME,
    MAP_FRAME,
    ODOMETRY,
    POINT_CLOUD,
    TF,
    make_message,
    point_field_datatype,
    serialize,
)

# Time stamps of ROS 2 have an int32 number of seconds.
END_NS = 2**31 * NS_PER_S
IMAGE = "sensor_msgs/msg/Image"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
# Kind of image -> its encoding in ROS.
ENCODINGS = {"color": "rgba8", "depth": "32FC1", "label": "16SC1"}
# At quality 90 of 100, colours are within a few levels of the original.
_JPEG_QUALITY = 90

# Variance given for an exact value, in the square of its unit: a standard
# deviation of a millionth. It is not 0, because ROS reads zeros as an unknown
# covariance.
_EXACT = 1e-12
# The covariance of an exact pose or twist, row by row: (36,).
EXACT_COVARIANCE = _EXACT * np.eye(6).ravel()


def make_imu(
    quat_xyzw: Sequence[float] | np.ndarray | None,
    angular_velocity: np.ndarray | None,
    specific_force: np.ndarray | None,
    stamp_ns: int,
    variances: tuple[float, float] = (0.0, 0.0),
) -> Any:
    """Returns an Imu message.

    Args:
        quat_xyzw: orientation R_WI of the imu frame I in the map W; None if
            unknown.
        angular_velocity: w_WI_I, shape (3,) [rad/s]; None if not measured.
        specific_force: expressed in I, shape (3,) [m/s^2]; at rest on level
            ground +9.81 along z. None if not measured.
        stamp_ns: time of the message [ns].
        variances: two variances, the same for x, y and z: of the specific force
            [m^2/s^4], and of the angular velocity [rad^2/s^2].

    Returns:
        The message. The covariance of a value without noise states a standard
        deviation of 1e-6. The covariance of a value that is None begins with -1
        (REP 145).
    """
    force_variance, turn_variance = variances
    return make_message(
        IMU,
        header=make_header(IMU_FRAME, stamp_ns),
        orientation=(0.0, 0.0, 0.0, 1.0) if quat_xyzw is None else quat_xyzw,
        orientation_covariance=_covariance(quat_xyzw, 0.0),
        angular_velocity=angular_velocity,
        angular_velocity_covariance=_covariance(
            angular_velocity, turn_variance
        ),
        linear_acceleration=specific_force,
        linear_acceleration_covariance=_covariance(
            specific_force, force_variance
        ),
    )


def _covariance(value: object, variance: float) -> np.ndarray:
    """Returns the covariance of a value by rows; it starts with -1 for None."""
    covariance = np.zeros(9)
    if value is None:
        covariance[0] = -1.0
    else:
        covariance[::4] = max(variance, _EXACT)
    return covariance


def make_odometry(
    X_WB: RigidTransform, V_WB_B: SpatialVelocity, stamp_ns: int
) -> Any:
    """Returns an Odometry message: the vehicle's pose and velocity.

    The values are exact; their standard deviations are given as 1e-6.

    Args:
        X_WB: pose of the vehicle B in the map W.
        V_WB_B: velocity of B in W, expressed in B [rad/s, m/s].
        stamp_ns: time of the message [ns].
    """
    twist = (V_WB_B.translational(), V_WB_B.rotational())
    return make_message(
        ODOMETRY,
        header=make_header(MAP_FRAME, stamp_ns),
        child_frame_id=BASE_FRAME,
        pose=(_pose_fields(X_WB), EXACT_COVARIANCE),
        twist=(twist, EXACT_COVARIANCE),
    )


def make_tf(
    parent: str, X_PCs: dict[str, RigidTransform], stamp_ns: int
) -> Any:
    """Returns a TFMessage with the poses of frames C in one parent frame P.

    Args:
        parent: name of P.
        X_PCs: name of a frame C -> its pose X_PC.
        stamp_ns: time of the poses [ns].
    """
    header = make_header(parent, stamp_ns)
    return make_message(
        TF,
        transforms=[
            (header, child, _pose_fields(X_PC)) for child, X_PC in X_PCs.items()
        ],
    )


def _pose_fields(X: RigidTransform) -> tuple[np.ndarray, tuple[float, ...]]:
    return X.translation(), to_quat_xyzw(X.rotation())


def to_quat_xyzw(R: RotationMatrix) -> tuple[float, float, float, float]:
    """Returns the unit quaternion of a rotation as x, y, z, w."""
    q = R.ToQuaternion()
    return q.x(), q.y(), q.z(), q.w()


def make_header(frame_id: str, stamp_ns: int) -> Any:
    """Returns the header of a message.

    Raises:
        ValueError: ROS 2 has no such time stamp.
    """
    stamp = _to_stamp(stamp_ns)
    return make_message("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)


def _to_stamp(stamp_ns: int) -> tuple[int, int]:
    """Returns a time stamp in whole seconds, and nanoseconds.

    Raises:
        ValueError: ROS 2 has no such time stamp.
    """
    if stamp_ns >= END_NS:
        raise ValueError(
            f"a message at {stamp_ns / NS_PER_S:.0f} s: time stamps of ROS 2"
            f" are below {END_NS // NS_PER_S} s"
        )
    return divmod(stamp_ns, NS_PER_S)


def make_image(
    pixels: np.ndarray, encoding: str, frame_id: str, stamp_ns: int
) -> Any:
    """Returns an Image message.

    Args:
        pixels: (height, width, channels) values, little-endian; depths in
            metres.
        encoding: one of `ENCODINGS`.
        frame_id: the camera's frame, z ahead and y down.
    """
    height, width, _ = pixels.shape
    data = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
    return make_message(
        IMAGE,
        header=make_header(frame_id, stamp_ns),
        height=height,
        width=width,
        encoding=encoding,
        step=len(data) // height,
        data=data,
    )


def make_compressed_image(
    pixels: np.ndarray, frame_id: str, stamp_ns: int
) -> Any:
    """Returns a CompressedImage message with an image as JPEG.

    Args:
        pixels: (height, width, 3) uint8 red, green and blue.
        frame_id: name of the camera's frame, z ahead and y down.
        stamp_ns: time of the image [ns].
    """
    # Slow to import, and few recordings have cameras.
    from PIL import Image

    picture = Image.fromarray(np.ascontiguousarray(pixels))
    jpeg = to_jpeg(picture, _JPEG_QUALITY)
    return make_message(
        COMPRESSED_IMAGE,
        header=make_header(frame_id, stamp_ns),
        format="jpeg",
        data=np.frombuffer(jpeg, np.uint8),
    )


def rendered_intrinsics(camera: CameraInfo) -> np.ndarray:
    """Returns the intrinsic matrix K (3, 3) of the images that Drake renders.

    Pixel (u, v) of an image shows what lies along K^-1 (u, v, 1), in the
    optical frame. Both coordinates of the principal point in K are half a pixel
    less than in `camera`: Drake's renderers count from the outer corner of the
    first pixel, while ROS and Drake's documentation count from the centre of
    the first pixel.
    """
    K = camera.intrinsic_matrix()
    K[:2, 2] -= 0.5
    return K


def make_camera_info(camera: CameraInfo, frame_id: str, stamp_ns: int) -> Any:
    """Returns a CameraInfo message of a pinhole camera without distortion.

    The matrix K of the message is the result of `rendered_intrinsics`.

    Args:
        camera: the camera, as Drake describes it.
        frame_id: name of the camera's frame, z ahead and y down.
        stamp_ns: time of the message [ns].
    """
    K = rendered_intrinsics(camera)
    return make_message(
        CAMERA_INFO,
        header=make_header(frame_id, stamp_ns),
        height=camera.height(),
        width=camera.width(),
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=K.ravel(),
        r=np.eye(3).ravel(),
        p=np.column_stack([K, np.zeros(3)]).ravel(),
    )


# The clouds of a sensor differ only in their stamp and their points. The other
# bytes are made once, by the usual serialiser, and kept.
#
# Placeholder for the numbers that change in a message that is made once. It is
# a valid number of nanoseconds, and cannot occur in a text.
_PLACEHOLDER = 0x3A17C0DE


def encode_point_cloud(
    points: np.ndarray, frame_id: str, stamp_ns: int
) -> bytes:
    """Returns a PointCloud2 whose records are `points`, serialised as CDR.

    The cloud is unordered (height 1) and dense: rays without a return have no
    record.

    Args:
        points: structured array of shape (N,), little-endian scalar fields;
            each becomes a point field under its own name and offset.
            Padding is written as zeros, so that equal points give equal
            bytes.
    """
    size = points.dtype.itemsize
    rows = np.ascontiguousarray(points).view(np.uint8).reshape(-1, size)
    _, padding = _point_fields(points.dtype)
    if any(rows[:, column].any() for column in padding):
        rows = rows.copy()
        for column in padding:
            rows[:, column] = 0
    start, middle, steps, end = _cloud_frame(points.dtype, frame_id)
    stamp = struct.pack("=iI", *_to_stamp(stamp_ns))
    width, length = (struct.pack("=I", n) for n in (len(rows), rows.nbytes))
    # The data follow their length twice: of a row, and of the whole. Records
    # are copied once here, and three times by the serialiser.
    return b"".join(
        [start, stamp, middle, width, steps, length, length, rows.data, end]
    )


@functools.cache
def _cloud_frame(dtype: np.dtype, frame_id: str) -> list[bytes]:
    """Returns the constant bytes of a cloud's message, without the data.

    They are the pieces between stamp, width, row step and data.
    """
    data = serialize(
        make_message(
            POINT_CLOUD,
            header=make_header(
                frame_id, _PLACEHOLDER * NS_PER_S + _PLACEHOLDER
            ),
            height=1,
            width=_PLACEHOLDER,
            fields=_point_fields(dtype)[0],
            point_step=dtype.itemsize,
            row_step=_PLACEHOLDER,
            is_dense=True,
        )
    )
    start, _, middle, steps, end = data.split(struct.pack("=I", _PLACEHOLDER))
    # The message ends with the length of the data, the data and one byte.
    return [start, middle, steps, end[-1:]]


@functools.cache
def _point_fields(dtype: np.dtype) -> tuple[list[tuple], list[int]]:
    """Returns PointFields of records, and offsets of bytes in no field."""
    fields = []
    padding = set(range(dtype.itemsize))
    for name, (scalar, offset, *_) in (dtype.fields or {}).items():
        padding.difference_update(range(offset, offset + scalar.itemsize))
        fields.append((name, offset, point_field_datatype(scalar), 1))
    return fields, sorted(padding)
