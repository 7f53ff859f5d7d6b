"""Drives along waypoints that a car can steer."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import BSpline
from shapely.geometry import LineString

from evaluation.base import InputError, distances_along, length_of, power
from worlds.imports.drives.free_space import FreeSpace
from worlds.imports.faults import ImportFaults
from worlds.shapes import POINT_SPACING, TIGHTEST_RADIUS, make_waypoint_path

# Paths of vehicles are quintic splines (`cns_drake.motion`). The points of a
# path are their control points.
_DEGREE = 5
# Least radius of a proposed drive's bends, as a multiple of the car's smallest
# turning radius. It is above 1, because the drive may be on a slope and its
# numbers are rounded.
_MARGIN = 1.01
# Distance between the places where bends and room are checked [m].
_CHECK_SPACING = 0.25
# Curvatures below this count as this, because a radius must be finite [1/m].
_STRAIGHTEST = 1e-12
# Least length of a proposed drive [m].
SHORTEST = 80.0
# The place (2,) of an obstacle: a bend that is too tight, or no room [m].
Obstacle = np.ndarray
# Takes places (N, 2) along a path [m]. Returns the first place (2,) without
# room for a car, or None.
Room = Callable[[np.ndarray], np.ndarray | None]
# Greatest distance between waypoints, so that the drive follows the ground, and
# least distance of additional waypoints from corners [m].
_WAYPOINT_SPACING = 15.0
# Tolerances of waypoints relative to the path that was found, tried in turn
# [m].
_TOLERANCES = (1.5, 1.0, 0.7, 2.0, 3.0)
# Numbers of places in the running mean that smooths a line, tried in turn; the
# values were found by trial.
_MEAN_WINDOWS = (5, 11, 17)
# A line is smoothed only if it has at least this many times as many places as
# the running mean.
_LEAST_WINDOWS = 4


@dataclass(frozen=True)
class WaypointRoute:
    """The route of a drive through an imported city.

    Attributes:
        waypoints: (N, 2) or (N, 3) places through which the car drives [m].
        path: (M, 2) closely spaced places on the path [m].
        limit: usual speed limit along the path [m/s]; None without one.
    """

    waypoints: np.ndarray
    path: np.ndarray
    limit: float | None = None

    @property
    def length(self) -> float:
        """Horizontal length of the drive [m]."""
        return length_of(self.path)


def steerable_drive(
    waypoints: np.ndarray, room: Room | None = None, margin: float = _MARGIN
) -> WaypointRoute | Obstacle:
    """Returns the drive along waypoints, or the place (2,) of its failure.

    A drive fails at an obstacle, or at a bend that is too tight for the car. If
    a drive is too short, the result is the place in the middle of the drive.

    Args:
        waypoints: (N, 2) or (N, 3) places [m].
        room: function that takes places (M, 2) along the path, and returns the
            first place with an obstacle, or None; by default there are no
            obstacles.
        margin: least radius of a bend, as a multiple of the car's smallest
            turning radius.
    """
    waypoints = np.round(waypoints, 3)
    xyz = np.zeros((len(waypoints), 3))
    xyz[:, : waypoints.shape[1]] = waypoints
    try:
        points = make_waypoint_path(xyz, POINT_SPACING).points[:, :2]
    except InputError:
        return xyz[len(xyz) // 2, :2]
    driven, radii = driven_path(points)
    tightest = int(np.round(radii, 6).argmin())
    if radii[tightest] < margin * TIGHTEST_RADIUS:
        return driven[tightest]
    missing = None if room is None else room(driven)
    if missing is not None:
        return missing
    drive = WaypointRoute(waypoints, points)
    return drive if drive.length >= SHORTEST else points[len(points) // 2]


def evenly_spaced(line: np.ndarray, spacing: float) -> np.ndarray:
    """Returns places (N, D) along a line (M, D), about `spacing` apart [m].

    Ends of the line are kept.
    """
    along = distances_along(line)
    count = max(1, round(round(along[-1] / spacing, 6)))
    wanted = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(wanted, along, x) for x in line.T])


def driven_path(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns places (M, 2) along a path, and the radii (M,) of its bends [m].

    The path is a spline; `points` (N, 2) are its evenly spaced control points
    [m].
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
    count = int((last - first) * POINT_SPACING / _CHECK_SPACING) + 1
    u = np.linspace(first, last, count)
    (x1, y1), (x2, y2) = spline(u, 1).T, spline(u, 2).T
    curvature = np.abs(x1 * y2 - y1 * x2) / power(np.hypot(x1, y1), 3)
    return spline(u), 1.0 / np.maximum(curvature, _STRAIGHTEST)


def simplified_drive(
    xy: np.ndarray,
    space: FreeSpace,
    tolerances: Sequence[float] = _TOLERANCES,
) -> WaypointRoute | Obstacle:
    """Returns a drive with few waypoints along a line, if one is possible.

    The tolerances are tried one after the other, until a drive stays in the
    free space and has no bend that is too tight for the car. If there is no
    such drive, the result is the place (2,) of the obstacle or bend in the
    last attempt [m]; see `steerable_drive`.

    Args:
        xy: (N, 2) places on the line, about 1 m apart [m].
        space: the free space.
        tolerances: distances by which the drive may deviate from the line [m].
    """
    drive: WaypointRoute | Obstacle = xy[len(xy) // 2]
    for window, tolerance in product(_MEAN_WINDOWS, tolerances):
        if len(xy) < _LEAST_WINDOWS * window:
            break
        smooth = sliding_window_view(xy, window, axis=0).mean(axis=-1)
        line = LineString(smooth).simplify(tolerance)
        drive = steerable_drive(
            _dense_waypoints(np.array(line.coords)), space.obstacle
        )
        if isinstance(drive, WaypointRoute):
            break
    return drive


def _dense_waypoints(corners: np.ndarray) -> np.ndarray:
    """Returns waypoints (N, 2) at corners and between corners far apart [m]."""
    points = [corners[:1]]
    for a, b in pairwise(corners):
        length = length_of(np.array([a, b]))
        number = int(round(length, 6) // _WAYPOINT_SPACING - 1)
        if number > 0:
            # Waypoints keep away from the corners, whose arcs need room.
            parts = np.linspace(0.0, 1.0, number + 2)[1:-1]
            points.append(a + parts[:, None] * (b - a))
        points.append(b[None])
    return np.concatenate(points)


def with_ground_heights(
    drives: Iterable[WaypointRoute],
    height: Callable[[np.ndarray], np.ndarray],
    faults: ImportFaults,
) -> list[WaypointRoute]:
    """Returns drives whose waypoints have the heights of the ground.

    A drive is left out and counted if a bend on a slope is too tight for a car.

    Args:
        drives: the drives.
        height: function that returns the heights (N,) of the ground at places
            (N, 2) [m].
        faults: counts the drives that are left out.
    """
    with_heights = []
    for drive in drives:
        xy = np.round(drive.waypoints, 3)
        waypoints = np.column_stack([xy, height(xy)])
        if isinstance(steerable_drive(waypoints, margin=1.0), WaypointRoute):
            with_heights.append(replace(drive, waypoints=waypoints))
        else:
            faults.add("drive too tight on its slope, left out", "drive")
    return with_heights
