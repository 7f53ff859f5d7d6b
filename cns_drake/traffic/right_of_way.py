"""The right to enter a junction: one after the other, by arrival.

A vehicle may enter its whole way under three conditions: no crossing way is in
use or about to be used, there is room for it behind the way, and its signal is
green. Vehicles never stop on a way, so that none waits for ever.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.streets import WAIT, Streets, is_ego_far
from cns_drake.traffic.vehicles import CURRENT, Occupants, choose_way

# Signals: duration of a green phase, and of red for all after it [s]. Red holds
# only while another direction has vehicles.
_GREEN, _RED = 27.0, 4.0
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
    """The walkers on C crossings.

    Attributes:
        users: (C,) numbers of walkers with a permit.
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
        math.dist(one.line[0], one.line[1]) for one in graph.crossings
    ]
    return Permits(np.zeros(len(crossings), int), crossings)


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
        if lane < 0 or pieces[lane].is_way or cars[i].granted:
            continue
        if first[lane] < 0 or cars[i].s > cars[first[lane]].s:
            first[lane] = i
    since = np.full(num_cars + len(crossings), np.inf)
    asked = np.zeros((len(streets.phases), streets.phases.max()), np.bool_)
    for lane in range(len(pieces)):
        if first[lane] < 0:
            continue
        car = cars[first[lane]]
        if car.held >= 0 or car.left_lane >= 0:
            continue
        if car.guided and car.path[CURRENT + 1] < 0:
            continue
        braking = car.v**2 / (2.0 * car.b)
        asked_from = max(_ASKED_FROM, _ASKED_BRAKING * braking + 5.0)
        if pieces[lane].length - car.s <= asked_from:
            if car.since == np.inf:
                car.since = t
            since[first[lane]] = car.since
            if 0.0 < streets.until[k, lane] < _EGO_IS_NEAR:
                since[first[lane]] = streets.until[k, lane] - _GOES_FIRST
            phase = pieces[streets.after[pieces[lane].after_first]].phase
            if phase >= 0:
                asked[pieces[lane].junction, phase] = True
    for c in range(len(crossings)):
        since[num_cars + c] = crossings[c].waits
    # What small and what large vehicles must not enter now.
    taken = np.zeros((2, len(pieces) + len(crossings)), np.bool_)
    for i in range(num_cars):
        if cars[i].held >= 0:
            _take(
                streets,
                taken,
                cars[i].held,
                cars[i].large,
                _rear(streets, cars[i]),
            )
    for c in range(len(crossings)):
        if users[c] > 0:
            _take(streets, taken, len(pieces) + c, False, 0.0)
    blocked = np.zeros(taken.shape[1], np.bool_)
    for who in np.argsort(since):
        if since[who] == np.inf:
            break
        if who < num_cars:
            car = cars[who]
            if car.path[CURRENT + 1] < 0:
                choose_way(streets, cars, who, seed)
            place, is_large = car.path[CURRENT + 1], car.large
            ready = _is_green(streets, car, asked, k, dt) and _has_room(
                streets, cars, occupants, who, k, dt, seed
            )
        else:
            c = who - num_cars
            place, is_large = len(pieces) + c, False
            needed = crossings[c].length / _WALKING + WALK_GROUP + _DAWDLING
            ready = (
                users[c] == 0
                and t >= crossings[c].closed + _REST
                and streets.until[k, place] >= needed
            )
        if not ready or blocked[place]:
            continue
        if taken[int(is_large), place]:
            # Later arrivals must not always go first.
            exclusions = streets.large if is_large else streets.small
            for other in range(len(blocked)):
                blocked[other] |= exclusions[place, other] > 0.0
            continue
        _take(streets, taken, place, is_large, 0.0)
        if who < num_cars:
            car = cars[who]
            car.granted, car.held = True, place
            car.since, car.refused = np.inf, 0.0
        else:
            # A placeholder holds the permit until the group has begun to walk.
            users[who - num_cars] += 1
            crossings[who - num_cars].opened = t


@compiled
def _take(
    streets: Streets, taken: np.ndarray, place: int, is_large: bool, rear: float
) -> None:
    """Notes what a vehicle on a way, or a walker on a crossing, excludes.

    Args:
        streets: the lanes.
        taken: (2, P + C) what small and what large vehicles must not enter.
        place: the way or crossing.
        is_large: whether the vehicle is large.
        rear: of the vehicle, along the way [m].
    """
    for other in range(taken.shape[1]):
        is_near = rear < streets.large[place, other]
        taken[1, other] |= is_near
        taken[0, other] |= (
            is_near if is_large else rear < streets.small[place, other]
        )


@compiled
def _rear(streets: Streets, car: Any) -> float:
    """Returns the place of a vehicle's rear along the way it holds [m]."""
    rear = car.s - car.length
    if car.path[CURRENT] == car.held:
        return rear
    if car.path[CURRENT - 1] == car.held:
        return rear + streets.pieces[car.held].length
    return 0.0


@compiled
def _is_green(
    streets: Streets, car: Any, asked: np.ndarray, k: int, dt: float
) -> bool:
    """Returns whether a vehicle need not wait for a signal.

    Args:
        streets: the lanes, and the ego car.
        car: a record `VEHICLE`, in a lane.
        asked: (J, phases) the phases of each junction that a vehicle comes in.
        k: number of the time.
        dt: the step [s].
    """
    way = streets.pieces[car.path[CURRENT + 1]]
    if (
        way.phase < 0
        or 0.0 < streets.until[k, car.path[CURRENT]] < _EGO_IS_NEAR
    ):
        return True
    cycle = (_GREEN + _RED) * streets.phases[way.junction]
    at = k * dt % cycle
    now = int(at // (_GREEN + _RED))
    if at - now * (_GREEN + _RED) >= _GREEN:
        return False
    return now == way.phase or not asked[way.junction, now]


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
    """Returns whether there is room beyond the i-th vehicle's way.

    Without room for some time it draws another way; see `grant_ways`.
    """
    car, pieces = cars[i], streets.pieces
    lane, way = car.path[CURRENT], car.path[CURRENT + 1]
    beyond = car.path[CURRENT + 2]
    is_ego_near = 0.0 < streets.until[k, lane] < _EGO_IS_NEAR
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
    if not has_room and not car.guided:
        car.refused += dt
        if car.refused > _PATIENCE or is_ego_near:
            car.refused = 0.0
            choose_way(streets, cars, i, seed)
    return has_room
