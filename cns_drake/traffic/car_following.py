"""Accelerations of vehicles that follow each other and stop at lines.

Vehicles follow each other by the Intelligent Driver Model of Treiber, Hennecke,
Helbing (see `VehicleKind`).
"""

from typing import Any

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.giving_way import find_prior
from cns_drake.traffic.occupants import find_ahead
from cns_drake.traffic.streets import speed_on
from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP
from cns_drake.traffic.vehicle_records import CURRENT, Traffic

# Greatest braking [m/s^2].
HARDEST_BRAKING = 3.2
# Greatest braking in an emergency [m/s^2].
EMERGENCY_BRAKING = 5.5
# Smaller gaps count as this gap [m].
_NO_GAP = 0.05
# Distance kept from the stop line [m].
BEFORE_LINE = 0.5
# Greatest distance that drivers look ahead [m].
SIGHT = 120.0
# Lower desired speeds count as zero [m/s].
_NO_SPEED = 0.01
# Drivers brake for a slower piece ahead when this share of their comfortable
# braking is needed.
_BRAKES_FROM = 0.6
# At this gap, drivers brake as in an emergency [m].
_LEAST_GAP = 0.5


@compiled
def free_acceleration(car: Any, v0: float) -> float:
    """Returns a vehicle's acceleration on a free road [m/s^2].

    Above the desired speed, the vehicle brakes no harder than is comfortable.

    Args:
        car: the vehicle, a record of dtype `VEHICLE`.
        v0: the vehicle's desired speed [m/s].
    """
    if v0 < _NO_SPEED:
        return -car.b
    return max(car.a * (1.0 - (car.v / v0) ** 4), -car.b)


@compiled
def interaction(car: Any, gap: float, approach: float) -> float:
    """Returns by how much a vehicle ahead reduces the acceleration [m/s^2].

    This is the interaction term of the Intelligent Driver Model,

        a (s* / gap)^2, with s* = s0 + max(0, v T + v dv / (2 sqrt(a b))),

    where s* is the desired gap and s0 = `STANDSTILL_GAP`.

    Args:
        car: the vehicle behind, a record of dtype `VEHICLE`, with speed v,
            headway T, acceleration a and deceleration b.
        gap: gap from bumper to bumper [m].
        approach: dv, the vehicle's speed minus the speed of the vehicle ahead
            [m/s].
    """
    wanted = STANDSTILL_GAP + max(
        0.0,
        car.v * car.headway + car.v * approach / (2.0 * (car.a * car.b) ** 0.5),
    )
    return car.a * (wanted / max(gap, _NO_GAP)) ** 2


@compiled
def accelerations(traffic: Traffic) -> np.ndarray:
    """Returns the accelerations (N,) of all vehicles [m/s^2]."""
    streets, cars = traffic.streets, traffic.cars
    pieces = streets.pieces
    result = np.zeros(len(cars))
    for i in range(len(cars)):
        car = cars[i]
        if car.guided:
            continue
        lane, s, v = car.path[CURRENT], car.s, car.v
        v0 = min(car.top, car.factor * speed_on(streets, lane, s))
        wanted = free_acceleration(car, v0)
        gap, speed = find_ahead(traffic, lane, s, i)
        if car.left_lane >= 0:
            scale = pieces[car.left_lane].length / pieces[lane].length
            gap_2, speed_2 = find_ahead(traffic, car.left_lane, s * scale, i)
            if gap_2 < gap:
                gap, speed = gap_2, speed_2
        column = CURRENT
        begin = pieces[lane].length - s
        line = np.inf
        while begin < SIGHT:
            is_way = pieces[car.path[column]].is_way
            if not is_way and (column > CURRENT or not car.granted):
                line = begin
                break
            column += 1
            piece = car.path[column]
            v1 = min(car.top, car.factor * speed_on(streets, piece, 0.0))
            if v1 < v:
                braking = (v**2 - v1**2) / (2.0 * max(begin, 0.5))
                if braking > _BRAKES_FROM * car.b:
                    wanted = min(wanted, -braking)
            if gap == np.inf:
                gap, speed = find_ahead(traffic, piece, -begin, i)
            begin += pieces[piece].length
        stop, gap_2, speed_2 = find_prior(traffic, i)
        line = min(line, stop)
        if gap_2 < gap:
            gap, speed = gap_2, speed_2
        # The driver brakes as if a vehicle stood behind the stop line.
        loss = interaction(car, line + STANDSTILL_GAP - BEFORE_LINE, v)
        needed = v**2 / (2.0 * max(line, _NO_GAP))
        if gap < SIGHT:
            loss = max(loss, interaction(car, gap, v - speed))
            # The vehicle ahead may brake hard.
            stop = gap - _LEAST_GAP
            stop += max(speed, 0.0) ** 2 / (2.0 * EMERGENCY_BRAKING)
            needed = max(needed, v**2 / (2.0 * max(stop, _NO_GAP)))
        hardest = max(HARDEST_BRAKING, min(needed, EMERGENCY_BRAKING))
        result[i] = max(wanted - loss, -hardest)
    return result
