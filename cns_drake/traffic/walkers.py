"""Moves pedestrians along walkways by the social force model.

Pedestrians approach their desired speed, and keep away from each other and from
the edges of their walkway: Helbing, Molnar, "Social force model for pedestrian
dynamics", Phys. Rev. E 51 (1995).
"""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.lane_graph import SPACING, Walkway, length_of
from cns_drake.traffic.overlaps import boxes_overlap
from cns_drake.traffic.right_of_way import WALK_GROUP
from cns_drake.traffic.streets import STEP
from cns_drake.traffic.vehicles import uniform

# Mean of the model's wanted speed [m/s].
_MEAN_SPEED = 1.34
# Standard deviation of the wanted speed [m/s].
_SPEED_SPREAD = 0.26
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
_APART = 0.95
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
# A pedestrian does not step aside for one that is at least this far to the side
# [m].
_PASSING_DISTANCE = 0.85
# Part of the repulsion by pedestrians that turns to the right.
_TO_THE_RIGHT = 0.3
# A pedestrian aims at a point of the walkway this many points ahead.
_AHEAD = int(2.0 / SPACING)
# A pedestrian turns to its direction of motion at this rate [rad/s].
_TURN_RATE = 2.5
# A pedestrian that is at most this fast stands [m/s].
_STANDING_SPEED = 0.2
# Distance of a waiting pedestrian from the crossing [m].
_AT_NODE = 1.0
# Greatest acceleration, in any direction [m/s^2].
_STRONGEST = 2.5
# A pedestrian that was blocked for this time turns back [s].
_PATIENCE = 4.0
# A waiting pedestrian turns back within this distance of one that does so [m].
_BLOCKING_DISTANCE = 1.5
# For each pedestrian that goes straight on, this many cross at a marked
# crossing, if both are possible.
_CROSSING_SHARE = 0.25
# The same for a crossing without marks.
_UNMARKED_SHARE = 0.05
# After this time, a pedestrian no longer waits for a gap [s].
_GIVES_UP = 10.0
# Length of sidewalk per pedestrian [m].
_WALKER_SPACE = 3.0
# Share of pedestrians with a companion behind them, so that about a third walk
# in groups.
_COMPANIONS = 0.2
# Distance of the companion behind the pedestrian, in points of the walkway.
_BEHIND = 3
# Number of random places that are tried for a pedestrian.
_TRIES = 200

_WALKER = np.dtype(
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
# A walkway in one direction as a record; the number of the opposite one is its
# own ^ 1.
_PATH = np.dtype(
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
        tangents: (M, 2) unit vectors from each point to the next. The vector of
            a path's last point is that of the point before.
        limits: (M, 2) least and greatest offset to the right [m].
        narrow: (M,) bool, where pedestrians must face along their path to fit.
    """

    paths: np.ndarray
    points: np.ndarray
    tangents: np.ndarray
    limits: np.ndarray
    narrow: np.ndarray


def room_for_walkers(walkways: Sequence[Walkway]) -> int:
    """Returns how many pedestrians have room on the sidewalks."""
    length = sum(length_of(way.points) for way in walkways if way.crossing < 0)
    return int(length // _WALKER_SPACE)


def gait_rate(speed: np.ndarray) -> np.ndarray:
    """Returns the rate at which the phase of pedestrians' gait changes [rad/s].

    `speed` contains the walking speeds [m/s]. A stride consists of two steps;
    its length is 0.4 m plus the distance walked in 0.7 s.
    """
    return 2.0 * np.pi * speed / (0.7 * speed + 0.4)


class Crowd:
    """All pedestrians during the planning of their motion.

    Attributes:
        walkers: (N,) records of the pedestrians; fewer than requested if there
            is not enough room.
    """

    def __init__(
        self,
        count: int,
        walkways: Sequence[Walkway],
        crossings: np.ndarray,
        rng: np.random.Generator,
    ):
        """Places pedestrians on walkways, except on crossings.

        Args:
            count: requested number of pedestrians.
            walkways: the walkways.
            crossings: (C,) records of dtype `CROSSING`.
            rng: random generator for their places.
        """
        self._crossings = crossings
        self._paths = _make_paths(walkways)
        # Place -> the paths that begin there.
        self._after: dict[int, list[int]] = {}
        for k, way in enumerate(walkways):
            self._after.setdefault(way.start, []).append(2 * k)
            if way.end != way.start:
                self._after.setdefault(way.end, []).append(2 * k + 1)
        self.walkers = _place_walkers(count, walkways, rng)

    def step(self, t: float, seed: int) -> None:
        """Moves all pedestrians by one time step.

        Args:
            t: time at which the step begins [s].
            seed: seed of the random choice of their next walkways.
        """
        crossings, walkers = self._crossings, self.walkers
        opened = crossings["opened"]
        begun = (opened >= 0.0) & (opened + WALK_GROUP <= t)
        # The placeholder gives up its permission when the group begins to walk.
        crossings["users"][begun] -= 1
        opened[begun] = -np.inf
        crossings["closed"][begun] = t
        is_waiting = np.zeros(len(walkers), bool)
        waited = np.zeros(len(crossings), bool)
        for i in np.flatnonzero(self._follow_paths()).tolist():
            is_waiting[i] = not self._go_on(i, t, seed, waited)
        crossings["waits"][~waited] = np.inf
        force = _forces(self._paths, walkers, is_waiting)
        _move(self._paths, walkers, force)
        self._note_crossers()
        x, y = walkers["velocity"].T
        speed = np.sqrt(x * x + y * y)
        walkers["phase"] += gait_rate(speed) * STEP
        paths = self._paths.paths[walkers["path"]]
        # Others may push a pedestrian back.
        along = self._paths.tangents[paths["first"] + walkers["at"]]
        gets_on = x * along[:, 0] + y * along[:, 1] > _STANDING_SPEED
        is_stuck = ~gets_on & ~is_waiting
        walkers["stuck"] = np.where(is_stuck, walkers["stuck"] + STEP, 0.0)
        back = walkers["stuck"] > _PATIENCE
        # Also one that waits where another wants to leave a crossing.
        apart = walkers["xy"][back, None] - walkers["xy"][is_waiting]
        square = apart[..., 0] ** 2 + apart[..., 1] ** 2
        back[is_waiting] |= (square < _BLOCKING_DISTANCE**2).any(axis=0)
        walkers["stuck"][back] = 0.0
        walkers["path"][back] ^= 1
        at = paths["num_points"] - 2 - walkers["at"]
        walkers["at"][back] = np.maximum(at, 0)[back]
        walkers["next_path"][back] = -1

    def _note_crossers(self) -> None:
        """Records which parts of crossings pedestrians have yet to pass."""
        crossings, walkers = self._crossings, self.walkers
        crossings["to_end"], crossings["to_start"] = np.inf, -np.inf
        on = self._paths.paths["crossing"][walkers["path"]]
        rows = np.flatnonzero(on >= 0)
        c = on[rows]
        walkers = walkers[rows]
        along = crossings["along"][c]
        place = ((walkers["xy"] - crossings["start"][c]) * along).sum(axis=1)
        row = self._paths.paths["first"][walkers["path"]] + walkers["at"]
        ahead = (self._paths.tangents[row] * along).sum(axis=1) > 0.0
        np.minimum.at(crossings["to_end"], c[ahead], place[ahead])
        np.maximum.at(crossings["to_start"], c[~ahead], place[~ahead])
        # Others may follow.
        begins = (crossings["opened"] >= 0.0) | ~crossings["is_open"]
        crossings["to_end"][begins] = -np.inf
        crossings["to_start"][begins] = np.inf

    def _follow_paths(self) -> np.ndarray:
        """Updates the points reached; returns (N,) bool, who is near an end."""
        walkers, (_, points, tangents, *_) = self.walkers, self._paths
        paths = self._paths.paths[walkers["path"]]

        def ahead(rows: np.ndarray) -> np.ndarray:
            x, y = (points[rows, :2] - walkers["xy"]).T
            along = tangents[paths["first"] + walkers["at"]]
            return x * along[:, 0] + y * along[:, 1]

        while True:
            passed = -ahead(paths["first"] + walkers["at"]) >= SPACING
            passed &= walkers["at"] < paths["num_points"] - 2
            if not passed.any():
                break
            walkers["at"] += passed
        last = paths["first"] + paths["num_points"] - 1
        is_near = ahead(last) < _AT_NODE
        return is_near & (walkers["at"] >= paths["num_points"] - 3)

    def _go_on(self, i: int, t: float, seed: int, waited: np.ndarray) -> bool:
        """Lets the i-th pedestrian begin its next path, unless it has to wait.

        If it asks for a crossing, this is recorded in `waited` (C,).

        Returns:
            Whether it has begun its next path.
        """
        walkers, paths = self.walkers, self._paths.paths
        if walkers["next_path"][i] < 0:
            walkers["next_path"][i] = self._draw_next(i, seed)
        after = int(walkers["next_path"][i])
        crossings = self._crossings
        c = paths["crossing"][after]
        # A pedestrian that turns back on a crossing already has permission.
        if c >= 0 and c != paths["crossing"][walkers["path"][i]]:
            if crossings["users"][c] == 0:
                crossings["waits"][c] = min(crossings["waits"][c], t)
                waited[c] = True
                waits = t - crossings["waits"][c]
                if not crossings["marked"][c] and waits > _GIVES_UP:
                    walkers["next_path"][i] = -1
                return False
            if t >= crossings["opened"][c] + WALK_GROUP:
                return False
        for path, change in ((walkers["path"][i], -1), (after, 1)):
            c = paths["crossing"][path]
            if c >= 0:
                crossings["users"][c] += change
                crossings["closed"][c] = t
        walkers["path"][i], walkers["at"][i] = after, 0
        walkers["next_path"][i] = -1
        return True

    def _draw_next(self, i: int, seed: int) -> int:
        """Returns a random next path; it leads back only if no other exists."""
        path = int(self.walkers["path"][i])
        choices = self._after[int(self._paths.paths["node"][path])]
        if len(choices) == 1:
            return path ^ 1
        self.walkers["draws"][i] += 1
        # Few pedestrians cross, and none goes back.
        marked = self._crossings["marked"]
        likings = []
        for other in choices:
            over = int(self._paths.paths["crossing"][other])
            liking = 1.0
            if over >= 0:
                liking = _CROSSING_SHARE if marked[over] else _UNMARKED_SHARE
            likings.append(0.0 if other // 2 == path // 2 else liking)
        who, draw = self.walkers[["group", "draws"]][i]
        pick = uniform(seed, who, draw) * sum(likings)
        below = np.flatnonzero(pick < np.cumsum(likings))
        other = choices[below[0] if len(below) else -1]
        return path ^ 1 if other // 2 == path // 2 else other

    def poses(self, walkers: np.ndarray) -> np.ndarray:
        """Returns the poses (..., 5) of pedestrians.

        A pose consists of x, y, z on the ground [m], yaw and phase of the gait
        [rad].

        Args:
            walkers: (...) records of pedestrians, which can be those of several
                times.
        """
        paths, points, *_ = self._paths
        path = paths[walkers["path"]]
        row = path["first"] + np.minimum(walkers["at"], path["num_points"] - 2)
        here = points[row]
        x, y, rise = np.moveaxis(points[row + 1] - here, -1, 0)
        xy = walkers["xy"]
        back = here[..., :2] - xy
        share = -(back[..., 0] * x + back[..., 1] * y) / (x * x + y * y)
        z = here[..., 2] + np.minimum(np.maximum(share, 0.0), 1.0) * rise
        return np.stack(
            [xy[..., 0], xy[..., 1], z, walkers["yaw"], walkers["phase"]],
            axis=-1,
        )


def _make_paths(walkways: Sequence[Walkway]) -> Paths:
    """Returns the paths along walkways."""
    paths = np.zeros(2 * len(walkways), _PATH)
    count = np.repeat([len(way.points) for way in walkways], 2)
    paths["num_points"] = count
    paths["first"] = np.cumsum(count) - count
    paths["crossing"] = np.repeat([way.crossing for way in walkways], 2)
    paths["node"] = [node for way in walkways for node in (way.end, way.start)]
    points, tangents = [np.zeros((0, 3))], [np.zeros((0, 2))]
    limits = [np.zeros((0, 2))]
    narrow: list[np.ndarray] = [np.zeros(0, bool)]
    for way in walkways:
        limits += [way.limits, -way.limits[::-1, ::-1]]
        narrow += [way.is_narrow, way.is_narrow[::-1]]
        for line in (way.points, way.points[::-1]):
            x, y = np.diff(line[:, :2], axis=0).T
            length = np.sqrt(x * x + y * y)
            along = np.column_stack([x / length, y / length])
            points.append(line)
            tangents += [along, along[-1:]]
    return Paths(
        paths, *map(np.concatenate, (points, tangents, limits, narrow))
    )


def _place_walkers(
    count: int, walkways: Sequence[Walkway], rng: np.random.Generator
) -> np.ndarray:
    """Returns the records of pedestrians at their first places; see `Crowd`."""
    free = [k for k, way in enumerate(walkways) if way.crossing < 0]
    sizes = np.array([len(walkways[k].points) for k in free], float)
    rows: list[tuple[int, int, np.ndarray, float, int]] = []

    def place(way: int, forward: bool, at: int, group: int) -> bool:
        """Places a pedestrian; returns False instead if another one is near."""
        points = walkways[way].points
        line = points if forward else points[::-1]
        x, y = (line[at + 1] - line[at])[:2]
        aside = walkways[way].limits[:: 1 if forward else -1][at].mean()
        aside = (aside if forward else -aside) / np.hypot(x, y)
        xy = line[at, :2] + aside * np.array([y, -x])
        is_free = all(np.hypot(*(xy - row[2])) > 1.4 * _APART for row in rows)
        if is_free:
            yaw = math.atan2(y, x)
            rows.append((2 * way + 1 - forward, at, xy, yaw, group))
        return is_free

    while free and len(rows) < count:
        for _ in range(_TRIES):
            way = free[int(rng.choice(len(free), p=sizes / sizes.sum()))]
            forward = bool(rng.integers(2))
            at = int(rng.integers(len(walkways[way].points) - 1))
            if place(way, forward, at, len(rows)):
                break
        else:
            break
        if rng.uniform() < _COMPANIONS and len(rows) < count and at >= _BEHIND:
            place(way, forward, at - _BEHIND, len(rows) - 1)
    walkers = np.zeros(len(rows), _WALKER)
    names = ("path", "at", "xy", "yaw", "group")
    for name, values in zip(names, zip(*rows, strict=True), strict=False):
        walkers[name] = values
    number = len(rows)
    walkers["speed"] = np.clip(
        rng.normal(_MEAN_SPEED, _SPEED_SPREAD, number), 0.6, 2.2
    )
    walkers["phase"] = rng.uniform(0.0, 2 * np.pi, number)
    walkers["aside"] = rng.uniform(0.1, 0.7, number)
    for name in ("speed", "aside"):
        walkers[name] = walkers[name][walkers["group"]]
    walkers["next_path"] = -1
    return walkers


@compiled
def _forces(
    paths: Paths, walkers: np.ndarray, is_waiting: np.ndarray
) -> np.ndarray:
    """Returns the forces (N, 2) on all pedestrians, as accelerations [m/s^2].

    `is_waiting` (N,) says which pedestrians wait for a crossing.
    """
    force = np.zeros((len(walkers), 2))
    for i in range(len(walkers)):
        one = walkers[i]
        path = paths.paths[walkers[i].path]
        here = path.first + one.at
        low, high = paths.limits[here]
        right = (paths.tangents[here, 1], -paths.tangents[here, 0])
        force[i] -= one.velocity / _RELAXATION
        if is_waiting[i]:
            # In a narrow gap, the edges would push it back and forth.
            continue
        target = path.first + min(one.at + _AHEAD, path.num_points - 1)
        left, most = paths.limits[target]
        aside = 0.5 * (left + most + one.aside * (most - left))
        x = paths.points[target, 0] + aside * right[0] - one.xy[0]
        y = paths.points[target, 1] + aside * right[1] - one.xy[1]
        wanted = one.speed / max(np.sqrt(x * x + y * y), 1e-6)
        force[i, 0] += wanted * x / _RELAXATION
        force[i, 1] += wanted * y / _RELAXATION
        across = -(
            (paths.points[here, 0] - one.xy[0]) * right[0]
            + (paths.points[here, 1] - one.xy[1]) * right[1]
        )
        for side in (-1.0, 1.0):
            room = high - across if side > 0.0 else across - low
            push = (
                side * _EDGE_REPULSION * np.exp(-max(room, 0.0) / _EDGE_RANGE)
            )
            force[i, 0] -= push * right[0]
            force[i, 1] -= push * right[1]
    for i in range(len(walkers)):
        for j in range(i):
            x = walkers[i].xy[0] - walkers[j].xy[0]
            y = walkers[i].xy[1] - walkers[j].xy[1]
            square = x * x + y * y
            if square >= _NEAR**2:
                continue
            distance = max(np.sqrt(square), 1e-3)
            push = _REPULSION * np.exp(
                -max(distance - _APART, 0.0) / _REPULSION_RANGE
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
def _move(paths: Paths, walkers: np.ndarray, force: np.ndarray) -> None:
    """Moves pedestrians, as far as paths are free, by forces (N, 2) [m/s^2].

    A pedestrian takes a step if it can then stop on its path, away from the
    places where all others can stop. Otherwise it brakes; the place where it
    stops has been free since the previous step.
    """
    for i in range(len(walkers)):
        one = walkers[i]
        x, y, vx, vy = one.xy[0], one.xy[1], one.velocity[0], one.velocity[1]
        rest_x, rest_y = _stop(x, y, vx, vy)
        off = _distance_off(paths, one, rest_x, rest_y)
        change_x, change_y = force[i, 0] * STEP, force[i, 1] * STEP
        for attempt in range(3):
            if attempt == 1:
                # Try only the lateral part of the step, and slightly back.
                c, s = np.cos(one.yaw), np.sin(one.yaw)
                aside = change_y * c - change_x * s
                back = vx * c + vy * s + 0.5 * abs(aside)
                change_x = -aside * s - back * c
                change_y = aside * c - back * s
            elif attempt == 2:
                change_x, change_y = -vx, -vy
            part = np.sqrt(change_x * change_x + change_y * change_y)
            part = min(1.0, _STRONGEST * STEP / max(part, 1e-9))
            new_vx, new_vy = vx + part * change_x, vy + part * change_y
            speed = np.sqrt(new_vx * new_vx + new_vy * new_vy)
            part = min(1.0, _HURRY * one.speed / max(speed, 1e-9))
            new_vx, new_vy = part * new_vx, part * new_vy
            new_x = x + 0.5 * (vx + new_vx) * STEP
            new_y = y + 0.5 * (vy + new_vy) * STEP
            if attempt == 2 and speed == 0.0:
                new_x, new_y = rest_x, rest_y
            stop_x, stop_y = _stop(new_x, new_y, new_vx, new_vy)
            yaw = one.yaw
            row = _nearest(paths, one, new_x, new_y)
            tx, ty = paths.tangents[row, 0], paths.tangents[row, 1]
            if paths.narrow[row] or speed > _STANDING_SPEED:
                turn = np.arctan2(new_vy, new_vx) - yaw
                if paths.narrow[row]:
                    # Facing along the path, forwards or backwards.
                    ahead = np.cos(yaw) * tx + np.sin(yaw) * ty
                    turn = np.arctan2(ty, tx) - yaw + np.pi * (ahead < 0.0)
                turn = (turn + np.pi) % (2 * np.pi) - np.pi
                yaw += min(max(turn, -_TURN_RATE * STEP), _TURN_RATE * STEP)
            if attempt < 2 and (
                _distance_off(paths, one, stop_x, stop_y) > off + 1e-9
            ):
                continue
            if _is_free(walkers, i, (new_x, new_y), (stop_x, stop_y), yaw):
                one.yaw = yaw
                break
            yaw = one.yaw
            if _is_free(walkers, i, (new_x, new_y), (stop_x, stop_y), yaw):
                break
        one.xy[0], one.xy[1] = new_x, new_y
        one.velocity[0], one.velocity[1] = new_vx, new_vy


@compiled
def _stop(x: float, y: float, vx: float, vy: float) -> tuple[float, float]:
    """Returns x and y at which a pedestrian stops if it brakes now.

    (x, y) is its place, and (vx, vy) its velocity.
    """
    time = np.sqrt(vx * vx + vy * vy) / (2.0 * _STRONGEST)
    return x + vx * time, y + vy * time


@compiled
def _nearest(paths: Paths, walker: Any, x: float, y: float) -> int:
    """Returns the row of the point of a path that is nearest to a place."""
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
def _distance_off(paths: Paths, walker: Any, x: float, y: float) -> float:
    """Returns the distance from a place to a pedestrian's path [m]."""
    path, points = paths.paths[walker.path], paths.points
    row = _nearest(paths, walker, x, y)
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
        return np.hypot(beyond, max(-_AT_NODE - half - along, 0.0))
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
        x, y = _stop(x, y, other.velocity[0], other.velocity[1])
        a, b = (stop[0], stop[1], yaw), (x, y, other.yaw)
        if boxes_overlap(a, b, half, half):
            return False
    return True
