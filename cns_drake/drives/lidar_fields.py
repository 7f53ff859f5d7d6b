"""Rings and fields of view of the LiDAR models that recordings can name."""

from typing import NamedTuple


class LidarField(NamedTuple):
    """Number of rings and vertical field of view of a LiDAR.

    Attributes:
        rings: number of rings (channels).
        lowest_deg: elevation of the lowest ring [deg]; negative below the
            horizon.
        highest_deg: elevation of the highest ring [deg].
    """

    rings: int
    lowest_deg: float
    highest_deg: float


# Preset, or unit of a public data set -> its field. Livox's units have no
# rings; the number of the `cns` preset stands in. HeLiPR's Ouster is an OS2
# with 128 channels over 22.5 deg (its data sheet). NCLT's HDL-32E hangs upside
# down.
_FIELDS = {
    "cns": LidarField(32, -22.5, 22.5),
    "os0-128": LidarField(128, -45.0, 45.0),
    "os1-32": LidarField(32, -22.5, 22.5),
    "os1-64": LidarField(64, -22.5, 22.5),
    "os1-128": LidarField(128, -22.5, 22.5),
    "os1-64-33": LidarField(64, -16.6, 16.6),
    "os1-128-42": LidarField(128, -21.2, 21.2),
    "os2-128": LidarField(128, -11.25, 11.25),
    "vlp-16": LidarField(16, -15.0, 15.0),
    "hdl-64e": LidarField(64, -24.33, 2.0),
    "hdl-32e": LidarField(32, -30.67, 10.67),
    "hdl-32e-upside-down": LidarField(32, -10.67, 30.67),
    "alpha-prime": LidarField(128, -25.0, 15.0),
    "hesai-pandar64": LidarField(64, -25.0, 15.0),
    "hesai-pandar-xt32": LidarField(32, -16.0, 15.0),
    "mid-70": LidarField(32, -35.2, 35.2),
    "avia": LidarField(32, -38.6, 38.6),
    "mid-360": LidarField(32, -7.0, 52.0),
}


def lidar_field(unit: object) -> LidarField | None:
    """Returns the number of rings and the field of view of a LiDAR model.

    The result is None if the model is unknown.

    Args:
        unit: name of a preset or model in lower case, such as `os1-64` or
            `vlp-16`.
    """
    return _FIELDS.get(unit) if isinstance(unit, str) else None
