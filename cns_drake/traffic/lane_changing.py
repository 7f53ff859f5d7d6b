"""Changes of lane: MOBIL, by Kesting, Treiber, Helbing (2007).

A driver changes lane if that gains more acceleration than it costs others, and
no other vehicle has to brake hard.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.car_following import idm_acceleration
from cns_drake.traffic.lane_arrays import LaneArrays, speed_on
from cns_drake.traffic.presence import Presence
from cns_drake.traffic.right_of_way import is_ego_far
from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP
from cns_drake.traffic.vehicle_state import (
    CURRENT,
    EGO,
    Occupants,
    Vehicles,
    find_ahead,
    find_behind,
)

# Politeness, least gain, and the most that others brake [m/s^2].
_POLITENESS, _GAIN, _OTHERS_BRAKE = 0.2, 0.25, 2.5
# Duration of a change [s], its least length, and least rest of the lane behind
# it [m].
_DURATION, _LEAST_LENGTH, _BEYOND = 4.0, 20.0, 30.0
# Least speed of a change [m/s], and least gap [m].
_SLOWEST, _GAP = 3.0, 4.0


@compiled
def change_lanes(
    lanes: LaneArrays,
    vehicles: Vehicles,
    occupants: Occupants,
    presence: Presence,
    k: int,
    every: int,
) -> None:
    """Begins the change of lane of one vehicle at most.

    Args:
        lanes: all of them.
        vehicles: all of them.
        occupants: where they are.
        presence: of the ego car.
        k: number of the time.
        every: number of times between a vehicle's considerations.
    """
    for i in range(len(vehicles.s)):
        lane = vehicles.path[i, CURRENT]
        if (
            (k + i) % every != 0
            or lanes.is_way[lane]
            or vehicles.granted[i]
            or vehicles.left_lane[i] >= 0
            or vehicles.v[i] < _SLOWEST
            or vehicles.s[i] < vehicles.length[i] + 2.0
        ):
            continue
        length = max(_LEAST_LENGTH, _DURATION * vehicles.v[i])
        left = lanes.length[lane] - vehicles.s[i]
        if left < length + vehicles.length[i] + _BEYOND:
            continue
        for side in range(2):
            target = lanes.left[lane] if side == 0 else lanes.right[lane]
            if target >= 0 and _is_better(
                lanes, vehicles, occupants, presence, k, i, target
            ):
                scale = lanes.length[target] / lanes.length[lane]
                vehicles.s[i] *= scale
                vehicles.path[i, CURRENT] = target
                vehicles.path[i, CURRENT + 1] = -1
                vehicles.path[i, CURRENT + 2] = -1
                vehicles.since[i] = np.inf
                vehicles.left_lane[i] = lane
                # The change begins with the front axle.
                vehicles.change_start[i] = vehicles.s[i]
                vehicles.change_length[i] = length
                return


@compiled
def _is_better(
    lanes: LaneArrays,
    vehicles: Vehicles,
    occupants: Occupants,
    presence: Presence,
    k: int,
    i: int,
    target: int,
) -> bool:
    lane = vehicles.path[i, CURRENT]
    s, v = vehicles.s[i], vehicles.v[i]
    scale = lanes.length[target] / lanes.length[lane]
    there = s * scale
    if presence.until[k, target] == 0.0 or not is_ego_far(
        lanes, presence, k, target, there
    ):
        return False
    a, b, T = vehicles.a[i], vehicles.b[i], vehicles.headway[i]
    wanted = min(vehicles.top[i], vehicles.factor[i] * speed_on(lanes, lane, s))
    gap, speed = find_ahead(occupants, target, there, i)
    rear = there - vehicles.length[i]
    behind, _, who = find_behind(occupants, target, rear, i)
    if gap < _GAP or behind < _GAP or who == EGO:
        return False
    # No vehicle may be beside it, neither ahead nor behind.
    entry = occupants.head[target]
    while entry >= 0:
        if (
            occupants.rear[entry] < there + _GAP
            and occupants.front[entry] > rear - _GAP
        ):
            return False
        entry = occupants.after[entry]
    new = idm_acceleration(v, wanted, gap, v - speed, a, b, STANDSTILL_GAP, T)
    old_gap, old_speed = find_ahead(occupants, lane, s, i)
    old = idm_acceleration(
        v, wanted, old_gap, v - old_speed, a, b, STANDSTILL_GAP, T
    )
    cost = 0.0
    if who >= 0:
        u = vehicles.v[who]
        free = min(
            vehicles.top[who],
            vehicles.factor[who] * speed_on(lanes, target, vehicles.s[who]),
        )
        its = (vehicles.a[who], vehicles.b[who], vehicles.headway[who])
        before, ahead = find_ahead(
            occupants, target, there - vehicles.length[i] - behind, who
        )
        now = idm_acceleration(
            u, free, before, u - ahead, its[0], its[1], STANDSTILL_GAP, its[2]
        )
        then = idm_acceleration(
            u, free, behind, u - v, its[0], its[1], STANDSTILL_GAP, its[2]
        )
        if then < -_OTHERS_BRAKE:
            return False
        cost = now - then
    return new - old > _GAIN + _POLITENESS * cost
