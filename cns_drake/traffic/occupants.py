"""Which vehicles are on each piece of the lane graph, and which is ahead."""

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.vehicle_records import CURRENT, Traffic

# Number of the ego car among occupants.
EGO = -1


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
