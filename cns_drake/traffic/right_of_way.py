"""Rules for who may enter a junction: first come, first served.

A vehicle may enter its path ("way") through a junction under three conditions.
Vehicles on conflicting ways will have passed when the vehicle gets there. The
lane after the junction has room for the vehicle. The signal is green or,
without a signal, the vehicle has stopped at the line. If a vehicle with the
right of way is slower than expected, later vehicles wait on their ways for this
vehicle. Earlier vehicles never wait for later vehicles, so no vehicle waits
forever.
"""

from typing import Any

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.conflicts import MERGE, SPLIT
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.giving_way import (
    first_lane_at_crossing,
    is_walked,
    rear_on_way,
)
from cns_drake.traffic.streets import WAIT, Streets, is_ego_far
from cns_drake.traffic.vehicle_records import CURRENT, Traffic
from cns_drake.traffic.vehicle_steps import choose_way

# Where there is no signal, a driver stops before the line for this time [s].
_STOP_TIME = 3.0
# A driver who is at most this fast has stopped [m/s].
_STANDSTILL_SPEED = 0.5
# A driver within this distance of the line is at the line [m].
_AT_LINE = 4.0
# Traffic ahead of the ego car goes first and does not wait for signals if the
# ego car comes within this time [s].
_EGO_IS_NEAR = 80.0
# Such traffic counts as if it had waited for this time longer [s].
_GOES_FIRST = 1e6
# Greatest expected wait on a way for vehicles [s].
_WAIT_FOR_VEHICLES = 2.0
# Greatest expected wait on a way for pedestrians [s].
_WAIT_FOR_WALKERS = 6.0
# After this time at a stop line, no later driver may enter a conflicting way
# [s].
_LONG_WAIT = 20.0
# Acceleration that is assumed for the driver [m/s^2].
_OWN_ACCELERATION = 2.0
# Acceleration that is assumed for others [m/s^2].
_OTHERS_ACCELERATION = 1.0
# Share of the allowed speed that is assumed for others.
_OTHERS_PACE = 0.8
# If the ego car comes within this time, a vehicle enters its way only after all
# others have left the conflicting ways [s].
_EGO_COMES = 20.0
# No vehicle enters a way if the ego car will be there within this time [s].
_EGO_MARGIN = 3.0
# Assumed wait at the end of a lane for a driver who goes first [s].
_SHORT_WAIT = 5.0
# Gap between standing vehicles [m].
_STANDING_GAP = 2.5
# Greatest braking of the last vehicle ahead [m/s^2].
_LAST_BRAKES = 4.0
# Drivers request their way within this distance of the line [m].
_REQUEST_DISTANCE = 10.0
# Drivers also request it within this multiple of their braking distance.
_REQUEST_BRAKING = 1.4
# Added to that distance, and once more at a signal [m].
_REQUEST_MARGIN = 5.0
# At a signal, drivers request their way this much earlier, since nobody brakes
# before a green signal [s].
_REQUEST_AT_SIGNAL = 3.0
# After this time without room, a driver takes another way [s].
_PATIENCE = 3.0
# If the green of a crossing is too short to cross, pedestrians may begin to
# cross within this time after green begins [s].
_LATE = 2.0
# Time in which a group of pedestrians starts [s].
WALK_GROUP = 3.0
# Assumed speed of pedestrians [m/s].
_WALKING_SPEED = 1.0
# A group may take this much longer over a crossing [s].
_WALKING_RESERVE = 3.0
# Time that vehicles have after a group of pedestrians has left a crossing [s].
_REST = 30.0
# Where there are no marks, pedestrians begin to cross if no vehicle comes
# within this time [s].
_WALKERS_GAP = 6.0


@compiled
def grant_ways(traffic: Traffic, k: int) -> None:
    """Permits vehicles to enter junctions, in the order of their arrival.

    Pedestrians are permitted to enter crossings by the same rule.

    Args:
        traffic: vehicles and crossings, changed in place.
        k: number of the current time step.
    """
    num_cars, num_pieces = len(traffic.cars), len(traffic.streets.pieces)
    first = _first_without_permission(traffic, k)
    since = _arrivals(traffic, first, k)
    # Pieces that small, and large, vehicles must not enter now.
    taken = np.zeros((2, num_pieces), np.bool_)
    last = _mark_permitted(traffic, taken)
    blocked = np.zeros(num_pieces, np.bool_)
    for who in np.argsort(since):
        if since[who] == np.inf:
            break
        if who < num_cars:
            last = _serve_vehicle(
                traffic, who, since[who], k, taken, blocked, last
            )
        else:
            last = _serve_crossing(traffic, who - num_cars, k, last)
            _take_crossing(traffic, taken, who - num_cars)


@compiled
def _first_without_permission(traffic: Traffic, k: int) -> np.ndarray:
    """Returns the first vehicle without permission on each lane.

    Permissions that a vehicle cannot use are withdrawn before: after its signal
    has changed, and behind a vehicle without permission.

    Args:
        traffic: vehicles and crossings, changed in place.
        k: number of the current time step.

    Returns:
        (P,) number of the vehicle; -1 for none, and for pieces that are not
        lanes.
    """
    streets, cars = traffic.streets, traffic.cars
    pieces = streets.pieces
    first = np.full(len(pieces), -1)
    for i in range(len(cars)):
        lane = cars[i].path[CURRENT]
        if lane < 0 or pieces[lane].is_way:
            continue
        if cars[i].granted:
            left = pieces[lane].length - cars[i].s
            if (
                pieces[cars[i].held].phase < 0
                or left <= _stops_within(cars[i])
                or _is_ready(streets, cars[i], k)
            ):
                continue
            # The signal has changed, and the vehicle can still stop.
            cars[i].granted, cars[i].held = False, -1
        if first[lane] < 0 or cars[i].s > cars[first[lane]].s:
            first[lane] = i
        other = cars[i].left_lane
        if cars[i].guided and other >= 0:
            # The ego car is the last of the vehicles, and counts in both lanes
            # while it changes.
            s = cars[i].s * (pieces[other].length / pieces[lane].length)
            if first[other] < 0 or s > cars[first[other]].s:
                first[other] = i
    for i in range(len(cars)):
        lane = cars[i].path[CURRENT]
        if lane < 0 or not cars[i].granted or cars[i].v > _STANDSTILL_SPEED:
            continue
        if pieces[lane].is_way or first[lane] < 0:
            continue
        ahead = cars[first[lane]]
        scale = pieces[lane].length / pieces[ahead.path[CURRENT]].length
        if ahead.s * scale > cars[i].s:
            # Behind a vehicle without permission, a driver cannot use it.
            cars[i].granted, cars[i].held = False, -1
    return first


@compiled
def _arrivals(traffic: Traffic, first: np.ndarray, k: int) -> np.ndarray:
    """Returns since when vehicles and pedestrians ask for permission.

    Vehicles that ask for the first time are marked as waiting. Crossings that
    the last pedestrian has left are closed.

    Args:
        traffic: vehicles and crossings, changed in place.
        first: (P,) first vehicle without permission on each lane; -1 for none.
        k: number of the current time step.

    Returns:
        (N + C,) times at the N vehicles and C crossings, inf for those that do
        not ask [s].
    """
    streets, cars, crossings = traffic.streets, traffic.cars, traffic.crossings
    t = k * STEP
    pieces = streets.pieces
    since = np.full(len(cars) + len(crossings), np.inf)
    for lane in range(len(pieces)):
        if first[lane] < 0:
            continue
        car = cars[first[lane]]
        if car.held >= 0 or car.path[CURRENT] != lane:
            continue
        if car.left_lane >= 0 and (
            not car.guided or first[car.left_lane] != first[lane]
        ):
            continue
        if car.guided and car.path[CURRENT + 1] < 0:
            continue
        braking = car.v**2 / (2.0 * car.b)
        asked_from = max(
            _REQUEST_DISTANCE, _REQUEST_BRAKING * braking + _REQUEST_MARGIN
        )
        left = pieces[lane].length - car.s
        phase = pieces[streets.after[pieces[lane].after_first]].phase
        if phase >= 0:
            asked_from += _REQUEST_AT_SIGNAL * car.v + _REQUEST_MARGIN
        if left <= asked_from:
            if 0.0 < streets.until[k, lane] < _EGO_IS_NEAR:
                since[first[lane]] = streets.until[k, lane] - _GOES_FIRST
            elif phase < 0 and car.since == np.inf:
                # Every driver stops at the line where there is no signal.
                if car.v > _STANDSTILL_SPEED or left > _AT_LINE:
                    continue
            else:
                since[first[lane]] = car.since
            if car.since == np.inf:
                car.since = t
                since[first[lane]] = min(since[first[lane]], t)
    for c in range(len(crossings)):
        crossing = crossings[c]
        since[len(cars) + c] = crossing.waits
        if crossing.users == 0 and (crossing.is_open or crossing.waits > t):
            crossing.order, crossing.is_open = 0, False
    return since


@compiled
def _mark_permitted(traffic: Traffic, taken: np.ndarray) -> int:
    """Marks the ways that permissions so far exclude, in `taken` (2, P).

    The result is the highest `order` so far.
    """
    streets, cars, crossings = traffic.streets, traffic.cars, traffic.crossings
    last = 1
    for i in range(len(cars)):
        if cars[i].held >= 0:
            last = max(last, cars[i].order)
            rear = rear_on_way(streets, cars[i])
            _mark_excluded(streets, taken, cars[i].held, cars[i].large, rear)
    for c in range(len(crossings)):
        last = max(last, crossings[c].order)
        _take_crossing(traffic, taken, c)
    return last


@compiled
def _serve_vehicle(
    traffic: Traffic,
    i: int,
    since: float,
    k: int,
    taken: np.ndarray,
    blocked: np.ndarray,
    last: int,
) -> int:
    """Permits the i-th vehicle to enter its way, if it may.

    Args:
        traffic: vehicles and crossings, changed in place.
        i: number of the vehicle.
        since: since when the vehicle asks for permission [s].
        k: number of the current time step.
        taken: (2, P) pieces that small, and large, vehicles must not enter now;
            changed in place.
        blocked: (P,) pieces that are kept free for vehicles that have waited
            long; changed in place.
        last: highest `order` so far.

    Returns:
        The new highest `order`.
    """
    streets = traffic.streets
    pieces = streets.pieces
    t = k * STEP
    car = traffic.cars[i]
    if car.path[CURRENT + 1] < 0:
        choose_way(traffic, i)
    way, is_large = car.path[CURRENT + 1], car.large
    if blocked[way] or not _is_ready(streets, car, k):
        return last
    if not _has_room(traffic, i, k):
        if car.guided and t > since + _LONG_WAIT:
            # It has no other way to take: the next room is for it.
            for other in range(len(pieces)):
                first_after = streets.after[pieces[other].after_first]
                blocked[other] |= first_after == car.path[CURRENT + 2]
        return last
    # The ego car's plan has no time to wait on a way.
    is_near = streets.until[k, way] < _EGO_COMES
    if taken[int(is_large), way] and (
        is_near or not _is_soon_free(traffic, i, way, t)
    ):
        if is_near or t > since + _LONG_WAIT:
            # Later arrivals must not go first again and again.
            clear = streets.clear[int(is_large), way]
            for other in range(len(pieces)):
                blocked[other] |= clear[other] > 0.0
        return last
    _mark_excluded(streets, taken, way, is_large, 0.0)
    last += 1
    car.granted, car.held, car.order = True, way, last
    car.since, car.refused = np.inf, 0.0
    return last


@compiled
def _is_soon_free(traffic: Traffic, i: int, way: int, t: float) -> bool:
    """Returns whether the i-th vehicle would hardly have to wait on its way.

    The vehicle would not have to wait if pedestrians and vehicles on other ways
    will have passed the conflicting places when the vehicle gets there.
    """
    streets, cars, crossings = traffic.streets, traffic.cars, traffic.crossings
    car = cars[i]
    pieces = streets.pieces
    front = car.s - pieces[car.path[CURRENT]].length
    pace = streets.speed[pieces[way].first]
    for c in range(len(crossings)):
        place = streets.begin[int(car.large), way, len(pieces) + c]
        if place < np.inf and is_walked(traffic, c, way, car.large):
            lasts = crossings[c].length / _WALKING_SPEED + _WALKING_RESERVE
            if crossings[c].opened >= 0.0:
                lasts += WALK_GROUP + crossings[c].opened - t
            elif crossings[c].is_open:
                lasts += crossings[c].closed - t
            else:
                lasts += WALK_GROUP
            arrives = _duration(place - front, car.v, _OWN_ACCELERATION, pace)
            if lasts > arrives + _WAIT_FOR_WALKERS:
                return False
    for j in range(len(cars)):
        other = cars[j]
        if j == i or other.held < 0:
            continue
        size = int(car.large or other.large)
        held = other.held
        place = streets.begin[size, way, held]
        rear = rear_on_way(streets, other)
        last = streets.clear[size, held, way]
        if place == np.inf or rear >= last:
            continue
        if streets.joint[size, way, held] == SPLIT and rear > 0.0:
            continue
        if streets.joint[size, way, held] == MERGE:
            # Behind this place, it follows the other vehicle.
            last = min(last, streets.begin[size, held, way] + other.length)
        arrives = _duration(place - front, car.v, _OWN_ACCELERATION, pace)
        its_pace = _OTHERS_PACE * streets.speed[pieces[held].first]
        leaves = _duration(last - rear, other.v, _OTHERS_ACCELERATION, its_pace)
        if leaves > arrives + _WAIT_FOR_VEHICLES:
            return False
    return True


@compiled
def _duration(distance: float, v: float, a: float, pace: float) -> float:
    """Returns the time to cover a distance [s].

    The speed grows from `v` up to `pace` with the acceleration `a`.
    """
    if distance <= 0.0:
        return 0.0
    v = min(v, pace)
    before = (pace**2 - v**2) / (2.0 * a)
    if distance < before:
        return ((v**2 + 2.0 * a * distance) ** 0.5 - v) / a
    return (pace - v) / a + (distance - before) / pace


@compiled
def _serve_crossing(traffic: Traffic, c: int, k: int, last: int) -> int:
    """Opens a crossing for pedestrians once earlier vehicles have passed.

    `last` is the highest `order` so far; the result is the new highest `order`.

    Args:
        traffic: vehicles and crossings, changed in place.
        c: number of the crossing.
        k: number of the current time step.
        last: highest `order` so far.
    """
    streets, cars = traffic.streets, traffic.cars
    crossing = traffic.crossings[c]
    place = len(streets.pieces) + c
    t = k * STEP
    if crossing.users > 0:
        return last
    needed = crossing.length / _WALKING_SPEED + WALK_GROUP + _WALKING_RESERVE
    if crossing.order == 0:
        if t < crossing.closed + _REST:
            return last
        if not crossing.marked and not _is_gap(traffic, c):
            return last
        if _until_red(streets, place, t) < min(
            needed, streets.signals.green_for[place] - _LATE
        ):
            return last
        last += 1
        crossing.order = last
    if streets.until[k, place] < needed:
        crossing.order = 0
        return last
    for i in range(len(cars)):
        car = cars[i]
        if car.held < 0 or car.order > crossing.order:
            continue
        rear = rear_on_way(streets, car)
        size = int(car.large)
        ahead = streets.begin[size, car.held, place] - rear - car.length
        clear = streets.clear[size, car.held, place]
        if rear < clear and ahead < _stops_within(car):
            return last
    # A placeholder holds the permission until the group begins to walk.
    crossing.users, crossing.opened, crossing.is_open = 1, t, True
    # Vehicles that have not arrived yet wait for it, whatever their order.
    crossing.order = 1
    return last


@compiled
def _is_gap(traffic: Traffic, c: int) -> bool:
    """Returns whether the c-th crossing is free of vehicles for some time."""
    for i in range(len(traffic.cars)):
        car = traffic.cars[i]
        _, enters, leaves = first_lane_at_crossing(traffic.streets, car, c)
        reach = max(_stops_within(car), _WALKERS_GAP * car.v)
        if enters < reach and leaves > 0.0:
            return False
    return True


@compiled
def _until_red(streets: Streets, place: int, t: float) -> float:
    """Returns how long a way or a crossing stays green [s].

    It is 0 or less during red, and inf without a signal.

    Args:
        streets: arrays of all lanes, with the signals.
        place: number of the way, or of the crossing after all pieces.
        t: present time [s].
    """
    cycle, green_from, green_for = streets.signals
    if green_for[place] == cycle:
        return np.inf
    return green_for[place] - (t - green_from[place]) % cycle


@compiled
def _stops_within(car: Any) -> float:
    """Returns the distance in which a driver can stop comfortably [m]."""
    return 1.0 + car.v + car.v**2 / (2.0 * car.b)


@compiled
def _mark_excluded(
    streets: Streets, taken: np.ndarray, place: int, is_large: bool, rear: float
) -> None:
    """Marks the ways that a vehicle excludes, given the place of its rear [m].

    `taken` (2, P) says which pieces small vehicles (row 0) and large vehicles
    (row 1) must not enter.

    Args:
        streets: arrays of all lanes.
        taken: (2, P) bool, changed in place.
        place: number of the way on which the vehicle is.
        is_large: whether the vehicle leaves its lane in turns.
        rear: place of its rear on the way [m].
    """
    size = int(is_large)
    for other in range(taken.shape[1]):
        taken[1, other] |= rear < streets.clear[1, place, other]
        taken[0, other] |= rear < streets.clear[size, place, other]


@compiled
def _take_crossing(traffic: Traffic, taken: np.ndarray, c: int) -> None:
    """Marks the ways that pedestrians on the c-th crossing exclude.

    Args:
        traffic: vehicles and crossings.
        taken: (2, P) bool, changed in place; see `_mark_excluded`.
        c: number of the crossing.
    """
    begin = traffic.streets.begin
    num_pieces = taken.shape[1]
    for way in range(num_pieces):
        for size in range(2):
            if begin[size, way, num_pieces + c] < np.inf:
                taken[size, way] |= is_walked(traffic, c, way, size == 1)


@compiled
def _is_ready(streets: Streets, car: Any, k: int) -> bool:
    """Returns whether a vehicle has waited at its signal or stop line.

    Args:
        streets: arrays of all lanes, with the signals.
        car: record of the vehicle.
        k: number of the current time step.
    """
    t = k * STEP
    way = car.path[CURRENT + 1]
    row = streets.pieces[way]
    if 0.0 < streets.until[k, car.path[CURRENT]] < _EGO_IS_NEAR:
        return True
    if row.phase < 0:
        return t >= car.since + _STOP_TIME
    return _until_red(streets, way, t) > 0.0


@compiled
def _has_room(traffic: Traffic, i: int, k: int) -> bool:
    """Returns whether the lane after the i-th vehicle's way has room for it.

    If there has been no room for some time, the vehicle samples another way;
    see `grant_ways`.

    Args:
        traffic: vehicles and crossings; the vehicle is changed in place.
        i: number of the vehicle.
        k: number of the current time step.
    """
    streets, cars = traffic.streets, traffic.cars
    car = cars[i]
    pieces = streets.pieces
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
        at = traffic.head[beyond]
        while at >= 0:
            entry = traffic.entries[at]
            if entry.who != i and entry.rear >= 0.0:
                speed = max(entry.speed, 0.0)
                end = min(end, entry.rear + speed**2 / (2 * _LAST_BRAKES))
            at = entry.after
        for j in range(len(cars)):
            other = cars[j]
            current = other.path[CURRENT]
            comes = (
                (other.granted and other.path[CURRENT + 2] == beyond)
                or (
                    pieces[current].is_way and other.path[CURRENT + 1] == beyond
                )
                or (current == beyond and other.s < other.length)
            )
            if comes and j != i:
                end -= other.length + _STANDING_GAP
        has_room = end >= car.length + _STANDING_GAP
    if not has_room and not car.guided:
        car.refused += STEP
        if car.refused > _PATIENCE or is_ego_near:
            car.refused = 0.0
            choose_way(traffic, i)
    return has_room
