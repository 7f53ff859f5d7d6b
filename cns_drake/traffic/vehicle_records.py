"""Vehicles and crossings as records, and which vehicles are on each piece."""

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.streets import Streets

# Column of a vehicle's path with the piece of its front bumper. The columns
# before it are for the rear, and the columns behind it are for pieces ahead.
CURRENT = 5
NUM_PIECES = 8
# Number of the ego car among occupants.
EGO = -1
# Greatest number of pieces that one vehicle is on.
_MOST_ENTRIES = 8

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
    for row, crossing in zip(crossings, graph.crossings, strict=True):
        start, end = crossing.line[[0, -1], :2]
        x, y = end - start
        row["length"] = np.sqrt(x * x + y * y)
        row["start"], row["along"] = start, (end - start) / row["length"]
        row["marked"] = crossing.marked
    return crossings


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
    """Writes an entry with a number; returns the next number.

    The entry is put at the beginning of the list of its piece.

    Args:
        traffic: vehicles, whose lists are changed in place.
        number: number of the entry.
        piece: number of the piece.
        who: number of a vehicle, or `EGO`.
        rear, front: ends of the vehicle's part on the piece [m].
        speed: speed of the vehicle along the piece [m/s].
    """
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
