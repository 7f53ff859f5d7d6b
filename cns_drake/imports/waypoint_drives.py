"""Drives along waypoints, with bends and room for a car."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from cns_drake.base.errors import InputError
from cns_drake.motion.control_points import POINT_SPACING
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import make_waypoint_path

# Paths of vehicles are quintic splines (`cns_drake.motion`), whose points are
# their control points.
_DEGREE = 5
# A proposed drive may be on a slope, with rounded numbers: its bends are this
# many times wider than the car's tightest.
_MARGIN = 1.01
# Distance of the places where bends and room are checked [m].
_STEP = 0.25
# Greatest and least length of a proposed drive [m].
LONGEST = 1500.0
SHORTEST = 80.0

# Takes places (N, 2) along a path [m] and returns the first (2,) where a car
# has no room, or None.
Room = Callable[[np.ndarray], np.ndarray | None]


@dataclass(frozen=True)
class WaypointDrive:
    """A drive through a city.

    Attributes:
        waypoints: (N, 2) or (N, 3) [m].
        path: (M, 2) that a car follows [m].
        limit: the lowest speed limit on the way, or none [m/s].
    """

    waypoints: np.ndarray
    path: np.ndarray
    limit: float | None = None

    @property
    def length(self) -> float:
        """Length from above [m]."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


@dataclass(frozen=True)
class Obstacle:
    """The reason why there is no drive.

    Attributes:
        place: (2,) where a bend is too tight or room is missing [m].
    """

    place: np.ndarray


def steerable_drive(
    waypoints: np.ndarray, room: Room | None = None, margin: float = _MARGIN
) -> WaypointDrive | Obstacle:
    """Returns the drive along waypoints, or the obstacle.

    Args:
        waypoints: (N, 2) or (N, 3), at least two [m].
        room: checked on the whole path.
        margin: least radius of bends, in tightest radii of the car.
    """
    waypoints = np.round(waypoints, 3)
    xyz = np.zeros((len(waypoints), 3))
    xyz[:, : waypoints.shape[1]] = waypoints
    try:
        points = make_waypoint_path(xyz, POINT_SPACING).points[:, :2]
    except InputError:
        return Obstacle(xyz[len(xyz) // 2, :2])
    driven, radii = driven_path(points)
    tightest = int(radii.argmin())
    if radii[tightest] < margin * TIGHTEST_RADIUS:
        return Obstacle(driven[tightest])
    missing = None if room is None else room(driven)
    if missing is not None:
        return Obstacle(missing)
    drive = WaypointDrive(waypoints, points)
    too_short = drive.length < SHORTEST
    return Obstacle(points[len(points) // 2]) if too_short else drive


def driven_path(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the places (M, 2) of a path, and the radii (M,) of its bends.

    Args:
        points: (N, 2) the control points of its spline, evenly spaced [m].
    """
    reach = _DEGREE // 2
    points = np.concatenate(
        [
            2 * points[0] - points[reach:0:-1],
            points,
            2 * points[-1] - points[-2 : -reach - 2 : -1],
        ]
    )
    spline = BSpline(np.arange(len(points) + _DEGREE + 1.0), points, _DEGREE)
    first, last = float(_DEGREE), float(len(points))
    count = int((last - first) * POINT_SPACING / _STEP) + 1
    u = np.linspace(first, last, count)
    (x1, y1), (x2, y2) = spline(u, 1).T, spline(u, 2).T
    curvature = np.abs(x1 * y2 - y1 * x2) / np.hypot(x1, y1) ** 3
    return spline(u), 1.0 / np.maximum(curvature, 1e-12)
