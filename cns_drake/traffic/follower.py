"""The ego car, which follows other vehicles in a simulation of traffic."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.motion import KNOT_PERIOD, REACH, Trajectory
from cns_drake.traffic.car_following import (
    BEFORE_LINE,
    SIGHT,
    free_acceleration,
    interaction,
)
from cns_drake.traffic.ego_car import STEP, EgoBox
from cns_drake.traffic.giving_way import find_prior
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.occupants import find_ahead
from cns_drake.traffic.streets import Streets
from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP
from cns_drake.traffic.vehicle_records import CURRENT, VEHICLE, Traffic

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
# At the end of its path, the car has arrived once it is slower than this [m/s].
_ARRIVED_SPEED = 0.1
# Distance between the places at which the ego car's lane is determined [m].
_POINT_SPACING = 1.0
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
# Before a change of lanes, the car is in its new lane this early, so that it
# can request its way from there [m].
_LANE_LEAD = 25.0
# Before and after a change of lanes, the car counts in both lanes for this
# distance [m].
_IN_BOTH_LANES = 12.0


class _PathRun(NamedTuple):
    """A part of the ego car's path that lies on one piece.

    Attributes:
        piece: number of the piece; -1 on no lane.
        first, last: where on the path the front bumper enters and leaves the
            piece [m].
        s: place on the piece where the front bumper enters [m].
        beside: the lane from which the car changes to this piece; -1 for none.
        parts: where on the path the car has left that lane [m].
    """

    piece: int
    first: float
    last: float
    s: float
    beside: int = -1
    parts: float = 0.0


def find_runs(graph: LaneGraph, points: np.ndarray) -> list[_PathRun]:
    """Divides a car's path into the lanes and junction paths it follows.

    Args:
        graph: the lane graph.
        points: (N, 2) points of the car's path, 1 m apart.

    Returns:
        The parts of the path in driving order, each with the number of the lane
        or junction path in `graph.pieces`, or -1 where the car follows no lane
        or junction path.
    """
    near, misfit, place = _misfits(graph, points)
    best = _least_cost_sequence(misfit, _change_costs(graph, near))
    starts = np.flatnonzero(np.diff(best, prepend=-1))
    pieces = np.append(near, -1)[best[starts]].tolist()
    firsts = _POINT_SPACING * starts
    s = place[starts, best[starts]]
    for k, (before_it, piece) in enumerate(pairwise(pieces), 1):
        if before_it >= 0 and piece in graph.pieces[before_it].after:
            # The boundary is between two points.
            firsts[k], s[k] = firsts[k] - s[k], 0.0
    firsts = np.append(firsts, _POINT_SPACING * len(points))
    runs: list[_PathRun] = []
    for k, piece in enumerate(pieces):
        enters, leaves = firsts[k : k + 2].tolist()
        run = _PathRun(piece, enters, leaves, float(s[k]))
        last = runs[-1] if runs else run
        lane = graph.pieces[last.piece]
        if min(last.piece, piece) >= 0 and piece in (lane.left, lane.right):
            earlier = min(run.first - run.last + _LANE_LEAD, run.s)
            earlier = max(
                0.0, min(earlier, run.first - last.first - _POINT_SPACING)
            )
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


def _misfits(
    graph: LaneGraph, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the pieces near a path, and how well they fit its points.

    Args:
        graph: the lane graph.
        points: (N, 2) points of the path [m].

    Returns:
        (P,) numbers of the pieces; (N, P + 1) cost of each piece, and of no
        lane, at each point [m^2]; and (N, P + 1) places of the points along
        the pieces [m].
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
    return near, misfit, place


def _change_costs(graph: LaneGraph, near: np.ndarray) -> np.ndarray:
    """Returns the cost of going from one piece to another [m^2].

    Args:
        graph: the lane graph.
        near: (P,) numbers of the pieces.

    Returns:
        (P + 1, P + 1) costs, from the piece of the row to the piece of the
        column; the last row and column are for no lane.
    """
    off = len(near)
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
    return change


def _least_cost_sequence(misfit: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Returns the sequence of pieces with the least cost, (N,).

    The sequence is found by dynamic programming.

    Args:
        misfit: (N, P) cost of each piece at each point.
        change: (P, P) cost of going from one piece, the row, to another.
    """
    cost = misfit[0]
    before = np.zeros(misfit.shape, int)
    for row in range(1, len(misfit)):
        costs = cost[:, None] + change
        before[row] = costs.argmin(axis=0)
        cost = costs.min(axis=0) + misfit[row]
    best = np.zeros(len(misfit), int)
    best[-1] = cost.argmin()
    for row in range(len(misfit) - 1, 0, -1):
        best[row - 1] = before[row, best[row]]
    return best


class Follower:
    """The ego car, which follows other vehicles in a simulation of traffic.

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
        u = _POINT_SPACING * np.arange(
            int((self._path.end + box.front) / _POINT_SPACING) + 1
        )
        jet = self._path.evaluate(u)
        beyond = np.maximum(u - self._path.end, 0.0)[:, None]
        self._runs = find_runs(graph, jet.p[:, :2] + beyond * jet.dp[:, :2])
        self._box = box
        self._start = start
        # Like any other, the drive begins at rest.
        self._leaves = start + round(REACH * KNOT_PERIOD / STEP)
        self._run = 0
        self._held: _PathRun | None = None
        self.u = [0.0]
        self.arrived = False

    def record(self, streets: Streets) -> np.ndarray:
        """Returns the car at its start as a record of dtype `VEHICLE`, (1,)."""
        car = np.zeros(1, VEHICLE)
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
        wanted = free_acceleration(car, car["top"])
        gap, speed, line = self._car_ahead(traffic, car)
        stop, gap_2, speed_2 = find_prior(traffic, len(traffic.cars) - 1)
        line = min(line, stop)
        if gap_2 < gap:
            gap, speed = gap_2, speed_2
        loss = interaction(
            car, line + STANDSTILL_GAP - BEFORE_LINE, float(car["v"])
        )
        if gap < SIGHT:
            loss = max(loss, interaction(car, gap, car["v"] - speed))
        bound = _PART_OF_BOUND * self._profile.acceleration
        v = max(0.0, car["v"] + max(wanted - loss, -bound) * STEP)
        ahead = u + max(car["v"] * STEP, _AHEAD)
        v = min(v, np.interp(ahead, self._profile.u, self._square) ** 0.5)
        u += 0.5 * (car["v"] + v) * STEP
        if u > self._path.end - 2 * _AHEAD and v < _ARRIVED_SPEED:
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
        """Sets the pieces on which the car is now, and its permission.

        Args:
            streets: arrays of all lanes.
            car: record of the car, changed in place.
        """
        front = self.u[-1] + self._box.front
        runs = self._runs
        while self._run < len(runs) - 1 and front >= runs[self._run].last:
            self._run += 1
        run = runs[self._run]
        after = runs[self._run + 1] if self._run < len(runs) - 1 else None
        car["path"][:] = -1
        car["left_lane"] = run.beside if front < run.parts else -1
        self._update_permission(car, front, after)
        if run.piece < 0:
            return
        car["s"] = run.s + front - run.first
        self._set_pieces_behind(streets, car["path"])
        self._set_pieces_ahead(streets, car, front, after)

    def _update_permission(
        self, car: np.void, front: float, after: _PathRun | None
    ) -> None:
        """Updates which way is kept free for the car.

        Args:
            car: record of the car, changed in place.
            front: distance of the front bumper along its path [m].
            after: the run behind the present one, if any.
        """
        if car["held"] < 0:
            self._held = None
        if car["granted"] and self._held is None:
            self._held = after
        if self._held is not None and front >= self._held.last:
            car["granted"] = False
            if front - car["length"] >= self._held.last:
                car["held"] = -1
                self._held = None

    def _set_pieces_behind(self, streets: Streets, path: np.ndarray) -> None:
        """Sets the present piece of the car, and those that its rear may be on.

        Args:
            streets: arrays of all lanes.
            path: (NUM_PIECES,) the car's field `path`, changed in place.
        """
        before = self._runs[self._run]
        path[CURRENT] = before.piece
        column = CURRENT
        for other in self._runs[: self._run][::-1]:
            column -= 1
            if column < 0 or other.piece < 0:
                break
            if not _leads(streets, other.piece, before.piece):
                break
            path[column], before = other.piece, other

    def _set_pieces_ahead(
        self,
        streets: Streets,
        car: np.void,
        front: float,
        after: _PathRun | None,
    ) -> None:
        """Sets the way and the lane ahead of the car.

        If the next piece is a lane beside the present one, the car is on both
        shortly before.

        Args:
            streets: arrays of all lanes.
            car: record of the car, changed in place.
            front: distance of the front bumper along its path [m].
            after: the run behind the present one, if any.
        """
        path = car["path"]
        run = self._runs[self._run]
        way, column = run.piece, CURRENT + 1
        if not streets.pieces[way]["is_way"]:
            if after is None or after.piece < 0:
                return
            way = after.piece
            if not streets.pieces[way]["is_way"]:
                if run.last - front < _IN_BOTH_LANES:
                    car["left_lane"] = way
                return
            path[column] = way
            column += 1
        path[column] = streets.after[streets.pieces[way]["after_first"]]

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
