"""One step of time for all walkers: the social force model.

Helbing, Molnar, "Social force model for pedestrian dynamics", Phys. Rev. E 51
(1995): walkers relax to their wanted speed, and keep away from each other and
from the edges of their walkway.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_graph import SPACING
from cns_drake.traffic.overlaps import boxes_overlap
from cns_drake.traffic.right_of_way import WALK_GROUP, Permits
from cns_drake.traffic.walker_ways import (
    Walkers,
    WalkwayArrays,
    begin,
    distance_along,
    draw_next,
    height_of,
    may_begin,
    row_of,
    tangent_of,
)

# The model's wanted speed, and its spread [m/s]; relaxation [s]; strength
# [m/s^2] and reach [m] of the repulsion by walkers, and by edges.
SPEED, SPREAD = 1.34, 0.26
_RELAXATION = 0.5
_STRENGTH, _REACH = 7.0, 0.3
_EDGE_STRENGTH, _EDGE_REACH = 10.0, 0.2
# Greatest speed, as a multiple of the wanted speed.
_HURRY = 1.3
# The least distance of two walkers' middles, and the radius of neighbours [m].
APART = 0.95
_NEAR = 4.0
# Boxes of walkers with swinging limbs [m], and least space between them [m].
WALKER_LENGTH, WALKER_WIDTH, _GAP = 0.84, 0.6, 0.15
# A walker steps aside for one ahead with this acceleration [m/s^2], unless the
# other is at least this far to the side [m].
_ASIDE, _PASSING = 4.0, 0.85
_TO_THE_RIGHT = 0.3
# Distance ahead of a walker's aim [m].
_AHEAD = 2.0
# A walker turns to its direction of motion at this rate [rad/s], if it is at
# least this fast [m/s].
_TURN_RATE, _GOING = 2.5, 0.2
# Distance of a waiting walker from the crossing [m].
_AT_NODE = 1.0
# Greatest speed of the return to a walkway [m/s].
_BACK = 0.6
# A walker turns back after being blocked for this time [s].
_PATIENCE = 4.0


@compiled
def step_walkers(
    ways: WalkwayArrays,
    walkers: Walkers,
    permits: Permits,
    num_pieces: int,
    t: float,
    dt: float,
    seed: int,
) -> None:
    """Moves all walkers on.

    Args:
        ways: of the walkers.
        walkers: all of them.
        permits: of the crossings.
        num_pieces: rows of `permits` before the crossings.
        t, dt: time and step [s].
        seed: of the ways that are drawn.
    """
    count = len(walkers.speed)
    for c in range(len(permits.waits)):
        if permits.opened[c] + WALK_GROUP <= t and permits.opened[c] >= 0.0:
            # The placeholder's permit ends when the group begins to walk.
            permits.small[num_pieces + c] -= 1
            permits.opened[c] = -np.inf
            permits.closed[c] = t
    waited = np.zeros(len(permits.waits), np.bool_)
    force = np.zeros((count, 2))
    is_waiting = np.zeros(count, np.bool_)
    for i in range(count):
        way, forward = walkers.way[i], walkers.forward[i]
        # The walker's progress along its walkway.
        while walkers.at[i] < ways.num_points[way] - 2:
            tangent = tangent_of(ways, way, forward, walkers.at[i])
            here = row_of(ways, way, forward, walkers.at[i])
            if -distance_along(ways, here, walkers, i, tangent) < SPACING:
                break
            walkers.at[i] += 1
        last = row_of(ways, way, forward, ways.num_points[way] - 1)
        tangent = tangent_of(ways, way, forward, walkers.at[i])
        is_near = (
            walkers.at[i] >= ways.num_points[way] - 3
            and distance_along(ways, last, walkers, i, tangent) < _AT_NODE
        )
        waits = False
        if is_near:
            if walkers.next_way[i] < 0:
                draw_next(ways, walkers, i, seed)
            after = walkers.next_way[i]
            if may_begin(ways, permits, waited, num_pieces, after, t):
                begin(ways, walkers, permits, num_pieces, i, t)
                way, forward = walkers.way[i], walkers.forward[i]
                tangent = tangent_of(ways, way, forward, walkers.at[i])
            else:
                waits = is_waiting[i] = True
        right = (tangent[1], -tangent[0])
        half = ways.half_width[way]
        wanted_x = wanted_y = 0.0
        if not waits:
            ahead = walkers.at[i] + int(_AHEAD / SPACING)
            target = row_of(ways, way, forward, ahead)
            aside = walkers.aside[i] * half
            x = ways.points[target, 0] + aside * right[0] - walkers.xy[i, 0]
            y = ways.points[target, 1] + aside * right[1] - walkers.xy[i, 1]
            distance = max(np.sqrt(x * x + y * y), 1e-6)
            wanted_x = walkers.speed[i] * x / distance
            wanted_y = walkers.speed[i] * y / distance
        force[i, 0] += (wanted_x - walkers.velocity[i, 0]) / _RELAXATION
        force[i, 1] += (wanted_y - walkers.velocity[i, 1]) / _RELAXATION
        here = row_of(ways, way, forward, walkers.at[i])
        across = -distance_along(ways, here, walkers, i, right)
        for side in (-1.0, 1.0):
            room = half - side * across
            push = side * _EDGE_STRENGTH * np.exp(-max(room, 0.0) / _EDGE_REACH)
            force[i, 0] -= push * right[0]
            force[i, 1] -= push * right[1]
    for c in range(len(waited)):
        if not waited[c]:
            permits.waits[c] = np.inf
    for i in range(count):
        for j in range(i):
            x = walkers.xy[i, 0] - walkers.xy[j, 0]
            y = walkers.xy[i, 1] - walkers.xy[j, 1]
            square = x * x + y * y
            if square < _NEAR**2:
                distance = max(np.sqrt(square), 1e-3)
                push = _STRENGTH * np.exp(-max(distance - APART, 0.0) / _REACH)
                # A little to the right, or two walkers who meet head on would
                # stop.
                push_x = push * (x - _TO_THE_RIGHT * y) / distance
                push_y = push * (y + _TO_THE_RIGHT * x) / distance
                force[i, 0] += push_x
                force[i, 1] += push_y
                force[j, 0] -= push_x
                force[j, 1] -= push_y
                _step_aside(walkers, force, i, -x, -y, distance)
                _step_aside(walkers, force, j, x, y, distance)
    for i in range(count):
        x = walkers.velocity[i, 0] + force[i, 0] * dt
        y = walkers.velocity[i, 1] + force[i, 1] * dt
        speed = np.sqrt(x * x + y * y)
        fastest = _HURRY * walkers.speed[i]
        if speed > fastest:
            x *= fastest / speed
            y *= fastest / speed
        _move(ways, walkers, i, x, y, dt)
        x, y = walkers.velocity[i, 0], walkers.velocity[i, 1]
        speed = np.sqrt(x * x + y * y)
        walkers.phase[i] += gait_rate(speed) * dt
        way = walkers.way[i]
        is_stuck = speed < _GOING and not is_waiting[i]
        walkers.stuck[i] = walkers.stuck[i] + dt if is_stuck else 0.0
        if walkers.stuck[i] > _PATIENCE and ways.crossing[way] < 0:
            walkers.stuck[i] = 0.0
            walkers.forward[i] = not walkers.forward[i]
            walkers.at[i] = max(ways.num_points[way] - 2 - walkers.at[i], 0)
            walkers.next_way[i] = -1


@compiled
def _step_aside(
    walkers: Walkers,
    force: np.ndarray,
    i: int,
    x: float,
    y: float,
    distance: float,
) -> None:
    """Pushes a walker aside from another one in its way.

    Args:
        walkers: all of them.
        force: (N, 2) to add to [m/s^2].
        i: number of the walker.
        x, y: place of the other relative to it [m].
        distance: of both [m].
    """
    c, s = np.cos(walkers.yaw[i]), np.sin(walkers.yaw[i])
    ahead, aside = x * c + y * s, y * c - x * s
    if ahead <= 0.0 or abs(aside) >= _PASSING:
        return
    push = _ASIDE * (1.0 - distance / _NEAR) * (1.0 - abs(aside) / _PASSING)
    # Away from the other one; to the right if it is straight ahead.
    side = -1.0 if aside >= -0.05 else 1.0
    force[i, 0] -= side * push * s
    force[i, 1] += side * push * c


@compiled
def gait_rate(speed: float) -> float:
    """Returns the rate of a gait's phase [rad/s].

    A stride, of two steps, is as long as 0.7 s of a walk at that speed and
    0.4 m more.
    """
    return 2.0 * np.pi * speed / (0.7 * speed + 0.4)


@compiled
def write_walkers(
    ways: WalkwayArrays, walkers: Walkers, poses: np.ndarray
) -> None:
    """Writes x, y, z [m], yaw, phase [rad] of all walkers to (N, 5) poses."""
    for i in range(len(walkers.speed)):
        poses[i, 0] = walkers.xy[i, 0]
        poses[i, 1] = walkers.xy[i, 1]
        poses[i, 2] = height_of(ways, walkers, i)
        poses[i, 3] = walkers.yaw[i]
        poses[i, 4] = walkers.phase[i]


@compiled
def _is_free(walkers: Walkers, i: int, x: float, y: float, yaw: float) -> bool:
    """Returns whether a walker's box would be free at a place."""
    half = np.array([WALKER_LENGTH / 2 + _GAP / 2, WALKER_WIDTH / 2 + _GAP / 2])
    reach = 4.0 * (half[0] ** 2 + half[1] ** 2)
    a, b = np.array([x, y, yaw]), np.zeros(3)
    for j in range(len(walkers.speed)):
        dx, dy = walkers.xy[j, 0] - x, walkers.xy[j, 1] - y
        if j == i or dx * dx + dy * dy > reach:
            continue
        b[0], b[1], b[2] = walkers.xy[j, 0], walkers.xy[j, 1], walkers.yaw[j]
        if boxes_overlap(a, b, half, half):
            return False
    return True


@compiled
def _move(
    ways: WalkwayArrays,
    walkers: Walkers,
    i: int,
    velocity_x: float,
    velocity_y: float,
    dt: float,
) -> None:
    """Moves a walker as far as its way is free.

    All begin apart, and no step makes two overlap.
    """
    x, y = walkers.xy[i, 0], walkers.xy[i, 1]
    speed = np.sqrt(velocity_x * velocity_x + velocity_y * velocity_y)
    yaw = walkers.yaw[i]
    if speed > _GOING:
        heading = np.arctan2(velocity_y, velocity_x)
        turn = (heading - yaw + np.pi) % (2 * np.pi) - np.pi
        yaw += min(max(turn, -_TURN_RATE * dt), _TURN_RATE * dt)
    walkers.xy[i, 0] += velocity_x * dt
    walkers.xy[i, 1] += velocity_y * dt
    _keep_on_way(ways, walkers, i, _BACK * dt)
    new_x, new_y = walkers.xy[i, 0], walkers.xy[i, 1]
    walkers.xy[i, 0], walkers.xy[i, 1] = x, y
    if _is_free(walkers, i, new_x, new_y, yaw):
        walkers.yaw[i] = yaw
    elif _is_free(walkers, i, new_x, new_y, walkers.yaw[i]):
        pass
    else:
        # Try the lateral part of the step only, or stay.
        c, s = np.cos(walkers.yaw[i]), np.sin(walkers.yaw[i])
        aside = (new_y - y) * c - (new_x - x) * s
        new_x, new_y = x - aside * s, y + aside * c
        if not _is_free(walkers, i, new_x, new_y, walkers.yaw[i]):
            new_x, new_y = x, y
    walkers.xy[i, 0], walkers.xy[i, 1] = new_x, new_y
    walkers.velocity[i, 0] = (new_x - x) / dt
    walkers.velocity[i, 1] = (new_y - y) / dt


@compiled
def _keep_on_way(
    ways: WalkwayArrays, walkers: Walkers, i: int, most: float
) -> None:
    """Moves a walker back to its walkway, by at most a distance [m]."""
    way, forward = walkers.way[i], walkers.forward[i]
    half = ways.half_width[way]
    best, nearest = np.inf, 0
    low = max(walkers.at[i] - 3, 0)
    row, step = row_of(ways, way, forward, low), 1 if forward else -1
    for at in range(low, min(walkers.at[i] + 4, ways.num_points[way])):
        x = walkers.xy[i, 0] - ways.points[row, 0]
        y = walkers.xy[i, 1] - ways.points[row, 1]
        distance = x * x + y * y
        if distance < best:
            best, nearest = distance, at
        row += step
    row = row_of(ways, way, forward, nearest)
    tangent = tangent_of(ways, way, forward, nearest)
    right = (tangent[1], -tangent[0])
    along = -distance_along(ways, row, walkers, i, tangent)
    across = -distance_along(ways, row, walkers, i, right)
    if nearest == ways.num_points[way] - 1:
        along = min(along, half)
    if nearest == 0:
        along = max(along, -_AT_NODE - half)
    across = min(max(across, -half), half)
    x = ways.points[row, 0] + along * tangent[0] + across * right[0]
    y = ways.points[row, 1] + along * tangent[1] + across * right[1]
    x -= walkers.xy[i, 0]
    y -= walkers.xy[i, 1]
    distance = np.sqrt(x * x + y * y)
    if distance > most:
        x *= most / distance
        y *= most / distance
    walkers.xy[i, 0] += x
    walkers.xy[i, 1] += y
