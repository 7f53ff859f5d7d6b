"""The social force model: forces on pedestrians, and the steps they take.

Pedestrians approach their desired speed, and keep away from each other and from
the edges of their walkway: Helbing, Molnar, "Social force model for pedestrian
dynamics", Phys. Rev. E 51 (1995).
"""

from typing import Any, NamedTuple

import numpy as np

from cns_drake.base import compiled
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.overlaps import boxes_overlap
from cns_drake.traffic.polylines import SPACING

# Relaxation time [s].
_RELAXATION = 0.5
# Repulsion by another pedestrian whose box is touched [m/s^2].
_REPULSION = 7.0
# In this distance, the repulsion by a pedestrian falls by the factor e [m].
_REPULSION_RANGE = 0.3
# Repulsion by an edge that is touched [m/s^2].
_EDGE_REPULSION = 10.0
# In this distance, the repulsion by an edge falls by the factor e [m].
_EDGE_RANGE = 0.2
# Greatest speed as a multiple of the wanted speed.
_HURRY = 1.3
# Least distance between two pedestrians' middles [m].
APART = 0.95
# Radius within which pedestrians are neighbours [m].
_NEAR = 4.0
# Length of a pedestrian's box, which contains swinging limbs [m].
WALKER_LENGTH = 0.84
# Width of the box [m].
WALKER_WIDTH = 0.6
# Least space between boxes [m].
_BOX_GAP = 0.15
# A pedestrian steps aside for another one ahead with at most this acceleration
# [m/s^2].
_STEP_ASIDE = 4.0
# A pedestrian does not step aside for a pedestrian who is at least this far to
# the side [m].
_PASSING_DISTANCE = 0.85
# Part of the repulsion by pedestrians that turns to the right.
_TO_THE_RIGHT = 0.3
# A pedestrian aims at a point of the walkway this many points ahead.
_AHEAD = int(2.0 / SPACING)
# A pedestrian turns to its direction of motion at this rate [rad/s].
_TURN_RATE = 2.5
# A pedestrian that is at most this fast stands [m/s].
STANDING_SPEED = 0.2
# Distance of a waiting pedestrian from the crossing [m].
AT_NODE = 1.0
# Greatest acceleration, in any direction [m/s^2].
_STRONGEST = 2.5
# Least speed by which is divided [m/s], and tolerance of distances [m].
_TINY = 1e-9
# A pedestrian as a record.
WALKER = np.dtype(
    [
        ("xy", float, 2),  # [m]
        ("velocity", float, 2),  # [m/s]
        ("yaw", float),  # Heading [rad].
        ("phase", float),  # Place in the gait [rad].
        ("path", int),  # Number of the walkway, in walking direction.
        ("at", int),  # Row of the point that the pedestrian has reached.
        ("speed", float),  # Wanted [m/s].
        ("aside", float),  # Offset to the right, as a share of half the width.
        ("next_path", int),  # -1 if not drawn yet.
        ("stuck", float),  # Time for which the pedestrian has been blocked [s].
        ("group", int),  # Number of the pedestrian whom it follows.
        ("draws", int),  # Number of random numbers drawn.
    ]
)
# A walkway in one direction as a record; the number of the opposite record is
# the record's own number ^ 1.
PATH = np.dtype(
    [
        ("first", int),  # Row of its first point.
        ("num_points", int),
        ("crossing", int),  # Number of the crossing, -1 for none.
        ("node", int),  # The place where it ends.
    ]
)


class Paths(NamedTuple):
    """W walkways in both directions, as arrays.

    Attributes:
        paths: (2 W,) records of the walkways, once in each direction.
        points: (M, 3) points in walking direction [m].
        tangents: (M, 2) unit vectors from each point to the next. The last
            point of a path has the vector of the point before.
        limits: (M, 2) least and greatest offset to the right [m].
        narrow: (M,) bool, where pedestrians must face along their path to fit.
    """

    paths: np.ndarray
    points: np.ndarray
    tangents: np.ndarray
    limits: np.ndarray
    narrow: np.ndarray


@compiled
def social_forces(
    paths: Paths, walkers: np.ndarray, is_waiting: np.ndarray
) -> np.ndarray:
    """Returns the forces (N, 2) on all pedestrians, as accelerations [m/s^2].

    `is_waiting` (N,) says which pedestrians wait for a crossing.
    """
    force = np.zeros((len(walkers), 2))
    for i in range(len(walkers)):
        force[i, 0], force[i, 1] = _own_force(paths, walkers[i], is_waiting[i])
    for i in range(len(walkers)):
        for j in range(i):
            x = walkers[i].xy[0] - walkers[j].xy[0]
            y = walkers[i].xy[1] - walkers[j].xy[1]
            square = x * x + y * y
            if square >= _NEAR**2:
                continue
            distance = max(np.sqrt(square), 1e-3)
            push = _REPULSION * np.exp(
                -max(distance - APART, 0.0) / _REPULSION_RANGE
            )
            # Slightly to the right; otherwise two pedestrians who meet head-on
            # would stop.
            push_x = push * (x - _TO_THE_RIGHT * y) / distance
            push_y = push * (y + _TO_THE_RIGHT * x) / distance
            force[i, 0] += push_x
            force[i, 1] += push_y
            force[j, 0] -= push_x
            force[j, 1] -= push_y
            for k, sign in ((i, -1.0), (j, 1.0)):
                # The other pedestrian's place in the pedestrian's own frame.
                c, s = np.cos(walkers[k].yaw), np.sin(walkers[k].yaw)
                ahead = sign * x * c + sign * y * s
                aside = sign * y * c - sign * x * s
                if ahead <= 0.0 or abs(aside) >= _PASSING_DISTANCE:
                    continue
                push = _STEP_ASIDE * (1.0 - distance / _NEAR)
                push *= 1.0 - abs(aside) / _PASSING_DISTANCE
                # Away from the other one; to the right if that one is straight
                # ahead.
                side = -1.0 if aside >= -0.05 else 1.0
                force[k, 0] -= side * push * s
                force[k, 1] += side * push * c
    return force


@compiled
def _own_force(
    paths: Paths, walker: Any, is_waiting: bool
) -> tuple[float, float]:
    """Returns the force on a pedestrian who is alone on its path [m/s^2].

    The pedestrian approaches its wanted speed, and keeps away from the edges. A
    waiting pedestrian only brakes.

    Args:
        paths: all walkways.
        walker: record of the pedestrian.
        is_waiting: whether it waits for a crossing.
    """
    path = paths.paths[walker.path]
    here = path.first + walker.at
    force_x = 0.0 - walker.velocity[0] / _RELAXATION
    force_y = 0.0 - walker.velocity[1] / _RELAXATION
    if is_waiting:
        # In a narrow gap, the edges would push it back and forth.
        return force_x, force_y
    low, high = paths.limits[here]
    right = (paths.tangents[here, 1], -paths.tangents[here, 0])
    target = path.first + min(walker.at + _AHEAD, path.num_points - 1)
    left, most = paths.limits[target]
    aside = 0.5 * (left + most + walker.aside * (most - left))
    x = paths.points[target, 0] + aside * right[0] - walker.xy[0]
    y = paths.points[target, 1] + aside * right[1] - walker.xy[1]
    wanted = walker.speed / max(np.sqrt(x * x + y * y), 1e-6)
    force_x += wanted * x / _RELAXATION
    force_y += wanted * y / _RELAXATION
    across = -(
        (paths.points[here, 0] - walker.xy[0]) * right[0]
        + (paths.points[here, 1] - walker.xy[1]) * right[1]
    )
    for side in (-1.0, 1.0):
        room = high - across if side > 0.0 else across - low
        push = side * _EDGE_REPULSION * np.exp(-max(room, 0.0) / _EDGE_RANGE)
        force_x -= push * right[0]
        force_y -= push * right[1]
    return force_x, force_y


@compiled
def move_walkers(paths: Paths, walkers: np.ndarray, force: np.ndarray) -> None:
    """Moves pedestrians, as far as paths are free, by forces (N, 2) [m/s^2].

    A pedestrian takes a step only if the pedestrian can then still stop on its
    path without touching the stopping place of any other pedestrian. Otherwise
    the pedestrian brakes, and stops at a place that has been free since the
    previous step.
    """
    for i in range(len(walkers)):
        walker = walkers[i]
        x, y, vx, vy = (
            walker.xy[0],
            walker.xy[1],
            walker.velocity[0],
            walker.velocity[1],
        )
        rest_x, rest_y = _stopping_place(x, y, vx, vy)
        off = _distance_to_path(paths, walker, rest_x, rest_y)
        change_x, change_y = force[i, 0] * STEP, force[i, 1] * STEP
        for attempt in range(3):
            if attempt == 1:
                change_x, change_y = _aside(walker, change_x, change_y)
            elif attempt == 2:
                change_x, change_y = -vx, -vy
            new_vx, new_vy, speed = _velocity_after(walker, change_x, change_y)
            new_x = x + 0.5 * (vx + new_vx) * STEP
            new_y = y + 0.5 * (vy + new_vy) * STEP
            if attempt == 2 and speed == 0.0:
                new_x, new_y = rest_x, rest_y
            stop_x, stop_y = _stopping_place(new_x, new_y, new_vx, new_vy)
            place = (new_x, new_y)
            yaw = _yaw_after(paths, walker, place, (new_vx, new_vy), speed)
            if attempt < 2 and (
                _distance_to_path(paths, walker, stop_x, stop_y) > off + _TINY
            ):
                continue
            if _is_free(walkers, i, place, (stop_x, stop_y), yaw):
                walker.yaw = yaw
                break
            if _is_free(walkers, i, place, (stop_x, stop_y), walker.yaw):
                break
        walker.xy[0], walker.xy[1] = new_x, new_y
        walker.velocity[0], walker.velocity[1] = new_vx, new_vy


@compiled
def _aside(
    walker: Any, change_x: float, change_y: float
) -> tuple[float, float]:
    """Returns the lateral part of a change of velocity, and slightly back.

    The pedestrian stops, and moves aside and half as fast backwards.

    Args:
        walker: record of the pedestrian.
        change_x, change_y: the change [m/s].
    """
    vx, vy = walker.velocity[0], walker.velocity[1]
    c, s = np.cos(walker.yaw), np.sin(walker.yaw)
    aside = change_y * c - change_x * s
    back = vx * c + vy * s + 0.5 * abs(aside)
    return -aside * s - back * c, aside * c - back * s


@compiled
def _velocity_after(
    walker: Any, change_x: float, change_y: float
) -> tuple[float, float, float]:
    """Returns the velocity after a change, within the limits of pedestrians.

    Args:
        walker: record of the pedestrian.
        change_x, change_y: the wanted change in a time step [m/s].

    Returns:
        x and y of the velocity; and the speed before it is limited [m/s].
    """
    part = np.sqrt(change_x * change_x + change_y * change_y)
    part = min(1.0, _STRONGEST * STEP / max(part, _TINY))
    vx = walker.velocity[0] + part * change_x
    vy = walker.velocity[1] + part * change_y
    speed = np.sqrt(vx * vx + vy * vy)
    part = min(1.0, _HURRY * walker.speed / max(speed, _TINY))
    return part * vx, part * vy, speed


@compiled
def _yaw_after(
    paths: Paths,
    walker: Any,
    place: tuple[float, float],
    velocity: tuple[float, float],
    speed: float,
) -> float:
    """Returns the heading of a pedestrian after a step [rad].

    A pedestrian turns to its direction of motion. In a narrow gap, it turns
    along its path, forwards or backwards.

    Args:
        paths: all walkways.
        walker: record of the pedestrian before the step.
        place: x and y after the step [m].
        velocity: x and y of the velocity after the step [m/s].
        speed: speed, see `_velocity_after`; a pedestrian who stands does not
            turn.
    """
    yaw = walker.yaw
    row = _nearest_row(paths, walker, place[0], place[1])
    tx, ty = paths.tangents[row, 0], paths.tangents[row, 1]
    if paths.narrow[row] or speed > STANDING_SPEED:
        turn = np.arctan2(velocity[1], velocity[0]) - yaw
        if paths.narrow[row]:
            ahead = np.cos(yaw) * tx + np.sin(yaw) * ty
            turn = np.arctan2(ty, tx) - yaw + np.pi * (ahead < 0.0)
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        yaw += min(max(turn, -_TURN_RATE * STEP), _TURN_RATE * STEP)
    return yaw


@compiled
def _stopping_place(
    x: float, y: float, vx: float, vy: float
) -> tuple[float, float]:
    """Returns x and y at which a pedestrian stops if it brakes now.

    (x, y) is its place, and (vx, vy) its velocity.
    """
    time = np.sqrt(vx * vx + vy * vy) / (2.0 * _STRONGEST)
    return x + vx * time, y + vy * time


@compiled
def _nearest_row(paths: Paths, walker: Any, x: float, y: float) -> int:
    """Returns the row of the point of a path that is nearest to a place.

    Only points near the one that the pedestrian has reached are compared.

    Args:
        paths: all walkways.
        walker: record of a pedestrian on the path.
        x, y: the place [m].
    """
    path, points = paths.paths[walker.path], paths.points
    best = np.inf
    nearest = path.first
    for at in range(max(walker.at - 3, 0), min(walker.at + 4, path.num_points)):
        row = path.first + at
        dx, dy = x - points[row, 0], y - points[row, 1]
        distance = dx * dx + dy * dy
        if distance < best:
            best, nearest = distance, row
    return nearest


@compiled
def _distance_to_path(paths: Paths, walker: Any, x: float, y: float) -> float:
    """Returns the distance from a place to a pedestrian's path [m].

    Args:
        paths: all walkways.
        walker: record of the pedestrian.
        x, y: the place [m].
    """
    path, points = paths.paths[walker.path], paths.points
    row = _nearest_row(paths, walker, x, y)
    nearest = row - path.first
    low, high = paths.limits[row]
    tx, ty = paths.tangents[row, 0], paths.tangents[row, 1]
    dx, dy = x - points[row, 0], y - points[row, 1]
    along, across = dx * tx + dy * ty, dx * ty - dy * tx
    beyond = max(across - high, low - across, 0.0)
    half = 0.5 * (high - low)
    if nearest == path.num_points - 1:
        return np.hypot(beyond, max(along, 0.0))
    if nearest == 0:
        return np.hypot(beyond, max(-AT_NODE - half - along, 0.0))
    return beyond


@compiled
def _is_free(
    walkers: np.ndarray,
    i: int,
    place: tuple[float, float],
    stop: tuple[float, float],
    yaw: float,
) -> bool:
    """Returns whether the i-th pedestrian's box would be free, now and later.

    The box would be at `place` with a heading and, if the pedestrian braked,
    then at `stop`.

    Args:
        walkers: (N,) records of all pedestrians.
        i: number of the pedestrian.
        place, stop: x and y of the middle of the box [m].
        yaw: heading of the box [rad].
    """
    half = (WALKER_LENGTH / 2 + _BOX_GAP / 2, WALKER_WIDTH / 2 + _BOX_GAP / 2)
    for j in range(len(walkers)):
        other = walkers[j]
        x, y = other.xy[0], other.xy[1]
        if j == i or (x - place[0]) ** 2 + (y - place[1]) ** 2 > _NEAR**2:
            continue
        a, b = (place[0], place[1], yaw), (x, y, other.yaw)
        if boxes_overlap(a, b, half, half):
            return False
        x, y = _stopping_place(x, y, other.velocity[0], other.velocity[1])
        a, b = (stop[0], stop[1], yaw), (x, y, other.yaw)
        if boxes_overlap(a, b, half, half):
            return False
    return True
