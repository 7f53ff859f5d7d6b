"""The state of all vehicles during planning, and the occupants of pieces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_arrays import LaneArrays
from cns_drake.traffic.presence import Presence

# Columns of `path`: the piece of the front bumper, with as many pieces before
# it, for the rear, and after it.
CURRENT = 5
NUM_PIECES = 8
# Stands for the ego car.
EGO = -1
# Greatest number of pieces under a vehicle.
_MOST_ENTRIES = 8


class Vehicles(NamedTuple):
    """N vehicles: their constants, and their present state.

    Attributes:
        length: [m].
        rear_axle, front_axle: x from the middle [m].
        factor, top: wanted part of the allowed speed, and greatest speed [m/s].
        a, b, headway: of the car-following model.
        large: whether it sweeps more than its lane in turns.
        path: (N, NUM_PIECES) pieces, -1 for none.
        s: of the front bumper, along the current piece [m].
        v: speed [m/s].
        granted: whether it may leave its lane.
        held: the way that is kept free for it, -1 for none.
        since: start of its wait for its way, inf without a wait [s].
        refused: time without room beyond its way [s].
        left_lane: the lane that it is changing from, -1 for none.
        change_start, change_length: of the lane change, along the lane [m].
        draws: number of random numbers that each has drawn.
    """

    length: np.ndarray
    rear_axle: np.ndarray
    front_axle: np.ndarray
    factor: np.ndarray
    top: np.ndarray
    a: np.ndarray
    b: np.ndarray
    headway: np.ndarray
    large: np.ndarray
    path: np.ndarray
    s: np.ndarray
    v: np.ndarray
    granted: np.ndarray
    held: np.ndarray
    since: np.ndarray
    refused: np.ndarray
    left_lane: np.ndarray
    change_start: np.ndarray
    change_length: np.ndarray
    draws: np.ndarray


class Occupants(NamedTuple):
    """The vehicles on each piece, as a linked list with their parts.

    Attributes:
        head: (P,) the first entry of a piece, -1 for none.
        after: the next entry on the same piece.
        who: number of a vehicle, or `EGO`.
        rear, front: along the piece [m].
        speed: [m/s].
    """

    head: np.ndarray
    after: np.ndarray
    who: np.ndarray
    rear: np.ndarray
    front: np.ndarray
    speed: np.ndarray


def make_occupants(num_pieces: int, num_vehicles: int) -> Occupants:
    """Returns room for the entries of all vehicles and the ego car."""
    size = _MOST_ENTRIES * num_vehicles + num_pieces
    return Occupants(
        np.full(num_pieces, -1),
        np.full(size, -1),
        np.zeros(size, np.int64),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
    )


@compiled
def find_occupants(
    occupants: Occupants,
    lanes: LaneArrays,
    vehicles: Vehicles,
    presence: Presence,
    k: int,
) -> None:
    """Notes the places of all vehicles at the k-th time."""
    occupants.head[:] = -1
    free = 0
    for i in range(len(vehicles.s)):
        rear = vehicles.s[i] - vehicles.length[i]
        front = vehicles.s[i]
        column = CURRENT
        while column >= 0:
            piece = vehicles.path[i, column]
            if piece < 0:
                break
            free = _enter(occupants, free, piece, i, rear, front, vehicles.v[i])
            if column == CURRENT and vehicles.left_lane[i] >= 0:
                other = vehicles.left_lane[i]
                scale = lanes.length[other] / lanes.length[piece]
                free = _enter(
                    occupants,
                    free,
                    other,
                    i,
                    front * scale - vehicles.length[i],
                    front * scale,
                    vehicles.v[i],
                )
            if rear >= 0.0:
                break
            column -= 1
            before = vehicles.path[i, column] if column >= 0 else -1
            if before >= 0:
                rear += lanes.length[before]
                front = lanes.length[before]
    for piece in range(len(lanes.first)):
        if presence.until[k, piece] == 0.0:
            free = _enter(
                occupants,
                free,
                piece,
                EGO,
                presence.rear[k, piece],
                presence.front[k, piece],
                presence.speed[k, piece],
            )


@compiled
def _enter(
    occupants: Occupants,
    entry: int,
    piece: int,
    who: int,
    rear: float,
    front: float,
    speed: float,
) -> int:
    occupants.after[entry] = occupants.head[piece]
    occupants.head[piece] = entry
    occupants.who[entry] = who
    occupants.rear[entry] = rear
    occupants.front[entry] = front
    occupants.speed[entry] = speed
    return entry + 1


@compiled
def find_ahead(
    occupants: Occupants, piece: int, s: float, who: int
) -> tuple[float, float]:
    """Returns the gap to the next one ahead on a piece [m], and its speed.

    Args:
        occupants: of all pieces.
        piece: to search.
        s: place of the front bumper [m].
        who: the vehicle.
    """
    gap, speed = np.inf, 0.0
    entry = occupants.head[piece]
    while entry >= 0:
        other = occupants.who[entry]
        ahead = occupants.front[entry] > s or (
            occupants.front[entry] == s and other < who
        )
        if other != who and ahead and occupants.rear[entry] - s < gap:
            gap = occupants.rear[entry] - s
            speed = occupants.speed[entry]
        entry = occupants.after[entry]
    return gap, speed


@compiled
def find_behind(
    occupants: Occupants, piece: int, s: float, who: int
) -> tuple[float, float, int]:
    """Returns the gap to the next one behind [m], its speed and number.

    Args:
        occupants: of all pieces.
        piece: to search.
        s: place of the rear bumper [m].
        who: the vehicle.
    """
    gap, speed, found = np.inf, 0.0, -2
    entry = occupants.head[piece]
    while entry >= 0:
        other = occupants.who[entry]
        if other != who and occupants.rear[entry] <= s:
            behind = s - occupants.front[entry]
            if behind < gap:
                gap, speed, found = behind, occupants.speed[entry], other
        entry = occupants.after[entry]
    return gap, speed, found
