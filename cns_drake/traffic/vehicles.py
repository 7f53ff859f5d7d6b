"""Vehicles in lanes: car following, lane changes, choice of directions.

Vehicles follow each other by the Intelligent Driver Model of Treiber, Hennecke,
Helbing (see `VehicleKind`). They change lanes by MOBIL of Kesting, Treiber,
Helbing (2007): a driver changes lanes if the driver gains more acceleration
than other drivers lose, and no other vehicle has to brake hard.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.base.elementary import arcsin, arctan2
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.random_numbers import uniform
from cns_drake.traffic.streets import (
    MERGE,
    SPLIT,
    STEP,
    Streets,
    is_ego_far,
    places_on,
    speed_on,
)
from cns_drake.traffic.vehicle_kinds import KINDS, STANDSTILL_GAP, VehicleKind

# Column of a vehicle's path with the piece of its front bumper. The columns
# before it are for the rear, those behind it for pieces ahead.
CURRENT = 5
NUM_PIECES = 8
# Number of the ego car among occupants.
EGO = -1
# Greatest number of pieces that one vehicle is on.
_MOST_ENTRIES = 8

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
# At this gap, drivers brake as in an emergency [m].
_LEAST_GAP = 0.5

# Small, and large, vehicles may pass a pedestrian whose middle is this far
# beyond the middle of their way [m].
_PASSED = (2.0, 3.5)

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

# At the start, a vehicle needs this length of lane in addition to its own [m].
_SPACE = 9.0
# At the start, a vehicle drives at this share of the allowed speed.
_PART_OF_SPEED = 0.5
# Number of random places that are tried for a vehicle.
_TRIES = 200

# A vehicle as a record: its constants and its present state.
VEHICLE = np.dtype(
    [
        ("length", float),  # [m]
        ("rear_axle", float),  # x from the middle [m].
        ("front_axle", float),
        ("factor", float),  # Wanted share of the allowed speed.
        ("top", float),  # Greatest speed [m/s].
        ("a", float),  # Car-following model: a, b, headway.
        ("b", float),
        ("headway", float),
        ("guided", bool),  # Whether it is the ego car, which `Follower` moves.
        ("large", bool),  # Whether it leaves its lane in turns.
        ("path", int, NUM_PIECES),  # Pieces, -1 for none.
        ("s", float),  # The front bumper's place on the current piece [m].
        ("v", float),  # Speed [m/s].
        ("granted", bool),  # Whether it may leave its lane.
        ("held", int),  # The way that is kept free for it; -1 for none.
        ("order", int),  # Order among vehicles with a way: lowest first.
        ("since", float),  # When it began to wait for its way; inf: never [s].
        ("refused", float),  # Time without room beyond its way [s].
        ("left_lane", int),  # The lane that it is leaving; -1 for none.
        ("change_start", float),  # Where a lane change begins, on the lane [m].
        ("change_length", float),
        ("draws", int),  # Count of the random numbers it has drawn.
    ],
    align=True,
)
# An entry in the list of vehicles on a piece: the part of a vehicle on this
# piece.
_ENTRY = np.dtype(
    [
        ("after", int),  # The next entry on the piece; -1 for none.
        ("who", int),  # Number of a vehicle, or `EGO`.
        ("rear", float),  # Along the piece [m].
        ("front", float),
        ("speed", float),  # [m/s]
    ]
)
# A crossing as a record, with the pedestrians on it.
CROSSING = np.dtype(
    [
        ("waits", float),  # When pedestrians began to wait; inf: none [s].
        ("opened", float),  # Time at which it was last opened [s].
        ("closed", float),  # Time at which it was last left [s].
        ("start", float, 2),  # Where its line begins [m].
        ("along", float, 2),  # Unit vector along it.
        ("length", float),  # [m]
        ("users", int),  # Number of pedestrians with permission.
        ("order", int),  # As in `VEHICLE`; 0 while no pedestrians ask.
        ("is_open", bool),  # Whether pedestrians are on it.
        ("marked", bool),  # See `Crossing`.
        # Pedestrians who go to the end, and to the beginning, of its line have
        # yet to walk beyond these places [m].
        ("to_end", float),
        ("to_start", float),
    ]
)


class Traffic(NamedTuple):
    """Vehicles and crossings while they are simulated.

    Attributes:
        streets: arrays of the P pieces of lanes and junction paths.
        cars: (N,) records of dtype `VEHICLE`.
        crossings: (C,) records of dtype `CROSSING`.
        seed: seed of the random directions at junctions.
        head: (P,) number of the first entry in the list of vehicles on each
            piece; -1 for an empty list.
        entries: the entries of all these lists; each contains the number of the
            next entry. `find_occupants` fills the lists.
    """

    streets: Streets
    cars: np.ndarray
    crossings: np.ndarray
    seed: int
    head: np.ndarray
    entries: np.ndarray


def begin_traffic(
    streets: Streets, cars: np.ndarray, crossings: np.ndarray, seed: int
) -> Traffic:
    """Returns the traffic at the start of a simulation.

    Args:
        streets: arrays of all lanes.
        cars: (N,) records of dtype `VEHICLE`.
        crossings: (C,) records of dtype `CROSSING`.
        seed: seed of the random directions at junctions.
    """
    num_pieces = len(streets.pieces)
    entries = np.zeros(_MOST_ENTRIES * len(cars) + num_pieces, _ENTRY)
    head = np.full(num_pieces, -1)
    return Traffic(streets, cars, crossings, seed, head, entries)


def make_crossings(graph: LaneGraph) -> np.ndarray:
    """Returns the crossings of a lane graph, (C,) of dtype `CROSSING`.

    No pedestrians are on them yet.
    """
    crossings = np.zeros(len(graph.crossings), CROSSING)
    crossings["waits"] = np.inf
    crossings["opened"] = crossings["closed"] = -np.inf
    crossings["to_end"], crossings["to_start"] = -np.inf, np.inf
    for row, one in zip(crossings, graph.crossings, strict=True):
        start, end = one.line[[0, -1], :2]
        x, y = end - start
        row["length"] = np.sqrt(x * x + y * y)
        row["start"], row["along"] = start, (end - start) / row["length"]
        row["marked"] = one.marked
    return crossings


def room_for_vehicles(graph: LaneGraph) -> int:
    """Returns the number of vehicles that can move in the lanes of a graph."""
    mean = sum(kind.share * kind.size[0] for kind in KINDS)
    mean /= sum(kind.share for kind in KINDS)
    return int(
        sum(graph.pieces[k].length // (mean + 2 * _SPACE) for k in graph.lanes)
    )


def place_vehicles(
    kinds: Sequence[VehicleKind], streets: Streets, rng: np.random.Generator
) -> tuple[np.ndarray, list[int]]:
    """Places vehicles in lanes at random, away from the ego car's first place.

    Args:
        kinds: kind of each vehicle.
        streets: arrays of all lanes, with the ego car.
        rng: the random generator.

    Returns:
        Records of dtype `VEHICLE` of the vehicles for which a place was found;
        and the index of each of these vehicles in `kinds`.
    """
    free = np.flatnonzero(~streets.pieces["is_way"])
    lengths = streets.pieces["length"]
    share = lengths[free] / lengths[free].sum()
    taken: dict[int, list[tuple[float, float]]] = {}
    found, paths, places = [], [], []
    for number, kind in enumerate(kinds):
        for _ in range(_TRIES):
            lane = int(rng.choice(free, p=share))
            length = lengths[lane]
            low = kind.size[0] + 1.0
            if length < low + 1.0:
                continue
            s = float(rng.uniform(low, length - 1.0))
            span = (s - kind.size[0] - _SPACE / 2, s + _SPACE / 2)
            if any(span[0] < b and a < span[1] for a, b in taken.get(lane, [])):
                continue
            if streets.until[0, lane] == 0.0 or not is_ego_far(
                streets, 0, lane, s
            ):
                continue
            taken.setdefault(lane, []).append(span)
            found.append(number)
            paths.append(lane)
            places.append(s)
            break
    cars = np.zeros(len(found), VEHICLE)
    for name in ("held", "left_lane", "path"):
        cars[name] = -1
    cars["since"], cars["change_length"] = np.inf, 1.0
    cars["path"][:, CURRENT], cars["s"] = paths, places
    for car, kind in zip(cars, (kinds[k] for k in found), strict=True):
        car["length"], car["large"] = kind.size[0], kind.is_large
        car["rear_axle"], car["front_axle"] = kind.axles
        car["top"], car["factor"] = kind.top_speed, kind.speed_factor
        car["a"], car["b"] = kind.acceleration, kind.deceleration
        car["headway"] = kind.headway
    cars["factor"] *= rng.uniform(0.9, 1.1, len(cars))
    lanes = streets.pieces[paths]
    points = lanes["first"] + (cars["s"] / lanes["step"]).astype(int)
    allowed = streets.speed[points]
    v = _PART_OF_SPEED * np.minimum(cars["top"], cars["factor"] * allowed)
    # Vehicles must be able to stop before the line or behind the vehicle ahead.
    left = np.minimum(lanes["length"] - cars["s"], _SPACE / 2)
    cars["v"] = np.minimum(v, np.sqrt(1.5 * left))
    return cars, found


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
    """Returns x, y, z at a distance `back` behind each front bumper [m]."""
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
    """Returns x, y, z of places between the lane left and the new lane [m].

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


@compiled
def find_occupants(traffic: Traffic, k: int) -> None:
    """Updates the lists of the vehicles on each piece, in place.

    A vehicle is in the list of each piece on which it stands. This includes the
    ego car.

    Args:
        traffic: the traffic, whose arrays `head` and `entries` this function
            overwrites.
        k: number of the time step.
    """
    streets, cars = traffic.streets, traffic.cars
    pieces = streets.pieces
    traffic.head[:] = -1
    free = 0
    for i in range(len(cars)):
        car = cars[i]
        rear, front = car.s - car.length, car.s
        column = CURRENT
        while column >= 0:
            piece = car.path[column]
            if piece < 0:
                break
            free = _write_entry(traffic, free, piece, i, rear, front, car.v)
            other = car.left_lane
            if column == CURRENT and other >= 0:
                there = front * (pieces[other].length / pieces[piece].length)
                behind = there - car.length
                free = _write_entry(
                    traffic, free, other, i, behind, there, car.v
                )
            if rear >= 0.0:
                break
            column -= 1
            before = car.path[column] if column >= 0 else -1
            if before >= 0:
                rear += pieces[before].length
                front = pieces[before].length
    for piece in range(len(pieces)):
        if streets.until[k, piece] == 0.0:
            rear = streets.ego_rear[k, piece]
            front = streets.ego_front[k, piece]
            speed = streets.ego_speed[k, piece]
            free = _write_entry(traffic, free, piece, EGO, rear, front, speed)


@compiled
def _write_entry(
    traffic: Traffic,
    number: int,
    piece: int,
    who: int,
    rear: float,
    front: float,
    speed: float,
) -> int:
    """Writes an entry with a number; returns the next number."""
    entry = traffic.entries[number]
    entry.after = traffic.head[piece]
    entry.who, entry.rear, entry.front, entry.speed = who, rear, front, speed
    traffic.head[piece] = number
    return number + 1


@compiled
def find_ahead(
    traffic: Traffic, piece: int, s: float, who: int
) -> tuple[float, float]:
    """Returns the gap to the next vehicle ahead [m], and its speed [m/s].

    Only vehicles on the given piece count. If no vehicle is ahead on this
    piece, the gap is infinite and the speed 0.

    Args:
        traffic: the vehicles, listed by pieces of the lane graph.
        piece: number of the piece of the lane graph.
        s: distance of the front bumper along the piece [m].
        who: number of the vehicle for which the gap is computed.
    """
    gap, speed = np.inf, 0.0
    at = traffic.head[piece]
    while at >= 0:
        other = traffic.entries[at]
        ahead = other.front > s or (other.front == s and other.who < who)
        if other.who != who and ahead and other.rear - s < gap:
            gap, speed = other.rear - s, other.speed
        at = other.after
    return gap, speed


@compiled
def free_acceleration(car: Any, v0: float) -> float:
    """Returns a vehicle's acceleration on a free road [m/s^2].

    Above the desired speed, the vehicle brakes no harder than is comfortable.

    Args:
        car: the vehicle, a record of dtype `VEHICLE`.
        v0: the vehicle's desired speed [m/s].
    """
    if v0 < 0.01:
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
def lane_over(streets: Streets, car: Any, c: int) -> tuple[int, float, float]:
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
    number = len(streets.pieces) + c
    for column in range(CURRENT, NUM_PIECES):
        piece = car.path[column]
        if piece < 0:
            break
        row = streets.pieces[piece]
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
            lane, enters, _ = lane_over(streets, car, c)
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
                if braking > 0.6 * car.b:
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
    """Returns whether the i-th vehicle gains by a change to a lane."""
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


@compiled
def advance(traffic: Traffic, accelerations: np.ndarray) -> None:
    """Moves all vehicles by one time step, with accelerations (N,) [m/s^2]."""
    cars, pieces = traffic.cars, traffic.streets.pieces
    for i in range(len(cars)):
        car = cars[i]
        if car.guided:
            continue
        v = max(0.0, car.v + accelerations[i] * STEP)
        s = car.s + 0.5 * (car.v + v) * STEP
        while True:
            piece = pieces[car.path[CURRENT]]
            left = piece.length - s
            if left > 0.0:
                break
            if not piece.is_way and not car.granted:
                s, v = piece.length, 0.0
                break
            s = -left
            for column in range(NUM_PIECES - 1):
                car.path[column] = car.path[column + 1]
            car.path[NUM_PIECES - 1] = -1
            if not pieces[car.path[CURRENT]].is_way:
                car.granted = False
                choose_way(traffic, i)
        car.s, car.v = s, v
        rear = s - car.length
        # A vehicle before its way keeps the permission that it has just got.
        is_before = car.held == car.path[CURRENT + 1] and car.granted
        if car.held >= 0 and not (piece.is_way or rear < 0.0 or is_before):
            car.held = -1
        if car.left_lane >= 0 and rear - car.change_start >= car.change_length:
            car.left_lane = -1


@compiled
def choose_way(traffic: Traffic, i: int) -> None:
    """Chooses at random where the i-th vehicle goes at the next junction.

    Two directions are sampled, and the direction that leads to the emptier lane
    is chosen. Thus no street stays empty while vehicles queue in other streets.
    """
    streets, cars = traffic.streets, traffic.cars
    car = cars[i]
    lane = streets.pieces[car.path[CURRENT]]
    least = np.inf
    for _ in range(2):
        car.draws += 1
        pick = uniform(traffic.seed, i, car.draws)
        row = lane.after_first
        last = row + lane.after_count - 1
        while row < last and pick >= streets.liked[row]:
            row += 1
        way = streets.after[row]
        beyond = streets.after[streets.pieces[way].after_first]
        number = 0.0
        for j in range(len(cars)):
            number += (
                cars[j].path[CURRENT] == beyond
                or cars[j].path[CURRENT + 2] == beyond
            )
        filled = number / streets.pieces[beyond].length
        if filled < least:
            least = filled
            car.path[CURRENT + 1], car.path[CURRENT + 2] = way, beyond
