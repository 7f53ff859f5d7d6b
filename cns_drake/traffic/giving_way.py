"""Whom vehicles on their path let pass: pedestrians, and earlier vehicles."""

from typing import Any

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.conflicts import MERGE, SPLIT
from cns_drake.traffic.streets import Streets
from cns_drake.traffic.vehicle_records import CURRENT, NUM_PIECES, Traffic

# Small, and large, vehicles may pass a pedestrian whose middle is this far
# beyond the middle of their way [m].
_PASSED = (2.0, 3.5)


@compiled
def is_walked(traffic: Traffic, c: int, way: int, is_large: bool) -> bool:
    """Returns whether pedestrians have yet to cross the path of a vehicle.

    Args:
        traffic: the traffic.
        c: number of the crossing.
        way: number of the vehicle's piece that leads over the crossing: a path
            through a junction, or a lane.
        is_large: whether the vehicle is large.
    """
    one, place = traffic.crossings[c], traffic.streets.over[way, c]
    passed = _PASSED[int(is_large)]
    return one.order != 0 and not (
        place + passed < one.to_end and place - passed > one.to_start
    )


@compiled
def first_lane_at_crossing(
    streets: Streets, car: Any, c: int
) -> tuple[int, float, float]:
    """Returns where a vehicle's path along lanes meets an unmarked crossing.

    Args:
        streets: arrays of all lanes.
        car: the vehicle, a record of dtype `VEHICLE`.
        c: number of the crossing.

    Returns:
        Number of the first lane on the vehicle's path that meets the crossing;
        the distance that the vehicle drives until its front reaches the
        crossing [m]; and the distance until the vehicle's rear has left the
        crossing [m]. Without such a lane, the result is -1, inf and inf.
    """
    begin = -car.s
    # Crossings are numbered after all pieces in the arrays of conflicts.
    number = len(streets.pieces) + c
    for column in range(CURRENT, NUM_PIECES):
        piece = car.path[column]
        if piece < 0:
            break
        row = streets.pieces[piece]
        # On a lane, large vehicles (index 1) meet a crossing at the same places
        # as small ones (index 0).
        enters = streets.begin[0, piece, number]
        if enters < np.inf and not row.is_way:
            leaves = streets.clear[0, piece, number] + car.length
            return piece, begin + enters, begin + leaves
        begin += row.length
    return -1, np.inf, np.inf


@compiled
def find_prior(traffic: Traffic, i: int) -> tuple[float, float, float]:
    """Returns where vehicle i must stop, and which vehicle it must follow.

    The i-th vehicle stops before any crossing that pedestrians use, whether the
    crossing lies in a junction or not. The i-th vehicle also stops where its
    path through a junction meets the path of a vehicle that was permitted to
    enter earlier and has not yet passed this place. If both vehicles come from
    the same lane, or leave for the same lane, the i-th vehicle follows the
    earlier vehicle instead. Vehicles wait only for vehicles that were permitted
    earlier, so no vehicle waits forever.

    Args:
        traffic: all vehicles and crossings.
        i: number of the vehicle.

    Returns:
        The distance to the place where the vehicle must stop [m], inf for none;
        the gap to the vehicle that it must follow [m], inf for none; and the
        speed of the followed vehicle [m/s].
    """
    line = np.inf
    gap = np.inf
    speed = 0.0
    streets, cars, crossings = traffic.streets, traffic.cars, traffic.crossings
    car = cars[i]
    pieces = streets.pieces
    for c in range(len(crossings)):
        if crossings[c].order > 0 and not crossings[c].marked:
            lane, enters, _ = first_lane_at_crossing(streets, car, c)
            if enters >= 0.0 and is_walked(traffic, c, lane, car.large):
                line = min(line, enters)
    way = car.held
    if way < 0:
        return line, gap, speed
    if car.path[CURRENT] == way:
        front = car.s
    elif car.path[CURRENT + 1] == way:
        front = car.s - pieces[car.path[CURRENT]].length
    else:
        return line, gap, speed
    for c in range(len(crossings)):
        place = streets.begin[int(car.large), way, len(pieces) + c]
        if (
            front <= place < np.inf
            and crossings[c].order < car.order
            and is_walked(traffic, c, way, car.large)
        ):
            line = min(line, place - front)
    for j in range(len(cars)):
        other = cars[j]
        if j == i or other.held < 0 or other.order > car.order:
            continue
        size = int(car.large or other.large)
        place = streets.begin[size, way, other.held]
        rear = rear_on_way(streets, other)
        if place == np.inf or rear >= streets.clear[size, other.held, way]:
            continue
        kind = streets.joint[size, way, other.held]
        if kind == MERGE:
            rear += pieces[way].length - pieces[other.held].length
        if kind in (SPLIT, MERGE) and rear > place:
            if rear - front < gap:
                gap, speed = rear - front, other.v
        else:
            line = min(line, place - front)
    return line, gap, speed


@compiled
def rear_on_way(streets: Streets, car: Any) -> float:
    """Returns how far a vehicle's rear is along a path in a junction [m].

    The result is negative if the rear has not reached the junction.

    Args:
        streets: arrays of all lanes and paths in junctions.
        car: the vehicle, a record of dtype `VEHICLE`. The path is the path that
            is reserved for this vehicle, in the record's field `held`.
    """
    rear = car.s - car.length
    if car.path[CURRENT] == car.held:
        return rear
    if car.path[CURRENT - 1] == car.held:
        return rear + streets.pieces[car.held].length
    return rear - streets.pieces[car.path[CURRENT]].length
