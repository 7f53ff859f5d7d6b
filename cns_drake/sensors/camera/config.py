"""The description of a camera."""

import math
from typing import Annotated

from pydantic import Field

from cns_drake.sensors.sensor_config import Section, Triple

# In Drake, the principal point of a single pixel lies on its edge: an error.
_Pixels = Annotated[int, Field(ge=2, le=4096)]
_Angle = Annotated[float, Field(ge=-7.0, le=7.0)]


class CameraSection(Section):
    """A pinhole camera without distortion. It does not see its own car.

    Attributes:
        width: width of the image in pixels, at least 2.
        height: height of the image in pixels, at least 2.
        rate: images per second [Hz]. The scan rate of the first LiDAR must be a
            multiple of this rate, because each image has the stamp of a scan.
        fov_y: vertical field of view [rad].
        xyz: position in `base_link` [m].
        rpy: roll, pitch, yaw in `base_link` [rad]; with zeros the camera looks
            straight ahead.
        depth: whether to record depth images as well.
        label: whether to record images of the semantic classes as well.
    """

    width: _Pixels = 640
    height: _Pixels = 480
    rate: int = Field(default=2, ge=1, le=100)
    fov_y: float = Field(default=1.0, gt=0.0, lt=math.pi)
    xyz: Triple = (0.0, 0.0, 1.6)
    rpy: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    depth: bool = False
    label: bool = False
