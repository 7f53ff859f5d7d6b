"""The description of a camera."""

import math
from typing import Annotated

from pydantic import Field

from cns_drake.sensors.sensor_config import Section, Triple

_Pixels = Annotated[int, Field(ge=1, le=4096)]
_Angle = Annotated[float, Field(ge=-7.0, le=7.0)]


class CameraSection(Section):
    """A pinhole camera without distortion, that does not see its vehicle.

    Attributes:
        width: pixels in a row.
        height: rows.
        rate: images per second, a divisor of the rate of the scans of the first
            LiDAR, whose stamps they have.
        fov_y: field of view from the top to the bottom of an image [rad].
        xyz: position in `base_link` [m].
        rpy: roll, pitch, yaw in `base_link` [rad]; without them the camera
            looks ahead.
        depth: whether there are images of the depth, too.
        label: whether there are images of the classes, too.
    """

    width: _Pixels = 640
    height: _Pixels = 480
    rate: int = Field(default=2, ge=1, le=100)
    fov_y: float = Field(default=1.0, gt=0.0, lt=math.pi)
    xyz: Triple = (0.0, 0.0, 1.6)
    rpy: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    depth: bool = False
    label: bool = False
