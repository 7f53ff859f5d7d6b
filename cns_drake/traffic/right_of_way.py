"""The right to enter a junction: one after the other, by arrival.

A vehicle may enter its whole way under three conditions: no crossing way is in
use or about to be used, there is room for it behind the way, and its signal is
green. Vehicles never stop on a way, so that none waits for ever.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.counted_random import uniform
from cns_drake.traffic.lane_arrays import LaneArrays
from cns_drake.traffic.presence import Presence
from cns_drake.traffic.vehicle_state import CURRENT, Occupants, Vehicles

# Signals: duration of a green phase, and of red for all after it [s].
_GREEN, _RED = 14.0, 4.0
# Traffic ahead of the ego car, if it comes within this time, goes first and
# does not wait for signals [s].
_EGO_IS_NEAR = 45.0
_GOES_FIRST = 1e6
# No vehicle enters a way if the ego car will be there within this time [s].
_EGO_MARGIN = 3.0
# A lane must be empty when the ego car enters it. Drivers assume this part of
# the speed limit, and this wait at its end; a driver who goes first waits less
# [s].
_SLOW_PART, _WAIT, _SHORT_WAIT = 0.6, 20.0, 5.0
# Gap between standing vehicles [m], and greatest braking of the last one
# [m/s^2].
_ROOM, _LAST_BRAKES = 2.5, 4.0
# Drivers request their way from this distance [m], or from this multiple of
# their braking distance.
_ASKED_FROM, _ASKED_BRAKING = 10.0, 1.4
# After this time without room, a driver takes another way [s].
_PATIENCE = 3.0
# Time for a group of walkers to start [s], their assumed speed [m/s], and
# reserve [s].
WALK_GROUP = 3.0
_WALKING, _DAWDLING = 1.0, 3.0
# Time for vehicles after a group has left a crossing [s].
_REST = 12.0


class Permits(NamedTuple):
    """The users of the P pieces and C crossings.

    Attributes:
        small, large: (P + C,) number of small and large vehicles with a permit
            for a way; walkers are small.
        waits: (C,) time since which walkers wait at a crossing, inf for none
            [s].
        opened: (C,) time at which a crossing was opened [s].
        closed: (C,) time at which it was last left [s].
        lengths: (C,) of the crossings [m].
    """

    small: np.ndarray
    large: np.ndarray
    waits: np.ndarray
    opened: np.ndarray
    closed: np.ndarray
    lengths: np.ndarray


@compiled
def choose_way(
    vehicles: Vehicles, lanes: LaneArrays, i: int, seed: int
) -> None:
    """Draws the next way of a vehicle that is in a lane."""
    lane = vehicles.path[i, CURRENT]
    count = lanes.after_count[lane]
    vehicles.draws[i] += 1
    pick = int(uniform(seed, i, vehicles.draws[i]) * count)
    way = lanes.after[lanes.after_first[lane] + min(pick, count - 1)]
    vehicles.path[i, CURRENT + 1] = way
    vehicles.path[i, CURRENT + 2] = lanes.after[lanes.after_first[way]]


@compiled
def is_green(lanes: LaneArrays, way: int, t: float) -> bool:
    """Returns whether the signal of a way is green, or absent."""
    phase = lanes.phase[way]
    if phase < 0:
        return True
    count = lanes.phases[lanes.junction[way]]
    cycle = (_GREEN + _RED) * count
    # Junctions switch at different times.
    at = (t + 7.0 * lanes.junction[way]) % cycle
    return phase * (_GREEN + _RED) <= at < phase * (_GREEN + _RED) + _GREEN


@compiled
def is_ego_far(
    lanes: LaneArrays,
    presence: Presence,
    k: int,
    lane: int,
    s: float,
    wait: float = _WAIT,
) -> bool:
    """Returns whether a vehicle can leave a lane before the ego car is there.

    Args:
        lanes: all of them.
        presence: of the ego car.
        k: number of the time.
        lane: the lane.
        s: distance of the vehicle along it [m].
        wait: its possible wait at the lane's end [s].
    """
    until = presence.until[k, lane]
    if until == 0.0:
        # A vehicle may follow behind the ego car.
        return presence.speed[k, lane] >= 0.0 and (
            presence.rear[k, lane] > s + 2.0
        )
    speed = _SLOW_PART * lanes.speed[lanes.first[lane]]
    return until > (lanes.length[lane] - s) / speed + wait


@compiled
def room_beyond(
    lanes: LaneArrays,
    vehicles: Vehicles,
    occupants: Occupants,
    lane: int,
    i: int,
) -> float:
    """Returns the room that is left for a vehicle in a lane [m]."""
    rear = lanes.length[lane]
    entry = occupants.head[lane]
    while entry >= 0:
        who = occupants.who[entry]
        if who != i and occupants.rear[entry] >= 0.0:
            speed = max(occupants.speed[entry], 0.0)
            rear = min(
                rear, occupants.rear[entry] + speed**2 / (2 * _LAST_BRAKES)
            )
        entry = occupants.after[entry]
    for j in range(len(vehicles.s)):
        if j == i:
            continue
        current = vehicles.path[j, CURRENT]
        comes = (
            (vehicles.granted[j] and vehicles.path[j, CURRENT + 2] == lane)
            or (lanes.is_way[current] and vehicles.path[j, CURRENT + 1] == lane)
            or (current == lane and vehicles.s[j] < vehicles.length[j])
        )
        if comes:
            rear -= vehicles.length[j] + _ROOM
    return rear


@compiled
def is_taken(
    lanes: LaneArrays, permits: Permits, place: int, is_large: bool
) -> bool:
    """Returns whether a conflicting way or crossing is in use."""
    for other in range(len(permits.small)):
        small, large = permits.small[other], permits.large[other]
        if small == 0 and large == 0:
            continue
        matrix = lanes.large if is_large or large > 0 else lanes.small
        if matrix[place, other]:
            return True
    return False


@compiled
def grant_ways(
    lanes: LaneArrays,
    vehicles: Vehicles,
    occupants: Occupants,
    presence: Presence,
    permits: Permits,
    k: int,
    dt: float,
    seed: int,
) -> None:
    """Gives permits in the order of arrival."""
    t = k * dt
    num_vehicles, num_pieces = len(vehicles.s), len(lanes.first)
    num_crossings = len(permits.waits)
    first = np.full(num_pieces, -1)
    for i in range(num_vehicles):
        lane = vehicles.path[i, CURRENT]
        if not lanes.is_way[lane] and not vehicles.granted[i]:
            best = first[lane]
            if best < 0 or vehicles.s[i] > vehicles.s[best]:
                first[lane] = i
    since = np.full(num_vehicles + num_crossings, np.inf)
    for lane in range(num_pieces):
        i = first[lane]
        if i < 0 or vehicles.held[i] >= 0 or vehicles.left_lane[i] >= 0:
            continue
        braking = vehicles.v[i] ** 2 / (2.0 * vehicles.b[i])
        asked_from = max(_ASKED_FROM, _ASKED_BRAKING * braking + 5.0)
        if lanes.length[lane] - vehicles.s[i] <= asked_from:
            if vehicles.since[i] == np.inf:
                vehicles.since[i] = t
            since[i] = vehicles.since[i]
            if 0.0 < presence.until[k, lane] < _EGO_IS_NEAR:
                since[i] = presence.until[k, lane] - _GOES_FIRST
    for c in range(num_crossings):
        since[num_vehicles + c] = permits.waits[c]
    blocked = np.zeros(len(permits.small), np.bool_)
    for who in np.argsort(since):
        if since[who] == np.inf:
            break
        if who >= num_vehicles:
            c = who - num_vehicles
            _open_crossing(lanes, presence, permits, blocked, c, k, t)
        else:
            _grant_way(
                lanes,
                vehicles,
                occupants,
                presence,
                permits,
                blocked,
                who,
                k,
                dt,
                seed,
            )


@compiled
def _open_crossing(
    lanes: LaneArrays,
    presence: Presence,
    permits: Permits,
    blocked: np.ndarray,
    c: int,
    k: int,
    t: float,
) -> None:
    place = len(lanes.first) + c
    if permits.small[place] > 0 or t < permits.closed[c] + _REST:
        return
    needed = permits.lengths[c] / _WALKING + WALK_GROUP + _DAWDLING
    if presence.until[k, place] < needed or blocked[place]:
        return
    if is_taken(lanes, permits, place, False):
        # Later arrivals must not always go first.
        for other in range(len(blocked)):
            blocked[other] |= lanes.small[place, other]
        return
    # A placeholder holds the permit until the group has begun to walk.
    permits.small[place] += 1
    permits.opened[c] = t


@compiled
def _grant_way(
    lanes: LaneArrays,
    vehicles: Vehicles,
    occupants: Occupants,
    presence: Presence,
    permits: Permits,
    blocked: np.ndarray,
    i: int,
    k: int,
    dt: float,
    seed: int,
) -> None:
    lane = vehicles.path[i, CURRENT]
    if vehicles.path[i, CURRENT + 1] < 0:
        choose_way(vehicles, lanes, i, seed)
    way = vehicles.path[i, CURRENT + 1]
    beyond = vehicles.path[i, CURRENT + 2]
    is_ego_near = 0.0 < presence.until[k, lane] < _EGO_IS_NEAR
    if not is_ego_near and not is_green(lanes, way, k * dt):
        return
    distance = lanes.length[lane] - vehicles.s[i] + lanes.length[way]
    pace = max(3.0, 0.5 * lanes.speed[lanes.first[way]])
    needed = (distance + vehicles.length[i]) / pace + _EGO_MARGIN
    has_room = (
        presence.until[k, way] > needed
        and is_ego_far(
            lanes,
            presence,
            k,
            beyond,
            0.0,
            _SHORT_WAIT if is_ego_near else _WAIT,
        )
        and room_beyond(lanes, vehicles, occupants, beyond, i)
        >= vehicles.length[i] + _ROOM
    )
    if not has_room:
        vehicles.refused[i] += dt
        if vehicles.refused[i] > _PATIENCE or is_ego_near:
            vehicles.refused[i] = 0.0
            choose_way(vehicles, lanes, i, seed)
        return
    if blocked[way]:
        return
    large = vehicles.large[i]
    if is_taken(lanes, permits, way, large):
        for other in range(len(blocked)):
            blocked[other] |= (
                lanes.large[way, other] if large else (lanes.small[way, other])
            )
        return
    vehicles.granted[i] = True
    vehicles.held[i] = way
    vehicles.since[i] = np.inf
    vehicles.refused[i] = 0.0
    if large:
        permits.large[way] += 1
    else:
        permits.small[way] += 1
