"""The description of a camera."""

import math
from typing import Annotated

from pydantic import Field

from cns_drake.sensors.sensor_config import Angle, Triple
from evaluation.base import Section

# In Drake, the principal point of a single pixel lies on its edge: an error.
_Pixels = Annotated[int, Field(ge=2, le=4096)]


class CameraSection(Section):
    """A pinhole camera without distortion. It does not see its own car.

    Attributes:
        width: width of the image in pixels.
        height: height of the image in pixels.
        rate: images per second [Hz]. The scan rate of the first LiDAR must be a
            multiple.
        fov_y_deg: vertical field of view [deg]; by default one radian.
        xyz: position in `base_link` [m].
        rpy_deg: roll, pitch, yaw in `base_link` [deg]; with zeros the camera
            looks straight ahead.
        depth: whether to record depth images as well.
        label: whether to record images of the semantic classes as well.
    """

    width: _Pixels = 640
    height: _Pixels = 480
    rate: int = Field(default=2, ge=1, le=100)
    fov_y_deg: float = Field(default=math.degrees(1.0), gt=0.0, lt=180.0)
    xyz: Triple = (0.0, 0.0, 1.6)
    rpy_deg: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    depth: bool = False
    label: bool = False

    @property
    def streams(self) -> tuple[str, ...]:
        """What is recorded: `image`, `depth`, `label` and `camera_info`."""
        depth = ("depth",) if self.depth else ()
        label = ("label",) if self.label else ()
        return ("image", *depth, *label, "camera_info")
