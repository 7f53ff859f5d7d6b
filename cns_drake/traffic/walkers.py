"""Places pedestrians on walkways, and plans which ways they take.

`cns_drake.traffic.social_force` moves them.
"""

from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np

from cns_drake.base import length_of
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.lane_graph import Walkway
from cns_drake.traffic.polylines import SPACING
from cns_drake.traffic.random_numbers import uniform
from cns_drake.traffic.right_of_way import WALK_GROUP
from cns_drake.traffic.social_force import (
    APART,
    AT_NODE,
    PATH,
    STANDING_SPEED,
    WALKER,
    Paths,
    move_walkers,
    social_forces,
)

# Mean of the model's wanted speed [m/s].
_MEAN_SPEED = 1.34
# Standard deviation of the wanted speed [m/s].
_SPEED_SPREAD = 0.26
# Least and greatest wanted speed [m/s].
_SPEED_LIMITS = (0.6, 2.2)
# Pedestrians keep to the right of the middle of their walkway by a distance
# from the first to the second of these shares of half its width.
_ASIDE = (0.1, 0.7)
# Least distance between the first places of pedestrians [m].
_APART_AT_FIRST = 1.4 * APART
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


def room_for_walkers(walkways: Sequence[Walkway]) -> int:
    """Returns how many pedestrians have room on the sidewalks."""
    length = sum(length_of(way.points) for way in walkways if way.crossing < 0)
    return int(length // _WALKER_SPACE)


def gait_rate(speed: np.ndarray) -> np.ndarray:
    """Returns the rate at which the phase of pedestrians' gait changes [rad/s].

    `speed` contains the walking speeds [m/s]. A stride consists of two steps.
    The length of a stride is 0.4 m plus the distance walked in 0.7 s.
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
            seed: seed of the random choice of the pedestrians' next walkways.
        """
        walkers = self.walkers
        self._close_crossings(t)
        is_waiting = self._begin_next_paths(t, seed)
        force = social_forces(self._paths, walkers, is_waiting)
        move_walkers(self._paths, walkers, force)
        self._note_crossers()
        x, y = walkers["velocity"].T
        speed = np.sqrt(x * x + y * y)
        walkers["phase"] += gait_rate(speed) * STEP
        self._turn_back(is_waiting)

    def _close_crossings(self, t: float) -> None:
        """Closes crossings whose group has begun to walk at time `t` [s]."""
        crossings = self._crossings
        opened = crossings["opened"]
        begun = (opened >= 0.0) & (opened + WALK_GROUP <= t)
        # The placeholder gives up its permission when the group begins to walk.
        crossings["users"][begun] -= 1
        opened[begun] = -np.inf
        crossings["closed"][begun] = t

    def _turn_back(self, is_waiting: np.ndarray) -> None:
        """Makes pedestrians turn back who are stuck, or in the way of others.

        `is_waiting` (N,) says which pedestrians wait for a crossing.
        """
        walkers = self.walkers
        x, y = walkers["velocity"].T
        paths = self._paths.paths[walkers["path"]]
        # Others may push a pedestrian back.
        along = self._paths.tangents[paths["first"] + walkers["at"]]
        gets_on = x * along[:, 0] + y * along[:, 1] > STANDING_SPEED
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
        """Updates the points reached; returns (N,) who is near a path's end."""
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
        is_near = ahead(last) < AT_NODE
        return is_near & (walkers["at"] >= paths["num_points"] - 3)

    def _begin_next_paths(self, t: float, seed: int) -> np.ndarray:
        """Lets pedestrians go on who are near the end of their path.

        Args:
            t: present time [s].
            seed: seed of the random choice of next paths.

        Returns:
            (N,) bool, which pedestrians have to wait for a crossing.
        """
        walkers, crossings = self.walkers, self._crossings
        is_waiting = np.zeros(len(walkers), bool)
        is_requested = np.zeros(len(crossings), bool)
        for i in np.flatnonzero(self._follow_paths()).tolist():
            if walkers["next_path"][i] < 0:
                walkers["next_path"][i] = self._draw_next(i, seed)
            entered = self._crossing_entered(i)
            if entered < 0 or self._is_walk_on(entered, t):
                self._begin_path(i, t)
                continue
            is_waiting[i] = True
            # While others still walk, the crossing cannot be requested.
            if crossings["users"][entered] == 0:
                is_requested[entered] = True
                self._request_crossing(i, entered, t)
        crossings["waits"][~is_requested] = np.inf
        return is_waiting

    def _crossing_entered(self, i: int) -> int:
        """Returns the crossing that the i-th pedestrian's next path enters.

        The result is -1 if the path leads over no crossing, or if the
        pedestrian turns back on a crossing and therefore has permission.
        """
        before, after = self.walkers[["path", "next_path"]][i]
        crossing = self._paths.paths["crossing"]
        is_same = crossing[after] == crossing[before]
        return -1 if is_same else int(crossing[after])

    def _is_walk_on(self, crossing: int, t: float) -> bool:
        """Returns whether pedestrians may step onto a crossing at time t [s].

        They may while the crossing is open for a group that gathers.
        """
        users, opened = self._crossings[["users", "opened"]][crossing]
        return bool(users > 0 and t < opened + WALK_GROUP)

    def _request_crossing(self, i: int, crossing: int, t: float) -> None:
        """Records that the i-th pedestrian waits for a crossing at time t [s].

        A pedestrian who has waited too long for a gap in the traffic will draw
        another path.
        """
        record = self._crossings[crossing]
        record["waits"] = min(record["waits"], t)
        if not record["marked"] and t - record["waits"] > _GIVES_UP:
            self.walkers["next_path"][i] = -1

    def _begin_path(self, i: int, t: float) -> None:
        """Moves the i-th pedestrian to its next path at time t [s].

        Crossings that it leaves or enters are updated.
        """
        walkers, crossings = self.walkers, self._crossings
        before, after = walkers[["path", "next_path"]][i]
        for path, change in ((before, -1), (after, 1)):
            crossing = self._paths.paths["crossing"][path]
            if crossing >= 0:
                crossings["users"][crossing] += change
                crossings["closed"][crossing] = t
        walkers["path"][i], walkers["at"][i] = after, 0
        walkers["next_path"][i] = -1

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
            walkers: (...) records of pedestrians, at one or several times.
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
    paths = np.zeros(2 * len(walkways), PATH)
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


class _Place(NamedTuple):
    """Where a pedestrian begins.

    Attributes:
        path: number of the walkway, in walking direction.
        at: row of the point at which it begins.
        xy: (2,) position [m].
        yaw: heading [rad].
        group: number of the pedestrian whom it follows, or its own.
    """

    path: int
    at: int
    xy: np.ndarray
    yaw: float
    group: int


def _place_walkers(
    count: int, walkways: Sequence[Walkway], rng: np.random.Generator
) -> np.ndarray:
    """Returns the records of pedestrians at their first places.

    For the arguments, see `Crowd`.
    """
    places = _draw_places(count, walkways, rng)
    number = len(places)
    walkers = np.zeros(number, WALKER)
    for name, values in zip(
        _Place._fields, zip(*places, strict=True), strict=False
    ):
        walkers[name] = values
    walkers["speed"] = np.clip(
        rng.normal(_MEAN_SPEED, _SPEED_SPREAD, number), *_SPEED_LIMITS
    )
    walkers["phase"] = rng.uniform(0.0, 2 * np.pi, number)
    walkers["aside"] = rng.uniform(*_ASIDE, number)
    for name in ("speed", "aside"):
        walkers[name] = walkers[name][walkers["group"]]
    walkers["next_path"] = -1
    return walkers


def _draw_places(
    count: int, walkways: Sequence[Walkway], rng: np.random.Generator
) -> list[_Place]:
    """Returns random places of pedestrians, at most `count` of them.

    The search ends when no place is found for a pedestrian.
    """
    free = [k for k, way in enumerate(walkways) if way.crossing < 0]
    sizes = np.array([len(walkways[k].points) for k in free], float)
    places: list[_Place] = []
    while free and len(places) < count:
        for _ in range(_TRIES):
            k = free[int(rng.choice(len(free), p=sizes / sizes.sum()))]
            forward = bool(rng.integers(2))
            at = int(rng.integers(len(walkways[k].points) - 1))
            place = _place_on(walkways, k, forward, at, len(places))
            if _is_free(place, places):
                places.append(place)
                break
        else:
            break
        if (
            rng.uniform() < _COMPANIONS
            and len(places) < count
            and at >= _BEHIND
        ):
            leader = len(places) - 1
            place = _place_on(walkways, k, forward, at - _BEHIND, leader)
            if _is_free(place, places):
                places.append(place)
    return places


def _place_on(
    walkways: Sequence[Walkway], k: int, forward: bool, at: int, group: int
) -> _Place:
    """Returns the place in the middle of a walkway, at one of its points.

    Args:
        walkways: the walkways.
        k: number of the walkway.
        forward: whether the pedestrian walks in its direction.
        at: row of the point, counted in walking direction.
        group: see `_Place`.
    """
    way = walkways[k]
    line = way.points if forward else way.points[::-1]
    x, y = (line[at + 1] - line[at])[:2]
    aside = way.limits[:: 1 if forward else -1][at].mean()
    aside = (aside if forward else -aside) / np.hypot(x, y)
    xy = line[at, :2] + aside * np.array([y, -x])
    return _Place(2 * k + 1 - forward, at, xy, math.atan2(y, x), group)


def _is_free(place: _Place, others: Sequence[_Place]) -> bool:
    """Returns whether a place is far enough from all others."""
    return all(
        np.hypot(*(place.xy - other.xy)) > _APART_AT_FIRST for other in others
    )
