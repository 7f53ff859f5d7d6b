"""Plans the motion of all traffic before a drive.

This includes the ego car, if it follows other vehicles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.base.elementary import arcsin, arctan2
from cns_drake.motion.path_geometry import REACH
from cns_drake.motion.speed_profile import KNOT_PERIOD
from cns_drake.motion.trajectory import Trajectory
from cns_drake.traffic import vehicles as motion
from cns_drake.traffic.lane_graph import LaneGraph, Walkway
from cns_drake.traffic.overlaps import find_overlaps
from cns_drake.traffic.right_of_way import grant_ways
from cns_drake.traffic.social_force import WALKER_LENGTH, WALKER_WIDTH
from cns_drake.traffic.streets import STEP, EgoBox, Streets, make_streets
from cns_drake.traffic.vehicle_kinds import (
    KINDS,
    STANDSTILL_GAP,
    VehicleKind,
    draw_kinds,
)
from cns_drake.traffic.vehicles import CURRENT, SIGHT, Traffic, find_ahead
from cns_drake.traffic.walkers import Crowd

# Distance between the places at which the ego car's lane is determined [m].
_STEP = 1.0
# The car's lane is at most this far away [m].
_LANE_REACH = 3.0
# The car and its lane have the same direction within 45 deg (cosine).
_ALIGNED = 0.7
# Cost of a metre of the path on no lane; a metre on a lane costs the square of
# the lane's distance [m^2].
_COST_OF_NO_LANE = 4.0
# Cost of a change of lanes [m^2].
_COST_OF_CHANGE = 8.0
# Cost of leaving all lanes, and of coming back [m^2].
_COST_OF_LEAVING = 20.0
# Before and after a change of lanes, the car counts in both lanes for this
# distance [m].
_IN_BOTH_LANES = 12.0
# Before a change of lanes, the car is in its new lane this early, so that it
# can request its way from there [m].
_LANE_LEAD = 25.0
# Acceleration of the Intelligent Driver Model [m/s^2].
_ACCELERATION = 1.5
# Comfortable deceleration of the model [m/s^2].
_DECELERATION = 1.8
# Time headway of the model [s].
_HEADWAY = 1.3
# The model uses at most this share of the drive's greatest acceleration.
_PART_OF_BOUND = 0.95
# The bounds of the speed are taken at least this far ahead [m].
_AHEAD = 0.05


class _Run(NamedTuple):
    """A part of the ego car's path that lies on one piece.

    Attributes:
        piece: number of the piece; -1 on no lane.
        first, last: where on the path the front bumper enters and leaves the
            piece [m].
        s: place on the piece where it enters [m].
        beside: the lane from which the car changes to this one; -1 for none.
        parts: where on the path the car has left that lane [m].
    """

    piece: int
    first: float
    last: float
    s: float
    beside: int = -1
    parts: float = 0.0


def find_runs(graph: LaneGraph, points: np.ndarray) -> list[_Run]:
    """Divides a car's path into the lanes and junction paths it follows.

    Args:
        graph: the lane graph.
        points: (N, 2) points of the car's path, 1 m apart.

    Returns:
        The parts of the path in driving order, each with the number of the lane
        or junction path in `graph.pieces`, or -1 where the car follows no lane
        or junction path.
    """
    lines = [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    tree = shapely.STRtree(lines)
    rows, found = tree.query(shapely.points(points), "dwithin", _LANE_REACH)
    near, columns = np.unique(found, return_inverse=True)
    here, on = shapely.points(points[rows]), np.array(lines)[found]
    places = shapely.line_locate_point(on, here)
    along = np.subtract(
        *(
            shapely.get_coordinates(
                shapely.line_interpolate_point(on, np.maximum(places + d, 0.0))
            )
            for d in (0.5, -0.5)
        )
    )
    ahead = np.gradient(points, axis=0)[rows]
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(ahead, axis=1)
    fits = np.sum(along * ahead, axis=1) > _ALIGNED * size
    off = len(near)
    misfit = np.full((len(points), off + 1), np.inf)
    misfit[:, off] = _COST_OF_NO_LANE
    distance = shapely.distance(on, here)
    misfit[rows[fits], columns[fits]] = distance[fits] ** 2
    place = np.zeros(misfit.shape)
    place[rows, columns] = places
    change = np.full((off + 1, off + 1), np.inf)
    change[off], change[:, off] = _COST_OF_LEAVING, _COST_OF_LEAVING
    for row, number in enumerate(near):
        piece = graph.pieces[number]
        for others, cost in (
            (piece.after, 0.0),
            ((piece.left, piece.right), _COST_OF_CHANGE),
        ):
            change[row, :off][np.isin(near, others)] = cost
    np.fill_diagonal(change, 0.0)
    # Dynamic programming finds the sequence of pieces with the least cost.
    cost = misfit[0]
    before = np.zeros(misfit.shape, int)
    for row in range(1, len(points)):
        costs = cost[:, None] + change
        before[row] = costs.argmin(axis=0)
        cost = costs.min(axis=0) + misfit[row]
    best = np.zeros(len(points), int)
    best[-1] = cost.argmin()
    for row in range(len(points) - 1, 0, -1):
        best[row - 1] = before[row, best[row]]
    starts = np.flatnonzero(np.diff(best, prepend=-1))
    pieces = np.append(near, -1)[best[starts]].tolist()
    firsts = _STEP * starts
    s = place[starts, best[starts]]
    for k, (before_it, piece) in enumerate(pairwise(pieces), 1):
        if before_it >= 0 and piece in graph.pieces[before_it].after:
            # The boundary is between two points.
            firsts[k], s[k] = firsts[k] - s[k], 0.0
    firsts = np.append(firsts, _STEP * len(points))
    runs: list[_Run] = []
    for k, piece in enumerate(pieces):
        enters, leaves = firsts[k : k + 2].tolist()
        run = _Run(piece, enters, leaves, float(s[k]))
        last = runs[-1] if runs else run
        lane = graph.pieces[last.piece]
        if min(last.piece, piece) >= 0 and piece in (lane.left, lane.right):
            earlier = min(run.first - run.last + _LANE_LEAD, run.s)
            earlier = max(0.0, min(earlier, run.first - last.first - _STEP))
            first = run.first - earlier
            runs[-1] = last._replace(last=first)
            run = run._replace(
                first=first,
                s=run.s - earlier,
                beside=last.piece,
                parts=run.first + _IN_BOTH_LANES,
            )
        runs.append(run)
    return runs


class Follower:
    """The ego car in a simulation of traffic, which follows other vehicles.

    The car drives along its path by the Intelligent Driver Model, asks for the
    right of way like other vehicles, and keeps the speed limits of its drive.

    Attributes:
        u: distances along the path at all time steps so far [m].
        arrived: whether the car stands at the end of the path.
    """

    def __init__(
        self, graph: LaneGraph, trajectory: Trajectory, box: EgoBox, start: int
    ):
        """Places a car at the beginning of its path.

        Args:
            graph: the lane graph.
            trajectory: drive whose path and bounds of the speed the car keeps.
            box: size of the car.
            start: number of the time step at which the drive begins.
        """
        self._path = trajectory.path
        self._profile = trajectory.speed_profile
        self._square = self._profile.speed**2
        # The front bumper's path, which continues straight beyond the end.
        u = _STEP * np.arange(int((self._path.end + box.front) / _STEP) + 1)
        jet = self._path.evaluate(u)
        beyond = np.maximum(u - self._path.end, 0.0)[:, None]
        self._runs = find_runs(graph, jet.p[:, :2] + beyond * jet.dp[:, :2])
        self._box = box
        self._start = start
        # Like any other, the drive begins at rest.
        self._leaves = start + round(REACH * KNOT_PERIOD / STEP)
        self._run = 0
        self._held: _Run | None = None
        self.u = [0.0]
        self.arrived = False

    def record(self, streets: Streets) -> np.ndarray:
        """Returns the car at its start as a record of dtype `VEHICLE`, (1,)."""
        car = np.zeros(1, motion.VEHICLE)
        bound = _PART_OF_BOUND * self._profile.acceleration
        for name, value in (
            ("length", self._box.front - self._box.rear),
            ("top", self._profile.speed.max()),
            ("factor", 1.0),
            ("a", min(_ACCELERATION, bound)),
            ("b", min(_DECELERATION, bound)),
            ("headway", _HEADWAY),
            ("guided", True),
            ("held", -1),
            ("since", np.inf),
            ("change_length", 1.0),
        ):
            car[name] = value
        self._place(streets, car[0])
        return car

    def step(self, traffic: Traffic, k: int) -> None:
        """Moves the car by one time step.

        Args:
            traffic: the traffic, in which the car is the last of the vehicles.
            k: number of the time step.
        """
        car = traffic.cars[-1]
        u = self.u[-1]
        if k < self._leaves or self.arrived:
            self.u.append(u)
            return
        wanted = motion.free_acceleration(car, car["top"])
        gap, speed, line = self._car_ahead(traffic, car)
        stop, gap_2, speed_2 = motion.find_prior(traffic, len(traffic.cars) - 1)
        line = min(line, stop)
        if gap_2 < gap:
            gap, speed = gap_2, speed_2
        loss = motion.interaction(
            car, line + STANDSTILL_GAP - motion.BEFORE_LINE, float(car["v"])
        )
        if gap < SIGHT:
            loss = max(loss, motion.interaction(car, gap, car["v"] - speed))
        bound = _PART_OF_BOUND * self._profile.acceleration
        v = max(0.0, car["v"] + max(wanted - loss, -bound) * STEP)
        ahead = u + max(car["v"] * STEP, _AHEAD)
        v = min(v, np.interp(ahead, self._profile.u, self._square) ** 0.5)
        u += 0.5 * (car["v"] + v) * STEP
        if u > self._path.end - 2 * _AHEAD and v < 0.1:
            u = self._path.end
            v = 0.0
            self.arrived = True
        self.u.append(u)
        car["v"] = v
        self._place(traffic.streets, car)

    def _car_ahead(
        self, traffic: Traffic, car: np.void
    ) -> tuple[float, float, float]:
        """Returns gap and speed of the car ahead, and how far the stop line is.

        The gap and the distance are in [m], the speed in [m/s]. The distance is
        inf if the car need not stop.
        """
        front = self.u[-1] + self._box.front
        who = len(traffic.cars) - 1
        pieces = traffic.streets.pieces
        gap, speed = np.inf, 0.0
        other = int(car["left_lane"])
        if other >= 0:
            length = pieces["length"]
            scale = length[other] / length[car["path"][CURRENT]]
            gap, speed = find_ahead(traffic, other, car["s"] * scale, who)
        for run in self._runs[self._run :]:
            if run.piece < 0 or run.first - front > SIGHT:
                break
            is_next = run.first > front and run is not self._held
            if is_next and pieces[run.piece]["is_way"]:
                return gap, speed, run.first - front
            gap_2, speed_2 = find_ahead(
                traffic, run.piece, run.s + front - run.first, who
            )
            if gap_2 < gap:
                gap, speed = gap_2, speed_2
        return gap, speed, np.inf

    def _place(self, streets: Streets, car: np.void) -> None:
        """Sets the pieces on which the car is now."""
        front = self.u[-1] + self._box.front
        runs = self._runs
        while self._run < len(runs) - 1 and front >= runs[self._run].last:
            self._run += 1
        run = runs[self._run]
        piece = run.piece
        path = car["path"]
        path[:] = -1
        is_way = piece >= 0 and bool(streets.pieces[piece]["is_way"])
        after = runs[self._run + 1] if self._run < len(runs) - 1 else None
        car["left_lane"] = run.beside if front < run.parts else -1
        if car["held"] < 0:
            self._held = None
        if car["granted"] and self._held is None:
            self._held = after
        if self._held is not None and front >= self._held.last:
            car["granted"] = False
            if front - car["length"] >= self._held.last:
                car["held"] = -1
                self._held = None
        if piece < 0:
            return
        path[CURRENT] = piece
        car["s"] = run.s + front - run.first
        column = CURRENT
        before = run
        for other in runs[: self._run][::-1]:
            column -= 1
            if column < 0 or other.piece < 0:
                break
            if not _leads(streets, other.piece, before.piece):
                break
            path[column], before = other.piece, other
        way = piece
        if not is_way:
            if after is None or after.piece < 0:
                return
            way = after.piece
            if not streets.pieces[way]["is_way"]:
                if run.last - front < _IN_BOTH_LANES:
                    car["left_lane"] = way
                return
            path[CURRENT + 1] = way
        first = streets.pieces[way]["after_first"]
        path[CURRENT + 1 + (not is_way)] = streets.after[first]

    def poses(self, steps: np.ndarray) -> np.ndarray:
        """Returns x, y [m] and yaw [rad] of the car box's centre, (N, 3).

        Args:
            steps: (N,) numbers of time steps; they may be fractions.
        """
        u = np.interp(steps, np.arange(len(self.u)), self.u)
        jet = self._path.evaluate(u)
        return self._box.middles(jet.p[:, :2], jet.yaw)

    def positions(self) -> np.ndarray:
        """Returns the distances along the path at evenly spaced times [m].

        The first time is the start of the drive; successive times are
        `KNOT_PERIOD` apart.
        """
        every = round(KNOT_PERIOD / STEP)
        u = np.array(self.u[self._start :: every])
        return u[: np.count_nonzero(u < self._path.end) + REACH + 1]


def _leads(streets: Streets, piece: int, other: int) -> bool:
    """Returns whether one piece leads to another."""
    row = streets.pieces[piece]
    first = row["after_first"]
    return other in streets.after[first : first + row["after_count"]]


# A pedestrian's box, which contains swinging limbs [m].
WALKER_SIZE = (WALKER_LENGTH, WALKER_WIDTH, 1.8)
# Number of steps for which traffic has moved when the drive begins.
_FIRST = 200
# Number of steps for which traffic moves on after an ego car that follows
# others has arrived.
_AFTER = 20
# Share of vehicles and pedestrians that are planned in addition, because some
# will be left out.
_SPARE_SHARE = 0.06
# Greatest number of plans that are tried.
_TRIES = 4
# After every so many steps, a trial is given up if it has to leave out too many
# bodies.
_PART = 200
# Boxes keep this distance, because they are compared only at some times [m].
_APART = 0.1
# Least and greatest gap between vehicles in a queue [m].
_GAPS = (1.5, 3.5)
# Least distance of a vehicle from the ego car that passes it [m].
_LETS_PASS = 0.4

# The ego car's motion: times (K,) -> places (K, 2) [m] and headings (K,) [rad].
EgoPath = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Tracks:
    """The tracks of N bodies: D coordinates each, at evenly spaced times.

    Between two of these times, every coordinate is a cubic polynomial with a
    continuous rate (Catmull-Rom spline). In the first and the last interval of
    a body, the coordinate is a parabola; before the first and after the last
    time, the coordinate is a straight line.

    Attributes:
        dt: time between two of the times [s].
        values: (K, N, D) coordinates; angles have no jumps.
        present: (K, N) bool, whether a body exists at each time; None if all
            bodies always exist. Between two times, a body exists if the body
            exists at both times.
    """

    dt: float
    values: np.ndarray
    present: np.ndarray | None = None

    def at(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the bodies' coordinates at a time t [s], and their rates.

        The rates are first time derivatives. Both results are (N, D); for
        several times (T,), they are (T, N, D).
        """
        k, u, beyond = self._interval(t)
        p0, p1 = self.values[k], self.values[k + 1]
        before, is_before = self._coordinates_at_step(k - 1)
        after, is_after = self._coordinates_at_step(k + 2)
        step = p1 - p0
        m1 = np.where(is_after, (after - p0) / 2, step)
        m0 = np.where(is_before, (p1 - before) / 2, 2 * step - m1)
        m1 = np.where(is_after, m1, 2 * step - m0)
        a, b = m0 + m1 - 2 * step, 3 * step - 2 * m0 - m1
        value = ((a * u + b) * u + m0) * u + p0
        rate = (3 * a * u + 2 * b) * u + m0
        return value + beyond * rate, rate / self.dt

    def _coordinates_at_step(
        self, k: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns coordinates at steps (...), and whether bodies are there.

        The coordinates are (..., N, D), and the second array fits them. No body
        is there before the first step and after the last one.
        """
        row = np.clip(k, 0, len(self.values) - 1)
        there = (k == row)[..., None]
        if self.present is not None:
            there = there & self.present[row]
        return self.values[row], there[..., None]

    def is_present(self, t: float | np.ndarray) -> np.ndarray:
        """Returns which bodies exist, (N,) bool, at a time [s].

        For several times (T,), the result is (T, N).
        """
        k, *_ = self._interval(t)
        if self.present is None:
            return np.ones((*k.shape, self.values.shape[1]), bool)
        return self.present[k] & self.present[k + 1]

    def _interval(self, t: float | np.ndarray) -> tuple[np.ndarray, ...]:
        """Returns each time's interval, its place there, and the steps beyond.

        Steps beyond are those before the first time or after the last. Place
        and steps have two more axes than the times.
        """
        last = len(self.values) - 1
        steps = np.asarray(t, float) / self.dt
        inside = np.clip(steps, 0.0, float(last))
        k = np.minimum(inside.astype(int), last - 1)
        return (
            k,
            (inside - k)[..., None, None],
            (steps - inside)[..., None, None],
        )

    def select(self, chosen: np.ndarray) -> Tracks:
        """Returns the tracks of some bodies, given their indices."""
        present = None if self.present is None else self.present[:, chosen]
        return Tracks(self.dt, self.values[:, chosen], present)


@dataclass(frozen=True)
class TrafficPlan:
    """The planned motion of vehicles and pedestrians.

    Attributes:
        kinds: kind of each of the N vehicles.
        vehicles: tracks of the vehicles, with five coordinates each: x, y, z of
            the middle of the vehicle's box on the ground [m], yaw and pitch
            [rad].
        walkers: tracks of the pedestrians, with five coordinates each: x, y, z
            on the ground [m], yaw and phase of the gait [rad].
        left_out: number of requested bodies that are left out because they
            would collide.
        positions: (K,) distances of the ego car along its path at times
            `KNOT_PERIOD` apart [m]; None if the ego car does not follow other
            vehicles.
        notes: notes for the user.
    """

    kinds: tuple[VehicleKind, ...]
    vehicles: Tracks
    walkers: Tracks
    left_out: int = 0
    positions: np.ndarray | None = None
    notes: tuple[str, ...] = ()


class _Task(NamedTuple):
    """What all trials of a plan have in common; see `plan_traffic`.

    Attributes:
        streets: the graph, and the ego car at K steps, the first of which are
            before the drive.
        ego_track: (2 K - 1, 3) x, y [m], heading [rad] of the middle of the ego
            car's box at steps and half steps.
        drive: the ego car's drive, if it follows other vehicles; it then stands
            still in `streets` and `ego_track`.
    """

    graph: LaneGraph
    walkways: Sequence[Walkway]
    streets: Streets
    ego_track: np.ndarray
    ego_box: EgoBox
    vehicles: int
    walkers: int
    drive: Trajectory | None


def plan_traffic(
    graph: LaneGraph,
    walkways: Sequence[Walkway],
    *,
    vehicles: int,
    walkers: int,
    seed: int,
    duration: float,
    ego: EgoPath,
    ego_box: EgoBox,
    drive: Trajectory | None = None,
) -> TrafficPlan:
    """Plans the traffic of a drive, with the requested numbers if possible.

    Equal arguments give an equal plan. The plan has no collisions, but may have
    fewer vehicles and pedestrians than requested.

    Args:
        graph: lanes and crossings.
        walkways: sidewalks on which pedestrians walk, and crossings.
        vehicles, walkers: requested numbers of vehicles and pedestrians.
        seed: seed of the random kinds, places and routes.
        duration: duration of the drive [s]. If the ego car follows other
            vehicles, this is the longest time that the drive may take.
        ego: function that takes times (K,) [s], and returns positions (K, 2)
            [m] and headings (K,) [rad] of the ego car. If the ego car follows
            other vehicles, only its first position counts.
        ego_box: size of the ego car.
        drive: path and speeds of the ego car if it follows other vehicles;
            otherwise None.
    """
    # Traffic continues after the drive, for a LiDAR that is still turning.
    num_steps = _FIRST + int(np.ceil(duration / STEP)) + 4
    # The ego car stands until its drive begins.
    half_steps = np.arange(2 * num_steps - 1) - 2 * _FIRST
    times = STEP / 2 * np.maximum(half_steps, 0)
    task = _Task(
        graph,
        walkways,
        make_streets(graph, ego_box, *ego(times[::2])),
        ego_box.middles(*ego(times)),
        ego_box,
        vehicles,
        walkers,
        drive,
    )
    if drive is not None:
        # The car blocks its first place at first; after that it is one of the
        # vehicles.
        task.streets.until[1:] = np.inf
    best: TrafficPlan | None = None
    for attempt in range(_TRIES):
        if best is not None and drive is not None and best.positions is None:
            best = None
        best = _try(task, np.random.default_rng([seed, attempt]), best)
        has_arrived = drive is None or best.positions is not None
        if has_arrived and best.left_out == 0:
            break
    assert best is not None
    return best


def _try(
    task: _Task, rng: np.random.Generator, best: TrafficPlan | None
) -> TrafficPlan:
    """Returns a new plan, or the best one so far if the new is no better."""
    trial = begin_trial(task, rng)
    num_steps = len(task.streets.until)
    for first in range(0, num_steps, _PART):
        trial.run(range(first, min(first + _PART, num_steps)))
        if best is not None and trial.left_out() >= best.left_out:
            return best
        if trial.is_over(first + _PART):
            return trial.plan()
    # An ego car that follows others has not arrived in this trial.
    return best if best is not None and task.drive is not None else trial.plan()


class Trial:
    """One simulation of traffic, which finds bodies that would collide."""

    def __init__(
        self,
        task: _Task,
        kinds: Sequence[VehicleKind],
        crowd: Crowd,
        traffic: Traffic,
        follower: Follower | None,
        seed: int,
    ):
        """Takes the bodies before the first time step.

        Args:
            task: what all trials have in common.
            kinds: kinds of the vehicles in `traffic`, without the ego car.
            crowd: the pedestrians.
            traffic: the vehicles. If the ego car follows others, it is the last
                of them.
            follower: the ego car, if it follows others.
            seed: seed of the random routes.
        """
        self._task = task
        self._kinds = kinds
        self._crowd = crowd
        self._traffic = traffic
        self._follower = follower
        self._seed = seed
        self._num_steps = 0
        num_steps = len(task.streets.until)
        num_walkers = len(self._crowd.walkers)
        # The columns are those of `TrafficPlan`.
        self._vehicles = np.zeros((num_steps, len(kinds), 5))
        self._walkers = np.zeros((num_steps, num_walkers, 5))
        # Ego car, vehicles, pedestrians.
        self._half_sizes = _APART / 2 + np.array(
            [
                task.ego_box.half_size,
                *((k.size[0] / 2, k.size[1] / 2) for k in self._kinds),
                *([(WALKER_LENGTH / 2, WALKER_WIDTH / 2)] * num_walkers),
            ]
        )
        self._overlaps = np.zeros((len(self._half_sizes),) * 2, bool)

    def run(self, steps: range) -> None:
        """Simulates the given time steps.

        The motion of vehicles and pedestrians is stored, and also which pairs
        of bodies overlap, the ego car included.
        """
        traffic, crowd = self._traffic, self._crowd
        cars = traffic.cars
        past_cars = np.empty((len(steps), len(self._kinds)), cars.dtype)
        past_walkers = np.empty(
            (len(steps), len(crowd.walkers)), crowd.walkers.dtype
        )
        for row, k in enumerate(steps):
            past_cars[row] = cars[: len(self._kinds)]
            past_walkers[row] = crowd.walkers
            motion.find_occupants(traffic, k)
            grant_ways(traffic, k)
            wanted = motion.accelerations(traffic)
            if self._follower is not None:
                self._follower.step(traffic, k)
            motion.change_lanes(traffic, k)
            motion.advance(traffic, wanted)
            crowd.step(k * STEP, self._seed + 1)
        rows = slice(steps.start, steps.stop)
        self._vehicles[rows] = motion.vehicle_poses(traffic.streets, past_cars)
        self._walkers[rows] = crowd.poses(past_walkers)
        # From the step before, because of the half step in between.
        first = max(steps.start - 1, 0)
        rows = slice(first, steps.stop)
        half_steps = np.arange(2 * first, 2 * steps.stop - 1)
        if self._follower is None:
            ego = self._task.ego_track[half_steps]
        else:
            ego = self._follower.poses(half_steps / 2)
        vehicles, walkers = (
            _at_half_steps(bodies[rows])
            for bodies in (self._vehicles, self._walkers)
        )
        poses = np.concatenate([ego[:, None], vehicles, walkers], axis=1)
        find_overlaps(poses, self._half_sizes, self._overlaps)
        self._num_steps = steps.stop

    def is_over(self, num_steps: int) -> bool:
        """Returns whether the simulation can end before its last time step.

        The simulation can end if the ego car follows other vehicles, and
        arrived at least 20 time steps ago.

        Args:
            num_steps: number of time steps simulated so far.
        """
        if self._follower is None:
            return False
        u = self._follower.u
        return self._follower.arrived and u[num_steps - _AFTER] == u[-1]

    def _kept(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the vehicles and pedestrians that overlap no other body."""
        kept = np.ones(len(self._half_sizes), bool)
        kept[whom_to_leave_out(self._overlaps, 1)] = False
        vehicles, walkers = (
            np.flatnonzero(part)
            for part in np.split(kept[1:], [len(self._kinds)])
        )
        return vehicles[: self._task.vehicles], walkers[: self._task.walkers]

    def left_out(self) -> int:
        """Returns how many requested vehicles and pedestrians are left out.

        A body is left out if it would overlap with another body.
        """
        vehicles, walkers = self._kept()
        wanted = self._task.vehicles + self._task.walkers
        return wanted - len(vehicles) - len(walkers)

    def plan(self) -> TrafficPlan:
        """Returns the plan that results from all time steps so far."""
        vehicles_at = self._vehicles[: self._num_steps]
        walkers_at = self._walkers[: self._num_steps]
        yaw = vehicles_at[:, :, 3]
        yaw[:] = np.unwrap(yaw, axis=0)
        vehicles, walkers = self._kept()
        return TrafficPlan(
            tuple(self._kinds[k] for k in vehicles),
            Tracks(STEP, _spline_values(vehicles_at[:, vehicles])),
            Tracks(STEP, _spline_values(walkers_at[:, walkers])),
            self.left_out(),
            self._follower.positions()
            if self._follower is not None and self._follower.arrived
            else None,
        )


def begin_trial(task: _Task, rng: np.random.Generator) -> Trial:
    """Returns a trial in which vehicles and pedestrians have random places."""
    number = min(
        _with_spare(task.vehicles),
        max(task.vehicles, motion.room_for_vehicles(task.graph)),
    )
    kinds = [KINDS[k] for k in draw_kinds(number, rng)]
    cars, found = motion.place_vehicles(kinds, task.streets, rng)
    crossings = motion.make_crossings(task.graph)
    walkers = _with_spare(task.walkers)
    crowd = Crowd(walkers, task.walkways, crossings, rng)
    seed = int(rng.integers(2**31))
    follower: Follower | None = None
    if task.drive is not None:
        follower = Follower(task.graph, task.drive, task.ego_box, _FIRST)
        cars = np.append(cars, follower.record(task.streets))
    traffic = motion.begin_traffic(task.streets, cars, crossings, seed)
    return Trial(
        task, [kinds[k] for k in found], crowd, traffic, follower, seed
    )


def _spline_values(values: np.ndarray) -> np.ndarray:
    """Returns the values (K - F, N, D) of a cubic B-spline at its knots.

    Its control points are (K, N, D), at all steps; F steps are before the
    drive. A spline through the values has no greater accelerations than the
    control points.
    """
    before, here, after = (
        values[_FIRST + k : len(values) - 1 + k] for k in (-1, 0, 1)
    )
    return (before + 4.0 * here + after) / 6.0


def _with_spare(number: int) -> int:
    return int(np.ceil(number * (1 + _SPARE_SHARE)))


def _at_half_steps(values: np.ndarray) -> np.ndarray:
    """Returns x, y, yaw (2 K - 1, N, 3) at steps and half steps."""
    xy_yaw = values[:, :, [0, 1, 3]]
    xy_yaw[:, :, 2] = np.unwrap(xy_yaw[:, :, 2], axis=0)
    result = np.empty((2 * len(xy_yaw) - 1, *xy_yaw.shape[1:]))
    result[::2] = xy_yaw
    result[1::2] = (xy_yaw[1:] + xy_yaw[:-1]) / 2
    return result


def whom_to_leave_out(overlaps: np.ndarray, kept: int) -> list[int]:
    """Returns the bodies to remove so that none overlap, as sorted indices.

    Bodies with the most overlaps are removed first.

    Args:
        overlaps: (N, N) bool, symmetric: which bodies overlap.
        kept: the first `kept` bodies are never removed.
    """
    overlaps = overlaps.copy()
    out: list[int] = []
    while True:
        involved = overlaps.sum(axis=0)
        involved[:kept] = 0
        if not involved.any():
            return sorted(out)
        worst = int(involved.argmax())
        out.append(worst)
        overlaps[worst] = overlaps[:, worst] = False


def plan_queues(
    graph: LaneGraph,
    *,
    seed: int,
    duration: float,
    ego: EgoPath,
    ego_box: EgoBox,
) -> TrafficPlan:
    """Plans vehicles that stand in queues in all lanes between junctions.

    A vehicle is absent while the ego car is at the vehicle's place.

    Args:
        graph: lanes and crossings.
        seed: seed of the random kinds of vehicles and gaps between them.
        duration: duration of the drive [s].
        ego: function that takes times (K,) [s], and returns positions (K, 2)
            [m] and headings (K,) [rad] of the ego car.
        ego_box: the rectangle on the ground that the ego car covers.
    """
    rng = np.random.default_rng(seed)
    kinds, rows = [], []
    for number in graph.lanes:
        points = graph.pieces[number].points
        lane = shapely.LineString(points)
        end = lane.length - float(rng.uniform(*_GAPS))
        while True:
            kind = KINDS[int(draw_kinds(1, rng)[0])]
            begin = end - kind.size[0]
            if begin < 0.0:
                break
            # Both axles stand on the lane; slopes are assumed to be small.
            rear, front = (
                shapely.get_coordinates(
                    lane.interpolate(begin + kind.size[0] / 2 + axle),
                    include_z=True,
                )[0]
                for axle in kind.axles
            )
            middle = rear + (front - rear) * (
                -kind.axles[0] / (kind.axles[1] - kind.axles[0])
            )
            x, y, z = (front - rear) / np.linalg.norm(front - rear)
            kinds.append(kind)
            rows.append([*middle, float(arctan2(y, x)), -float(arcsin(z))])
            end = begin - float(rng.uniform(*_GAPS))
    places = np.array(rows).reshape(-1, 5)
    times = np.arange(0.0, duration + 2 * STEP, STEP)
    present = np.ones((len(times), len(kinds)), bool)
    boxes = [
        EgoBox(-kind.size[0] / 2, kind.size[0] / 2, kind.size[1] / 2).corners(
            row[None, :2], row[3:4]
        )[0]
        for kind, row in zip(kinds, places, strict=True)
    ]
    tree = shapely.STRtree(shapely.polygons(boxes) if boxes else [])
    passing = shapely.polygons(ego_box.corners(*ego(times)))
    step, near = tree.query(passing, "dwithin", _LETS_PASS)
    for shift in (-1, 0, 1):
        present[np.clip(step + shift, 0, len(times) - 1), near] = False
    tracks = Tracks(STEP, np.tile(places, (len(times), 1, 1)), present)
    walkers = Tracks(STEP, np.zeros((len(times), 0, 5)))
    return TrafficPlan(tuple(kinds), tracks, walkers)
