"""The description of a camera."""

import math
from typing import Annotated

from pydantic import Field

from cns_drake.sensors.sensor_config import Section, Triple

_Pixels = Annotated[int, Field(ge=1, le=4096)]
_Angle = Annotated[float, Field(ge=-7.0, le=7.0)]


class CameraSection(Section):
    """A pinhole camera without distortion. It does not see its own vehicle.

    Attributes:
        width: number of pixels in a row.
        height: number of rows of pixels.
        rate: images per second. It divides the scan rate of the first LiDAR,
            and images have the stamps of its scans.
        fov_y: vertical field of view [rad].
        xyz: position in `base_link` [m].
        rpy: roll, pitch, yaw in `base_link` [rad]; at zero the camera looks
            ahead.
        depth: whether to record images of the depth, too.
        label: whether to record images of the classes, too.
    """

    width: _Pixels = 640
    height: _Pixels = 480
    rate: int = Field(default=2, ge=1, le=100)
    fov_y: float = Field(default=1.0, gt=0.0, lt=math.pi)
    xyz: Triple = (0.0, 0.0, 1.6)
    rpy: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    depth: bool = False
    label: bool = False
