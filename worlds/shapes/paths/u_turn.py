"""U-turns: the tightest loops that a car's steering allows."""

from collections.abc import Callable
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry

from evaluation.base import cos, dot, sin
from worlds.shapes.paths.car_outline import swept_area
from worlds.shapes.paths.centreline import Centreline, sample_stations

# From the simulator's car, `vehicle.sdf`: its wheelbase [m].
_WHEELBASE = 2.8
# Distance from the car's middle to a front wheel [m].
_HALF_TRACK = 0.79
# Greatest steering angle of the inner wheel [rad].
_STEERING_LIMIT = 0.7
# Tightest radius on which the middle of the rear axle can drive [m].
TIGHTEST_RADIUS = float(_WHEELBASE / math.tan(_STEERING_LIMIT) + _HALF_TRACK)
# Radius of planned loops; smoothing makes the curve slightly tighter [m].
LOOP_RADIUS = 4.4
# Distance between the points of a loop, at which the car must fit [m].
_STEP = 0.25
# Radius of a dead end that has room for the loop of every street [m].
_DEAD_END_RADIUS = 8.0


def loop_corners(
    centre: ArrayLike,
    heading_in: float,
    heading_out: float,
    radius: float,
    aside_in: float,
    aside_out: float,
) -> np.ndarray:
    """Returns the corners of a line along which a car turns round to the left.

    If all corners are rounded with the same radius, the path is smooth. The car
    first swings out to the right of the line on which it arrives. The car then
    turns left around the centre, by more than 90 degrees. Finally, the car
    comes from the right of the line on which it leaves, and joins this line.

    Args:
        centre: (2,) centre of the loop [m].
        heading_in, heading_out: directions of the lines on which the car
            arrives and leaves [rad].
        radius: radius of the loop, and of the bends at both ends [m].
        aside_in, aside_out: distance of the centre to the left of each line, at
            most the radius [m].

    Returns:
        (N, 2) corners [m].
    """
    swing_in = math.acos(min(1.0, (radius + aside_in) / (2 * radius)))
    swing_out = math.acos(min(1.0, (radius + aside_out) / (2 * radius)))
    turn = (heading_out - heading_in) % (2 * np.pi)
    share = (turn + swing_in + swing_out) / 3
    # The corners of the loop lie outside its circle.
    first = heading_in - swing_in - np.pi / 2 + share / 2
    angles = first + share * np.arange(3)
    reach = radius / math.cos(share / 2)
    centre = np.asarray(centre)
    corners = [centre + reach * np.column_stack([cos(angles), sin(angles)])]
    for swing, heading, aside, sign in (
        (swing_in, heading_in, aside_in, -1.0),
        (swing_out, heading_out, aside_out, 1.0),
    ):
        if swing > 1e-6:
            along = np.array([math.cos(heading), math.sin(heading)])
            right = np.array([along[1], -along[0]])
            # The bend begins 2 r sin(a) before the centre, and its corner is r
            # tan(a / 2) further on.
            before = 2 * math.sin(swing) - math.tan(swing / 2)
            corner = centre + sign * before * radius * along + aside * right
            corners.insert(0 if sign < 0 else len(corners), corner[None])
    return np.concatenate(corners)


class UTurn(NamedTuple):
    """A car's U-turn into the opposite lane.

    Attributes:
        begin: distance along the lane at which the loop begins [m].
        points: (N, 2) points of the loop, from `begin` to the place beside
            `begin` in the opposite lane [m].
    """

    begin: float
    points: np.ndarray


def find_u_turn(
    lanes_at: Callable[[float], tuple[np.ndarray, float]],
    centres: np.ndarray,
    area: BaseGeometry,
) -> UTurn:
    """Returns a U-turn into the opposite lane that fits into an area.

    Several places along the lane are tried, and the first place with enough
    room is chosen.

    Args:
        lanes_at: function that takes a distance along the lane [m], and returns
            the pose at this distance: x, y [m] and heading [rad], (3,); and the
            distance to the opposite lane on the left [m].
        centres: (N,) distances along the lane at which the centre of the loop
            may be, in the order in which they are tried [m].
        area: the area in which the whole car must stay.

    Raises:
        ValueError: there is no room; the message says how much is needed.
    """
    shapely.prepare(area)
    needed = np.inf
    widest = 0.0
    for centre in centres:
        begin = float(centre) - _centre_distance(lanes_at(float(centre))[1])
        (x, y, heading), width = lanes_at(begin)
        points = _loop_points(np.array([x, y]), heading, width)
        swept = swept_area(points)
        if area.covers(swept):
            return UTurn(begin, points)
        middle = _loop_centre(np.array([x, y]), heading, width)
        left = np.array([-math.sin(heading), math.cos(heading)])
        sideways = dot(shapely.get_coordinates(swept) - middle, left)
        needed = min(needed, 2 * np.abs(sideways).max())
        place = Point(middle)
        if area.covers(place):
            widest = max(widest, 2 * area.boundary.distance(place))
    raise ValueError(
        f"no room for turning round: the car needs a disc {needed:.1f} m "
        "across, and as much of the lanes before it; the widest disc here "
        f"has {widest:.1f} m; turn where the carriageway is wider, or in a "
        f"dead end of kerb_radius {_DEAD_END_RADIUS:g}"
    )


def _centre_distance(width: float) -> float:
    """Returns how far ahead of its beginning a loop has its centre [m].

    `width` is the distance to the opposite lane [m].
    """
    radius = max(LOOP_RADIUS, width / 2)
    return float(np.sqrt(4 * radius**2 - (radius + width / 2) ** 2))


def _loop_centre(start: np.ndarray, heading: float, width: float) -> np.ndarray:
    """Returns the centre (2,) of a loop that begins at a place (2,) [m].

    The opposite lane is `width` to the left of the lane [m].
    """
    along = np.array([math.cos(heading), math.sin(heading)])
    left = np.array([-along[1], along[0]])
    return start + _centre_distance(width) * along + width / 2 * left


def _loop_points(start: np.ndarray, heading: float, width: float) -> np.ndarray:
    """Returns the points (N, 2) of a loop into the opposite lane [m].

    The loop begins at the place `start` (2,). The opposite lane is `width` to
    the left of the lane [m].
    """
    radius = max(LOOP_RADIUS, width / 2)
    left = np.array([-math.sin(heading), math.cos(heading)])
    centre = _loop_centre(start, heading, width)
    corners = loop_corners(
        centre, heading, heading + np.pi, radius, width / 2, width / 2
    )
    curve = Centreline(
        np.vstack([start, corners, start + width * left]),
        np.full(len(corners), radius),
    )
    return curve.evaluate(sample_stations(0.0, curve.length, _STEP))[:, :2]
