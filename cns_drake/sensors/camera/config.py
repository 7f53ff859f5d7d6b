"""The description of a camera."""

from collections.abc import Mapping
import math
from typing import Annotated, Any

from pydantic import Field, model_validator

from cns_drake.sensors.sensor_config import Angle, Section, Triple

# In Drake, the principal point of a single pixel lies on its edge: an error.
_Pixels = Annotated[int, Field(ge=2, le=4096)]
# Field of earlier versions, in radians -> the field that replaces it.
FORMER_ANGLES: Mapping[str, str] = {"fov_y": "fov_y_deg", "rpy": "rpy_deg"}


class CameraSection(Section):
    """A pinhole camera without distortion. It does not see its own car.

    Attributes:
        width: width of the image in pixels, at least 2.
        height: height of the image in pixels, at least 2.
        rate: images per second [Hz]. The scan rate of the first LiDAR must be a
            multiple of this rate, because each image has the stamp of a scan.
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

    @model_validator(mode="before")
    @classmethod
    def _read_radians(cls, values: Any) -> Any:
        """Reads the fields of earlier versions, whose angles are in radians."""
        if not isinstance(values, Mapping):
            return values
        found = dict(values)
        for old, new in FORMER_ANGLES.items():
            if old not in found:
                continue
            if new in found:
                raise ValueError(f"{old}: give only {new}")
            angle = found.pop(old)
            if isinstance(angle, list | tuple):
                found[new] = [_degrees(value) for value in angle]
            else:
                found[new] = _degrees(angle)
        return found


def _degrees(angle: Any) -> Any:
    """Returns an angle [rad] in degrees; returns all but numbers unchanged."""
    is_number = isinstance(angle, int | float) and not isinstance(angle, bool)
    return math.degrees(angle) if is_number else angle
