"""The right to enter a junction: one after the other, by arrival.

A vehicle may enter its whole way under three conditions: those on ways that
meet it will have passed when it comes there, there is room for it behind the
way, and its signal is green, or it has stopped before the line. If another one
is slower than expected, it waits on its way for those that entered before it,
which never wait for it: none waits for ever.
"""

from typing import Any, NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.streets import MERGE, SPLIT, WAIT, Streets, is_ego_far
from cns_drake.traffic.vehicles import (
    CURRENT,
    Occupants,
    choose_way,
    is_walked,
    lane_over,
    rear_on_way,
)

# Where there is no signal, a driver has to stand for a while before the line
# [s]: to be slower than this [m/s], and this near [m].
_STOPS, _STANDS, _AT_LINE = 3.0, 0.5, 4.0
# Traffic ahead of the ego car, if it comes within this time, goes first and
# does not wait for signals [s].
_EGO_IS_NEAR = 80.0
_GOES_FIRST = 1e6
# Expected wait on a way for vehicles and for walkers at most [s]; after this
# time at a stop line no later driver enters a way that meets one's own [s].
# Accelerations that are assumed for a driver and others [m/s^2], and the
# others' part of the allowed speed.
_SLACK, _YIELDS, _LONG = 2.0, 6.0, 20.0
_OWN, _OTHERS, _PACE = 2.0, 1.0, 0.8
# If the ego car comes within this time, a vehicle enters its way only once no
# other is in its way [s].
_EGO_COMES = 20.0
# No vehicle enters a way if the ego car will be there within this time [s].
_EGO_MARGIN = 3.0
# Assumed wait at the end of a lane of a driver who goes first [s].
_SHORT_WAIT = 5.0
# Gap between standing vehicles [m], and greatest braking of the last one
# [m/s^2].
_ROOM, _LAST_BRAKES = 2.5, 4.0
# Drivers request their way from this distance [m], or from this multiple of
# their braking distance; from farther away, by this time [s], if there is a
# signal, since none brakes before a green one.
_ASKED_FROM, _ASKED_BRAKING, _ASKED_FOR = 10.0, 1.4, 3.0
# After this time without room, a driver takes another way [s].
_PATIENCE = 3.0
# Walkers whose green is too short begin to cross in its first part [s].
_LATE = 2.0
# Time for a group of walkers to start [s], their assumed speed [m/s], and
# reserve [s].
WALK_GROUP = 3.0
_WALKING, _DAWDLING = 1.0, 3.0
# Time for vehicles after a group has left a crossing [s].
_REST = 30.0
# Where there are no marks, walkers begin if no vehicle comes so soon [s].
_WALKERS_GAP = 6.0

CROSSING = np.dtype(
    [
        ("waits", float),  # Time since which walkers wait, inf for none [s].
        ("opened", float),  # Time at which it was opened [s].
        ("closed", float),  # Time at which it was last left [s].
        ("length", float),  # [m]
        ("order", int),  # As of `VEHICLE`, 0 while no walkers ask.
        ("is_open", bool),  # Whether walkers are on it.
        ("marked", bool),  # See `Crossing`.
        # Places on its line from which walkers have yet to go on to its end,
        # and to its beginning [m].
        ("to_end", float),
        ("to_start", float),
    ]
)


class Permits(NamedTuple):
    """The walkers on C crossings.

    Attributes:
        users: (C,) numbers of walkers with a permit.
        crossings: (C,) records `CROSSING`.
        lines: (C, 2, 2) where each begins [m], and its direction.
    """

    users: np.ndarray
    crossings: np.ndarray
    lines: np.ndarray


def make_permits(graph: LaneGraph) -> Permits:
    """Returns permits without any holder."""
    crossings = np.zeros(len(graph.crossings), CROSSING)
    crossings["waits"] = np.inf
    crossings["opened"] = crossings["closed"] = -np.inf
    crossings["to_end"], crossings["to_start"] = -np.inf, np.inf
    crossings["marked"] = [one.marked for one in graph.crossings]
    ends = np.array([one.line[[0, -1], :2] for one in graph.crossings])
    lines = np.diff(ends.reshape(-1, 2, 2), axis=1, prepend=0.0)
    x, y = lines[:, 1].T
    crossings["length"] = np.sqrt(x * x + y * y)
    lines[:, 1] /= crossings["length"][:, None]
    return Permits(np.zeros(len(crossings), int), crossings, lines)


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
    users, crossings = permits.users, permits.crossings
    first = np.full(len(pieces), -1)
    for i in range(num_cars):
        lane = cars[i].path[CURRENT]
        if lane < 0 or pieces[lane].is_way:
            continue
        if cars[i].granted:
            left = pieces[lane].length - cars[i].s
            if (
                pieces[cars[i].held].phase < 0
                or left <= _stops_within(cars[i])
                or _is_ready(streets, cars[i], k, dt)
            ):
                continue
            # Its signal has changed, and it can stop.
            cars[i].granted, cars[i].held = False, -1
        if first[lane] < 0 or cars[i].s > cars[first[lane]].s:
            first[lane] = i
        other = cars[i].left_lane
        if cars[i].guided and other >= 0:
            # It is the last one, and counts in both of its lanes.
            s = cars[i].s * (pieces[other].length / pieces[lane].length)
            if first[other] < 0 or s > cars[first[other]].s:
                first[other] = i
    for i in range(num_cars):
        lane = cars[i].path[CURRENT]
        if lane < 0 or not cars[i].granted or cars[i].v > _STANDS:
            continue
        if pieces[lane].is_way or first[lane] < 0:
            continue
        ahead = cars[first[lane]]
        scale = pieces[lane].length / pieces[ahead.path[CURRENT]].length
        if ahead.s * scale > cars[i].s:
            # Behind one without a permit, a driver cannot use it.
            cars[i].granted, cars[i].held = False, -1
    since = np.full(num_cars + len(crossings), np.inf)
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
        asked_from = max(_ASKED_FROM, _ASKED_BRAKING * braking + 5.0)
        left = pieces[lane].length - car.s
        phase = pieces[streets.after[pieces[lane].after_first]].phase
        if phase >= 0:
            asked_from += _ASKED_FOR * car.v + 5.0
        if left <= asked_from:
            if 0.0 < streets.until[k, lane] < _EGO_IS_NEAR:
                since[first[lane]] = streets.until[k, lane] - _GOES_FIRST
            elif phase < 0 and car.since == np.inf:
                # Every driver stops where there is no signal.
                if car.v > _STANDS or left > _AT_LINE:
                    continue
            else:
                since[first[lane]] = car.since
            if car.since == np.inf:
                car.since = t
                since[first[lane]] = min(since[first[lane]], t)
    for c in range(len(crossings)):
        since[num_cars + c] = crossings[c].waits
        if users[c] == 0 and (crossings[c].is_open or since[num_cars + c] > t):
            crossings[c].order, crossings[c].is_open = 0, False
    # What small and what large vehicles must not enter now.
    taken = np.zeros((2, len(pieces)), np.bool_)
    last = 1
    for i in range(num_cars):
        if cars[i].held >= 0:
            last = max(last, cars[i].order)
            _take(
                streets,
                taken,
                cars[i].held,
                cars[i].large,
                rear_on_way(streets, cars[i]),
            )
    for c in range(len(crossings)):
        last = max(last, crossings[c].order)
        _take_crossing(streets, taken, crossings, c)
    blocked = np.zeros(len(pieces), np.bool_)
    for who in np.argsort(since):
        if since[who] == np.inf:
            break
        if who >= num_cars:
            last = _serve(streets, cars, permits, who - num_cars, k, dt, last)
            _take_crossing(streets, taken, crossings, who - num_cars)
            continue
        car = cars[who]
        if car.path[CURRENT + 1] < 0:
            choose_way(streets, cars, who, seed)
        way, is_large = car.path[CURRENT + 1], car.large
        if blocked[way] or not _is_ready(streets, car, k, dt):
            continue
        if not _has_room(streets, cars, occupants, who, k, dt, seed):
            if car.guided and t > since[who] + _LONG:
                # It cannot take another way: the next room is for it.
                for other in range(len(pieces)):
                    first_after = streets.after[pieces[other].after_first]
                    blocked[other] |= first_after == car.path[CURRENT + 2]
            continue
        # The ego car's plan leaves no time to wait on a way.
        is_near = streets.until[k, way] < _EGO_COMES
        if taken[int(is_large), way] and (
            is_near or not _is_soon_free(streets, cars, crossings, who, way, t)
        ):
            if is_near or t > since[who] + _LONG:
                # Later arrivals must not always go first.
                clear = streets.clear[int(is_large), way]
                blocked |= clear[: len(pieces)] > 0.0
            continue
        _take(streets, taken, way, is_large, 0.0)
        last += 1
        car.granted, car.held, car.order = True, way, last
        car.since, car.refused = np.inf, 0.0


@compiled
def _is_soon_free(
    streets: Streets,
    cars: np.ndarray,
    crossings: np.ndarray,
    i: int,
    way: int,
    t: float,
) -> bool:
    """Returns whether the i-th vehicle need hardly wait on a way.

    Walkers, and vehicles on other ways, will have passed the places where they
    meet it when it comes there.

    Args:
        streets: the lanes.
        cars: (N,) records `VEHICLE`.
        crossings: (C,) records `CROSSING`.
        i: number of the vehicle, in the lane before the way.
        way: its way.
        t: time [s].
    """
    car, pieces = cars[i], streets.pieces
    size = int(car.large)
    front = car.s - pieces[car.path[CURRENT]].length
    pace = streets.speed[pieces[way].first]
    for c in range(len(crossings)):
        place = streets.begin[size, way, len(pieces) + c]
        if place < np.inf and is_walked(streets, crossings, c, way, size):
            lasts = crossings[c].length / _WALKING + _DAWDLING
            if crossings[c].opened >= 0.0:
                lasts += WALK_GROUP + crossings[c].opened - t
            elif crossings[c].is_open:
                lasts += crossings[c].closed - t
            else:
                lasts += WALK_GROUP
            arrives = _duration(place - front, car.v, _OWN, pace)
            if lasts > arrives + _YIELDS:
                return False
    for j in range(len(cars)):
        other = cars[j]
        if j == i or other.held < 0:
            continue
        size, held = int(car.large or other.large), other.held
        place = streets.begin[size, way, held]
        rear = rear_on_way(streets, other)
        last = streets.clear[size, held, way]
        if place == np.inf or rear >= last:
            continue
        if streets.joint[size, way, held] == SPLIT and rear > 0.0:
            continue
        if streets.joint[size, way, held] == MERGE:
            # Behind it the vehicle follows it.
            last = min(last, streets.begin[size, held, way] + other.length)
        arrives = _duration(place - front, car.v, _OWN, pace)
        its_pace = _PACE * streets.speed[pieces[held].first]
        leaves = _duration(last - rear, other.v, _OTHERS, its_pace)
        if leaves > arrives + _SLACK:
            return False
    return True


@compiled
def _duration(distance: float, v: float, a: float, pace: float) -> float:
    """Returns the time for a distance, from a speed up to a pace [s]."""
    if distance <= 0.0:
        return 0.0
    v = min(v, pace)
    before = (pace**2 - v**2) / (2.0 * a)
    if distance < before:
        return ((v**2 + 2.0 * a * distance) ** 0.5 - v) / a
    return (pace - v) / a + (distance - before) / pace


@compiled
def _serve(
    streets: Streets,
    cars: np.ndarray,
    permits: Permits,
    c: int,
    k: int,
    dt: float,
    last: int,
) -> int:
    """Opens a crossing for walkers once the vehicles before them have passed.

    Args:
        streets: the lanes, and the ego car.
        cars: (N,) records `VEHICLE`.
        permits: the users so far.
        c: number of the crossing, where walkers wait.
        k: number of the time.
        dt: the step [s].
        last: the highest `order` so far.

    Returns:
        The highest `order`.
    """
    one, place, t = permits.crossings[c], len(streets.pieces) + c, k * dt
    if permits.users[c] > 0:
        return last
    needed = one.length / _WALKING + WALK_GROUP + _DAWDLING
    if one.order == 0:
        if t < one.closed + _REST:
            return last
        if not one.marked and not _is_gap(streets, cars, c):
            return last
        if _until_red(streets, place, t) < min(
            needed, streets.signals.green_for[place] - _LATE
        ):
            return last
        last += 1
        one.order = last
    if streets.until[k, place] < needed:
        one.order = 0
        return last
    for i in range(len(cars)):
        car = cars[i]
        if car.held < 0 or car.order > one.order:
            continue
        rear, size = rear_on_way(streets, car), int(car.large)
        ahead = streets.begin[size, car.held, place] - rear - car.length
        if rear < streets.clear[
            size, car.held, place
        ] and ahead < _stops_within(car):
            return last
    # A placeholder holds the permit until the group has begun to walk.
    permits.users[c], one.opened, one.is_open = 1, t, True
    # Vehicles that are not yet there wait for it, whenever they came.
    one.order = 1
    return last


@compiled
def _is_gap(streets: Streets, cars: np.ndarray, c: int) -> bool:
    """Returns whether no vehicle is on the c-th crossing, or will be soon."""
    for i in range(len(cars)):
        car = cars[i]
        _, enters, leaves = lane_over(streets, car, c)
        reach = max(_stops_within(car), _WALKERS_GAP * car.v)
        if enters < reach and leaves > 0.0:
            return False
    return True


@compiled
def _until_red(streets: Streets, place: int, t: float) -> float:
    """Returns for how long a way or a crossing is still green [s].

    That is 0 or less while it is red, and inf without a signal.
    """
    cycle, green_from, green_for = streets.signals
    if green_for[place] == cycle:
        return np.inf
    return green_for[place] - (t - green_from[place]) % cycle


@compiled
def _stops_within(car: Any) -> float:
    """Returns the way on which a driver can stop in comfort [m]."""
    return 1.0 + car.v + car.v**2 / (2.0 * car.b)


@compiled
def _take(
    streets: Streets, taken: np.ndarray, place: int, is_large: bool, rear: float
) -> None:
    """Notes what a vehicle on a way excludes.

    Args:
        streets: the lanes.
        taken: (2, P) what small and what large vehicles must not enter.
        place: the way.
        is_large: whether the vehicle is large.
        rear: of the vehicle, along the way [m].
    """
    for other in range(taken.shape[1]):
        is_near = rear < streets.clear[1, place, other]
        taken[1, other] |= is_near
        taken[0, other] |= (
            is_near if is_large else rear < streets.clear[0, place, other]
        )


@compiled
def _take_crossing(
    streets: Streets, taken: np.ndarray, crossings: np.ndarray, c: int
) -> None:
    """Notes the ways that walkers on the c-th crossing exclude."""
    for way in range(len(streets.pieces)):
        for size in range(2):
            if streets.begin[size, way, len(streets.pieces) + c] < np.inf:
                taken[size, way] |= is_walked(streets, crossings, c, way, size)


@compiled
def _is_ready(streets: Streets, car: Any, k: int, dt: float) -> bool:
    """Returns whether a vehicle has waited for a signal, or at a stop line.

    Args:
        streets: the lanes, and the ego car.
        car: a record `VEHICLE`, in a lane.
        k: number of the time.
        dt: the step [s].
    """
    t, way = k * dt, car.path[CURRENT + 1]
    row = streets.pieces[way]
    if 0.0 < streets.until[k, car.path[CURRENT]] < _EGO_IS_NEAR:
        return True
    if row.phase < 0:
        return t >= car.since + _STOPS
    return _until_red(streets, way, t) > 0.0


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
