"""Lane changes by the model MOBIL (Kesting, Treiber, Helbing, 2007).

A driver changes lanes if the driver gains more acceleration than other drivers
lose, and no other vehicle has to brake hard.
"""

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.car_following import (
    HARDEST_BRAKING,
    free_acceleration,
    interaction,
)
from cns_drake.traffic.occupants import EGO, find_ahead
from cns_drake.traffic.streets import is_ego_far, speed_on
from cns_drake.traffic.vehicle_records import CURRENT, Traffic

# A driver considers a change of lanes once in this many steps.
_THINKS = 10
# MOBIL's politeness: the weight of the other driver's loss.
_POLITENESS = 0.2
# MOBIL's threshold: the least gain of a change [m/s^2].
_LEAST_GAIN = 0.25
# MOBIL's safe braking: the hardest of the vehicle that will be behind [m/s^2].
_SAFE_BRAKING = 2.5
# Duration of a change of lanes [s].
_CHANGE_DURATION = 4.0
# Least length of a change of lanes [m].
_LEAST_CHANGE = 20.0
# Least length of the lane that remains behind the change [m].
_LEFT_BEHIND_CHANGE = 30.0
# Least speed during a change of lanes [m/s].
_LEAST_CHANGE_SPEED = 3.0
# Least gap to vehicles in the other lane [m].
_CHANGE_GAP = 4.0


@compiled
def change_lanes(traffic: Traffic, k: int) -> None:
    """Starts a lane change of at most one vehicle in the k-th time step."""
    cars, pieces = traffic.cars, traffic.streets.pieces
    for i in range(len(cars)):
        car = cars[i]
        lane = car.path[CURRENT]
        if (
            car.guided
            or (k + i) % _THINKS != 0
            or pieces[lane].is_way
            or car.granted
            or car.left_lane >= 0
            or car.v < _LEAST_CHANGE_SPEED
            or car.s < car.length + 2.0
        ):
            continue
        length = max(_LEAST_CHANGE, _CHANGE_DURATION * car.v)
        left = pieces[lane].length - car.s
        if left < length + car.length + _LEFT_BEHIND_CHANGE:
            continue
        for target in (pieces[lane].left, pieces[lane].right):
            if target >= 0 and _is_better(traffic, k, i, target):
                # The vehicle keeps its speed; only its lane is shorter or
                # longer.
                scale = pieces[target].length / pieces[lane].length
                car.s *= scale
                car.v *= scale
                car.path[CURRENT] = target
                car.path[CURRENT + 1] = car.path[CURRENT + 2] = -1
                car.since = np.inf
                car.left_lane = lane
                # The change begins at the front axle.
                car.change_start, car.change_length = car.s, length
                return


@compiled
def _is_better(traffic: Traffic, k: int, i: int, target: int) -> bool:
    """Returns whether the i-th vehicle gains by a change to a lane.

    Args:
        traffic: vehicles and crossings.
        k: number of the current time step.
        i: number of the vehicle.
        target: number of the lane.
    """
    streets, cars = traffic.streets, traffic.cars
    car = cars[i]
    lane, v = car.path[CURRENT], car.v
    scale = streets.pieces[target].length / streets.pieces[lane].length
    there = car.s * scale
    if streets.until[k, target] == 0.0 or not is_ego_far(
        streets, k, target, there
    ):
        return False
    rear = there - car.length
    # The next vehicle behind. No vehicle may be beside it, ahead or behind.
    behind = np.inf
    who = -2
    is_beside = False
    at = traffic.head[target]
    while at >= 0:
        other = traffic.entries[at]
        gap = rear - other.front
        if other.who != i and other.rear <= rear and gap < behind:
            behind, who = gap, other.who
        is_beside |= (
            other.rear < there + _CHANGE_GAP
            and other.front > rear - _CHANGE_GAP
        )
        at = other.after
    gap, speed = find_ahead(traffic, target, there, i)
    if gap < _CHANGE_GAP or behind < _CHANGE_GAP or who == EGO or is_beside:
        return False
    free = free_acceleration(
        car, min(car.top, car.factor * speed_on(streets, lane, car.s))
    )
    new = max(free - interaction(car, gap, v - speed), -HARDEST_BRAKING)
    gap, speed = find_ahead(traffic, lane, car.s, i)
    old = max(free - interaction(car, gap, v - speed), -HARDEST_BRAKING)
    cost = 0.0
    if who >= 0:
        it = cars[who]
        free = free_acceleration(
            it, min(it.top, it.factor * speed_on(streets, target, it.s))
        )
        gap, speed = find_ahead(traffic, target, rear - behind, who)
        now = max(free - interaction(it, gap, it.v - speed), -HARDEST_BRAKING)
        then = max(free - interaction(it, behind, it.v - v), -HARDEST_BRAKING)
        if then < -_SAFE_BRAKING:
            return False
        cost = now - then
    return new - old > _LEAST_GAIN + _POLITENESS * cost
