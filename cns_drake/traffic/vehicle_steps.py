"""One step of time for all vehicles."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.car_following import (
    HARDEST_BRAKING,
    free_acceleration,
    interaction,
)
from cns_drake.traffic.lane_arrays import LaneArrays, place_on, speed_on
from cns_drake.traffic.right_of_way import Permits, choose_way
from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP
from cns_drake.traffic.vehicle_state import (
    CURRENT,
    NUM_PIECES,
    Occupants,
    Vehicles,
    find_ahead,
)

# Distance kept from the stop line [m].
_BEFORE_LINE = 0.5
# Greatest distance that drivers look ahead [m].
_SIGHT = 120.0
# The least gap that a step leaves, independent of the model [m].
_LEAST_GAP = 0.5


@compiled
def accelerations(
    lanes: LaneArrays, vehicles: Vehicles, occupants: Occupants
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the (N,) accelerations [m/s^2], and gaps ahead [m]."""
    count = len(vehicles.s)
    result, gaps = np.zeros(count), np.zeros(count)
    for i in range(count):
        lane = vehicles.path[i, CURRENT]
        s, v = vehicles.s[i], vehicles.v[i]
        a, b, T = vehicles.a[i], vehicles.b[i], vehicles.headway[i]
        left = lanes.length[lane] - s
        factor, top = vehicles.factor[i], vehicles.top[i]
        v0 = min(top, factor * speed_on(lanes, lane, s))
        wanted = free_acceleration(v, v0, a, b)
        goes_on = lanes.is_way[lane] or vehicles.granted[i]
        if not goes_on:
            # The driver brakes as for a vehicle behind the stop line.
            gap = left + STANDSTILL_GAP - _BEFORE_LINE
            wanted -= interaction(v, gap, v, a, b, STANDSTILL_GAP, T)
        gap, speed = find_ahead(occupants, lane, s, i)
        if vehicles.left_lane[i] >= 0:
            other = vehicles.left_lane[i]
            scale = lanes.length[other] / lanes.length[lane]
            gap_2, speed_2 = find_ahead(occupants, other, s * scale, i)
            if gap_2 < gap:
                gap, speed = gap_2, speed_2
        column, begin = CURRENT + 1, left
        while goes_on and gap == np.inf and begin < _SIGHT:
            piece = vehicles.path[i, column]
            if piece < 0:
                break
            v1 = min(top, factor * speed_on(lanes, piece, 0.0))
            if v1 < v:
                braking = (v**2 - v1**2) / (2.0 * max(begin, 0.5))
                if braking > 0.6 * b:
                    wanted = min(wanted, -braking)
            gap, speed = find_ahead(occupants, piece, -begin, i)
            begin += lanes.length[piece]
            column += 1
            if column == NUM_PIECES:
                break
        gaps[i] = gap
        if gap < _SIGHT:
            wanted -= interaction(v, gap, v - speed, a, b, STANDSTILL_GAP, T)
        result[i] = max(wanted, -HARDEST_BRAKING)
    return result, gaps


@compiled
def advance(
    lanes: LaneArrays,
    vehicles: Vehicles,
    permits: Permits,
    accelerations: np.ndarray,
    gaps: np.ndarray,
    dt: float,
    seed: int,
) -> None:
    """Moves all vehicles on.

    Args:
        lanes: all of them.
        vehicles: all of them.
        permits: of ways and crossings.
        accelerations: (N,) [m/s^2].
        gaps: (N,) to the next ahead [m].
        dt: the step [s].
        seed: of the drawn ways.
    """
    for i in range(len(vehicles.s)):
        v = vehicles.v[i]
        v_new = max(0.0, v + accelerations[i] * dt)
        step = 0.5 * (v + v_new) * dt
        room = max(0.0, gaps[i] - _LEAST_GAP)
        if step > room:
            step, v_new = room, min(v_new, room / dt)
        s = vehicles.s[i] + step
        while True:
            piece = vehicles.path[i, CURRENT]
            left = lanes.length[piece] - s
            if left > 0.0:
                break
            if not lanes.is_way[piece] and not vehicles.granted[i]:
                s, v_new = lanes.length[piece], 0.0
                break
            s = -left
            for column in range(NUM_PIECES - 1):
                vehicles.path[i, column] = vehicles.path[i, column + 1]
            vehicles.path[i, NUM_PIECES - 1] = -1
            if not lanes.is_way[vehicles.path[i, CURRENT]]:
                vehicles.granted[i] = False
                choose_way(vehicles, lanes, i, seed)
        vehicles.s[i], vehicles.v[i] = s, v_new
        piece = vehicles.path[i, CURRENT]
        rear = s - vehicles.length[i]
        if vehicles.held[i] >= 0 and not lanes.is_way[piece] and rear >= 0.0:
            way = vehicles.held[i]
            # A vehicle still before its way keeps the permit it has just got.
            if way != vehicles.path[i, CURRENT + 1] or not vehicles.granted[i]:
                if vehicles.large[i]:
                    permits.large[way] -= 1
                else:
                    permits.small[way] -= 1
                vehicles.held[i] = -1
        if vehicles.left_lane[i] >= 0:
            done = rear - vehicles.change_start[i]
            if done >= vehicles.change_length[i]:
                vehicles.left_lane[i] = -1


@compiled
def place_of(
    lanes: LaneArrays, vehicles: Vehicles, i: int, back: float
) -> tuple[float, float, float]:
    """Returns a place on a vehicle's path.

    Args:
        lanes: all of them.
        vehicles: all of them.
        i: number of the vehicle.
        back: distance behind its front bumper [m].
    """
    s, column = vehicles.s[i] - back, CURRENT
    while s < 0.0 and column > 0 and vehicles.path[i, column - 1] >= 0:
        column -= 1
        s += lanes.length[vehicles.path[i, column]]
    piece = vehicles.path[i, column]
    place = place_on(lanes, piece, s)
    if column == CURRENT and vehicles.left_lane[i] >= 0:
        other = vehicles.left_lane[i]
        start, length = vehicles.change_start[i], vehicles.change_length[i]
        u = min(max((s - start) / length, 0.0), 1.0)
        share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        scale = lanes.length[other] / lanes.length[piece]
        before = place_on(lanes, other, vehicles.s[i] * scale - back)
        place = (
            before[0] + share * (place[0] - before[0]),
            before[1] + share * (place[1] - before[1]),
            before[2] + share * (place[2] - before[2]),
        )
    return place


@compiled
def write_poses(
    lanes: LaneArrays, vehicles: Vehicles, poses: np.ndarray
) -> None:
    """Writes the poses of all vehicles.

    Both axles are on the path; the vehicle is straight between them.

    Args:
        lanes: all of them.
        vehicles: all of them.
        poses: (N, 5) takes x, y, z of the middle of the box on the ground
            [m], yaw and pitch [rad].
    """
    for i in range(len(vehicles.s)):
        half = 0.5 * vehicles.length[i]
        front = place_of(lanes, vehicles, i, half - vehicles.front_axle[i])
        rear = place_of(lanes, vehicles, i, half - vehicles.rear_axle[i])
        x, y, z = front[0] - rear[0], front[1] - rear[1], front[2] - rear[2]
        length = np.sqrt(x * x + y * y + z * z)
        x, y, z = x / length, y / length, z / length
        poses[i, 0] = rear[0] - vehicles.rear_axle[i] * x
        poses[i, 1] = rear[1] - vehicles.rear_axle[i] * y
        poses[i, 2] = rear[2] - vehicles.rear_axle[i] * z
        poses[i, 3] = np.arctan2(y, x)
        poses[i, 4] = -np.arcsin(z)
