"""ROS 2 messages of cameras."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.systems.sensors import CameraInfo

from cns_drake.base.recordings.ros_types import message_class
from cns_drake.recording.messages import make_header

IMAGE = "sensor_msgs/msg/Image"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

# Kind of image -> its encoding in ROS.
ENCODINGS = {"color": "rgba8", "depth": "32FC1", "label": "16SC1"}


def make_image(
    pixels: np.ndarray, encoding: str, frame_id: str, stamp_ns: int
) -> Any:
    """Returns an Image message.

    Args:
        pixels: (height, width, channels), little-endian; depth in metres.
        encoding: one of `ENCODINGS`.
        frame_id: the camera's frame, z ahead and y down.
        stamp_ns: the time of the image [ns].
    """
    height, width, _ = pixels.shape
    data = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
    return message_class(IMAGE)(
        header=make_header(frame_id, stamp_ns),
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=len(data) // height,
        data=data,
    )


def make_camera_info(camera: CameraInfo, frame_id: str, stamp_ns: int) -> Any:
    """Returns a CameraInfo message of a pinhole without distortion.

    Args:
        camera: its intrinsics.
        frame_id: the camera's frame, z ahead and y down.
        stamp_ns: the time of the image [ns].
    """
    K = camera.intrinsic_matrix()
    region = message_class("sensor_msgs/msg/RegionOfInterest")
    return message_class(CAMERA_INFO)(
        header=make_header(frame_id, stamp_ns),
        height=camera.height(),
        width=camera.width(),
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=K.ravel(),
        r=np.eye(3).ravel(),
        p=np.column_stack([K, np.zeros(3)]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=region(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )
