"""Poses of vehicles whose axles follow their lanes."""

from collections.abc import Sequence

import numpy as np

from cns_drake.base.elementary import arcsin, arctan2
from cns_drake.traffic.streets import Streets, places_on
from cns_drake.traffic.vehicle_records import CURRENT


def vehicle_poses(streets: Streets, cars: np.ndarray) -> np.ndarray:
    """Returns the poses (..., 5) of vehicles.

    A pose consists of x, y, z of the centre of the box's base on the ground
    [m], yaw and pitch [rad].

    Args:
        streets: the lanes on which the vehicles are.
        cars: (...) records of dtype `VEHICLE`.
    """
    half = 0.5 * cars["length"]
    front = _points_behind(streets, cars, half - cars["front_axle"])
    rear = _points_behind(streets, cars, half - cars["rear_axle"])
    x, y, z = (a - b for a, b in zip(front, rear, strict=True))
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    middle = [
        place - cars["rear_axle"] * ahead
        for place, ahead in zip(rear, (x, y, z), strict=True)
    ]
    return np.stack([*middle, arctan2(y, x), -arcsin(z)], axis=-1)


def _points_behind(
    streets: Streets, cars: np.ndarray, back: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Returns x, y, z at a distance `back` behind each front bumper [m].

    Args:
        streets: arrays of all lanes.
        cars: (...) records of dtype `VEHICLE`.
        back: (...) distances along the vehicles' paths [m].
    """
    s = cars["s"] - back
    path = cars["path"]
    column = np.full(cars.shape, CURRENT)

    def piece_in(column: np.ndarray) -> np.ndarray:
        return np.take_along_axis(path, column[..., None], -1)[..., 0]

    for _ in range(CURRENT):
        before = piece_in(np.maximum(column - 1, 0))
        is_before = (s < 0.0) & (column > 0) & (before >= 0)
        s = np.where(is_before, s + streets.pieces["length"][before], s)
        column -= is_before
    piece = piece_in(column)
    places = places_on(streets, piece, s)
    changing = (column == CURRENT) & (cars["left_lane"] >= 0)
    blended = _blended_with_left_lane(
        streets,
        cars[changing],
        piece[changing],
        s[changing],
        back[changing],
        [place[changing] for place in places],
    )
    for place, between in zip(places, blended, strict=True):
        place[changing] = between
    return places


def _blended_with_left_lane(
    streets: Streets,
    cars: np.ndarray,
    piece: np.ndarray,
    s: np.ndarray,
    back: np.ndarray,
    places: Sequence[np.ndarray],
) -> list[np.ndarray]:
    """Returns x, y, z of places between the former and the new lane [m].

    Args:
        streets: the lanes.
        cars: (M,) records of vehicles that change lanes.
        piece: (M,) number of each vehicle's new lane.
        s: (M,) distance of each place along the new lane [m].
        back: (M,) distance of each place behind the front bumper [m].
        places: x, y, z of the places on the new lane, each (M,) [m].
    """
    u = (s - cars["change_start"]) / cars["change_length"]
    u = np.minimum(np.maximum(u, 0.0), 1.0)
    # The quintic of `base.elementary.smooth_step`, but without powers, which
    # are slow and round in another way.
    share = u * u * u * (10.0 - 15.0 * u + 6.0 * (u * u))
    lengths = streets.pieces["length"]
    scale = lengths[cars["left_lane"]] / lengths[piece]
    there = cars["s"] * scale - back
    return [
        before + share * (place - before)
        for place, before in zip(
            places,
            places_on(streets, cars["left_lane"], there),
            strict=True,
        )
    ]
