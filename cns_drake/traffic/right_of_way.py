"""The right to enter a junction: one after the other, by arrival.

A vehicle may enter its whole way under three conditions: no crossing way is in
use or about to be used, there is room for it behind the way, and its signal is
green. Vehicles never stop on a way, so that none waits for ever.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.streets import WAIT, Streets, is_ego_far
from cns_drake.traffic.vehicles import CURRENT, Occupants, choose_way

# Signals: duration of a green phase, and of red for all after it [s].
_GREEN, _RED = 14.0, 4.0
# Traffic ahead of the ego car, if it comes within this time, goes first and
# does not wait for signals [s].
_EGO_IS_NEAR = 45.0
_GOES_FIRST = 1e6
# No vehicle enters a way if the ego car will be there within this time [s].
_EGO_MARGIN = 3.0
# Assumed wait at the end of a lane of a driver who goes first [s].
_SHORT_WAIT = 5.0
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

_CROSSING = np.dtype(
    [
        ("waits", float),  # Time since which walkers wait, inf for none [s].
        ("opened", float),  # Time at which it was opened [s].
        ("closed", float),  # Time at which it was last left [s].
        ("length", float),  # [m]
    ]
)


class Permits(NamedTuple):
    """The users of P pieces and C crossings.

    Attributes:
        users: (P + C, 2) numbers of small and of large vehicles with a permit
            for a way; walkers are small.
        crossings: (C,) records `_CROSSING`.
    """

    users: np.ndarray
    crossings: np.ndarray


def make_permits(graph: LaneGraph) -> Permits:
    """Returns permits without any holder."""
    crossings = np.zeros(len(graph.crossings), _CROSSING)
    crossings["waits"] = np.inf
    crossings["opened"] = crossings["closed"] = -np.inf
    crossings["length"] = [
        np.linalg.norm(one.line[1] - one.line[0]) for one in graph.crossings
    ]
    places = len(graph.pieces) + len(crossings)
    return Permits(np.zeros((places, 2), int), crossings)


@compiled
def grant_ways(
    streets: Streets,
    cars: np.ndarray,
    occupants: Occupants,
    permits: Permits,
    k: int,
    dt: float,
    seed: int,
) -> None:
    """Gives permits in the order of arrival, at the k-th time.

    Args:
        streets: the lanes, and the ego car.
        cars: (N,) records `VEHICLE`.
        occupants: the vehicles on each piece.
        permits: the users so far.
        k: number of the time.
        dt: the step [s].
        seed: seed of the drawn ways.
    """
    t, pieces, num_cars = k * dt, streets.pieces, len(cars)
    users, crossings = permits
    first = np.full(len(pieces), -1)
    for i in range(num_cars):
        lane = cars[i].path[CURRENT]
        if pieces[lane].is_way or cars[i].granted:
            continue
        if first[lane] < 0 or cars[i].s > cars[first[lane]].s:
            first[lane] = i
    since = np.full(num_cars + len(crossings), np.inf)
    for lane in range(len(pieces)):
        if first[lane] < 0:
            continue
        car = cars[first[lane]]
        if car.held >= 0 or car.left_lane >= 0:
            continue
        braking = car.v**2 / (2.0 * car.b)
        asked_from = max(_ASKED_FROM, _ASKED_BRAKING * braking + 5.0)
        if pieces[lane].length - car.s <= asked_from:
            if car.since == np.inf:
                car.since = t
            since[first[lane]] = car.since
            if 0.0 < streets.until[k, lane] < _EGO_IS_NEAR:
                since[first[lane]] = streets.until[k, lane] - _GOES_FIRST
    for c in range(len(crossings)):
        since[num_cars + c] = crossings[c].waits
    blocked = np.zeros(len(users), np.bool_)
    for who in np.argsort(since):
        if since[who] == np.inf:
            break
        if who < num_cars:
            car = cars[who]
            if car.path[CURRENT + 1] < 0:
                choose_way(streets, cars, who, seed)
            place, is_large = car.path[CURRENT + 1], car.large
            ready = _has_room(streets, cars, occupants, who, k, dt, seed)
        else:
            place, is_large = len(pieces) + who - num_cars, False
            crossing = crossings[who - num_cars]
            needed = crossing.length / _WALKING + WALK_GROUP + _DAWDLING
            ready = (
                users[place, 0] == 0
                and t >= crossing.closed + _REST
                and streets.until[k, place] >= needed
            )
        if not ready or blocked[place]:
            continue
        exclusions = streets.large if is_large else streets.small
        is_taken = False
        for other in range(len(users)):
            if users[other, 1] > 0:
                is_taken |= streets.large[place, other]
            elif users[other, 0] > 0:
                is_taken |= exclusions[place, other]
        if is_taken:
            # Later arrivals must not always go first.
            for other in range(len(blocked)):
                blocked[other] |= exclusions[place, other]
        elif who < num_cars:
            car = cars[who]
            car.granted, car.held = True, place
            car.since, car.refused = np.inf, 0.0
            users[place, int(is_large)] += 1
        else:
            # A placeholder holds the permit until the group has begun to walk.
            users[place, 0] += 1
            crossings[who - num_cars].opened = t


@compiled
def _has_room(
    streets: Streets,
    cars: np.ndarray,
    occupants: Occupants,
    i: int,
    k: int,
    dt: float,
    seed: int,
) -> bool:
    """Returns whether the i-th vehicle's way is green, with room beyond it.

    Without room for some time it draws another way; see `grant_ways`.
    """
    car, pieces = cars[i], streets.pieces
    lane, way = car.path[CURRENT], car.path[CURRENT + 1]
    beyond = car.path[CURRENT + 2]
    is_ego_near = 0.0 < streets.until[k, lane] < _EGO_IS_NEAR
    phase, junction = pieces[way].phase, pieces[way].junction
    if phase >= 0 and not is_ego_near:
        # Junctions switch at different times.
        cycle = (_GREEN + _RED) * streets.phases[junction]
        at = (k * dt + 7.0 * junction) % cycle - phase * (_GREEN + _RED)
        if not 0.0 <= at < _GREEN:
            return False
    distance = pieces[lane].length - car.s + pieces[way].length
    pace = max(3.0, 0.5 * streets.speed[pieces[way].first])
    needed = (distance + car.length) / pace + _EGO_MARGIN
    wait = _SHORT_WAIT if is_ego_near else WAIT
    has_room = False
    if streets.until[k, way] > needed and is_ego_far(
        streets, k, beyond, 0.0, wait
    ):
        end = pieces[beyond].length
        at = occupants.head[beyond]
        while at >= 0:
            other = occupants.entries[at]
            if other.who != i and other.rear >= 0.0:
                speed = max(other.speed, 0.0)
                end = min(end, other.rear + speed**2 / (2 * _LAST_BRAKES))
            at = other.after
        for j in range(len(cars)):
            one = cars[j]
            current = one.path[CURRENT]
            comes = (
                (one.granted and one.path[CURRENT + 2] == beyond)
                or (pieces[current].is_way and one.path[CURRENT + 1] == beyond)
                or (current == beyond and one.s < one.length)
            )
            if comes and j != i:
                end -= one.length + _ROOM
        has_room = end >= car.length + _ROOM
    if not has_room:
        car.refused += dt
        if car.refused > _PATIENCE or is_ego_near:
            car.refused = 0.0
            choose_way(streets, cars, i, seed)
    return has_room
