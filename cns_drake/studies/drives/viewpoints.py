"""Viewpoints: LiDARs mounted elsewhere on the vehicle than the query's."""

from collections.abc import Mapping
from typing import Any

from cns_drake.scenarios import Scenario
from evaluation.base import InputError

# Named viewpoints of the database: offset to the left [m] and heading [deg].
VIEWPOINTS: Mapping[str, tuple[float, float]] = {
    "near": (0.5, 0.0),
    "lane": (5.0, 0.0),
    "reversed": (5.0, 180.0),
}
# The LiDAR of the database is this far ahead of the query's LiDAR [m], because
# no two drives stop at exactly the same places.
_AHEAD = 1.25


def checked_viewpoint(value: Any, where: str) -> tuple[float, float]:
    """Returns offset to the left [m] and heading [deg] of a viewpoint.

    Args:
        value: the name of a viewpoint; or its offset to the left, up to 100 m,
            and its heading, up to 360 deg.
        where: file and field, for errors.

    Raises:
        InputError: the value is anything else.
    """
    if isinstance(value, str) and value in VIEWPOINTS:
        return VIEWPOINTS[value]
    try:
        left, heading_deg = value
        if abs(left) <= 100 and abs(heading_deg) <= 360:
            return float(left), float(heading_deg)
    except (TypeError, ValueError):
        pass
    raise InputError(
        f"{where}: {value!r} is neither {', '.join(VIEWPOINTS)} nor [metres to"
        " the left, heading in deg]"
    )


def with_lidars_beside(
    drive: Scenario, left: float, heading_deg: float
) -> Scenario:
    """Returns a database drive along the query's route, given the query drive.

    The LiDARs of the returned drive are also moved 1.25 m ahead, so that it
    does not coincide with `drive`.

    Args:
        drive: the drive.
        left: how far the LiDARs are moved to the left [m].
        heading_deg: angle by which the LiDARs are rotated to the left [deg].
    """
    return with_lidars_moved(drive, _AHEAD, left, heading_deg)


def with_lidars_moved(
    drive: Scenario, ahead: float, left: float, heading_deg: float
) -> Scenario:
    """Returns a drive whose LiDARs are mounted elsewhere on the vehicle.

    Args:
        drive: the drive.
        ahead: how far the LiDARs are moved forwards [m].
        left: how far the LiDARs are moved to the left [m].
        heading_deg: angle by which the LiDARs are rotated to the left [deg].
    """
    lidars = {}
    for name, config in drive.lidars.items():
        (x, y, z), (roll, pitch, yaw) = config.xyz, config.rpy_deg
        lidars[name] = config.replaced(
            xyz=(x + ahead, y + left, z),
            rpy_deg=(roll, pitch, yaw + heading_deg),
        )
    return drive.replaced(lidars=lidars)
