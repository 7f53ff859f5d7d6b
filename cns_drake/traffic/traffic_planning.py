"""Plans the motion of all traffic before a drive.

This includes the ego car, if it follows other vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.base import arcsin, arctan2
from cns_drake.motion import Trajectory
from cns_drake.traffic.car_following import accelerations
from cns_drake.traffic.ego_car import STEP, EgoBox, EgoPath
from cns_drake.traffic.follower import Follower
from cns_drake.traffic.lane_changes import change_lanes
from cns_drake.traffic.lane_graph import LaneGraph, Walkway
from cns_drake.traffic.occupants import find_occupants
from cns_drake.traffic.overlaps import find_overlaps
from cns_drake.traffic.right_of_way import grant_ways
from cns_drake.traffic.social_force import WALKER_LENGTH, WALKER_WIDTH
from cns_drake.traffic.streets import (
    Streets,
    is_ego_far,
    make_streets,
    places_on,
)
from cns_drake.traffic.tracks import Tracks
from cns_drake.traffic.traffic_plan import TrafficPlan
from cns_drake.traffic.vehicle_kinds import KINDS, VehicleKind, draw_kinds
from cns_drake.traffic.vehicle_records import (
    CURRENT,
    VEHICLE,
    Traffic,
    begin_traffic,
    make_crossings,
)
from cns_drake.traffic.vehicle_steps import advance
from cns_drake.traffic.walkers import Crowd

# Greatest number of plans that are tried.
_TRIES = 4
# After every so many steps, a trial is given up if it has to leave out too many
# bodies.
_PART = 200


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
        seed: seed of all random choices: kinds, places and routes.
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
    num_steps = _FIRST_STEP + int(np.ceil(duration / STEP)) + 4
    # The ego car stands until its drive begins.
    half_steps = np.arange(2 * num_steps - 1) - 2 * _FIRST_STEP
    times = STEP / 2 * np.maximum(half_steps, 0)
    task = _TrafficTask(
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
        best = _better_plan(task, np.random.default_rng([seed, attempt]), best)
        has_arrived = drive is None or best.positions is not None
        if has_arrived and best.left_out == 0:
            break
    assert best is not None
    return best


def _better_plan(
    task: _TrafficTask, rng: np.random.Generator, best: TrafficPlan | None
) -> TrafficPlan:
    """Returns the plan of a new trial if better than `best`, or else `best`."""
    trial = _begin_trial(task, rng)
    num_steps = len(task.streets.until)
    for first in range(0, num_steps, _PART):
        trial.run(range(first, min(first + _PART, num_steps)))
        if best is not None and trial.left_out() >= best.left_out:
            return best
        if trial.is_over(first + _PART):
            return trial.plan()
    # An ego car that follows others has not arrived in this trial.
    return best if best is not None and task.drive is not None else trial.plan()


# The step at which the drive begins; traffic moves in the steps before it.
_FIRST_STEP = 200
# Number of steps for which traffic moves on after an ego car that follows
# others has arrived.
_AFTER = 20
# Share of vehicles and pedestrians that are planned in addition, because some
# will be left out.
_SPARE_SHARE = 0.06
# Boxes keep this distance, because they are compared only at some times [m].
_APART = 0.1


class _TrafficTask(NamedTuple):
    """What all trials of a plan have in common.

    Attributes:
        graph: lanes and crossings.
        walkways: sidewalks on which pedestrians walk, and crossings.
        streets: the graph, and the ego car at K steps, the first of which are
            before the drive.
        ego_track: (2 K - 1, 3) x, y [m], heading [rad] of the middle of the ego
            car's box at steps and half steps.
        ego_box: size of the ego car.
        vehicles, walkers: requested numbers of vehicles and pedestrians.
        drive: the ego car's drive, if the ego car follows other vehicles. In
            this case, the ego car stands still in `streets` and `ego_track`.
    """

    graph: LaneGraph
    walkways: Sequence[Walkway]
    streets: Streets
    ego_track: np.ndarray
    ego_box: EgoBox
    vehicles: int
    walkers: int
    drive: Trajectory | None


class Trial:
    """One simulation of traffic, which finds bodies that would collide."""

    def __init__(
        self,
        task: _TrafficTask,
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
            traffic: the vehicles. If the ego car follows other vehicles, the
                ego car is the last entry.
            follower: the ego car, if it follows other vehicles.
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
            find_occupants(traffic, k)
            grant_ways(traffic, k)
            wanted = accelerations(traffic)
            if self._follower is not None:
                self._follower.step(traffic, k)
            change_lanes(traffic, k)
            advance(traffic, wanted)
            crowd.step(k * STEP, self._seed + 1)
        rows = slice(steps.start, steps.stop)
        self._vehicles[rows] = vehicle_poses(traffic.streets, past_cars)
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
        """Returns which bodies are in the plan, as indices of their kind.

        The result has the vehicles, and then the pedestrians, that remain when
        no two bodies overlap any more, up to the requested numbers.
        """
        kept = np.ones(len(self._half_sizes), bool)
        kept[whom_to_leave_out(self._overlaps)] = False
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
        vehicles_at = self._vehicles[: self._num_steps].copy()
        vehicles_at[:, :, 3] = np.unwrap(vehicles_at[:, :, 3], axis=0)
        walkers_at = self._walkers[: self._num_steps]
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


def _begin_trial(task: _TrafficTask, rng: np.random.Generator) -> Trial:
    """Returns a trial in which vehicles and pedestrians have random places."""
    number = min(
        _with_spare(task.vehicles),
        max(task.vehicles, room_for_vehicles(task.graph)),
    )
    kinds = [KINDS[k] for k in draw_kinds(number, rng)]
    cars, found = place_vehicles(kinds, task.streets, rng)
    crossings = make_crossings(task.graph)
    walkers = _with_spare(task.walkers)
    crowd = Crowd(walkers, task.walkways, crossings, rng)
    seed = int(rng.integers(2**31))
    follower: Follower | None = None
    if task.drive is not None:
        follower = Follower(task.graph, task.drive, task.ego_box, _FIRST_STEP)
        cars = np.append(cars, follower.record(task.streets))
    traffic = begin_traffic(task.streets, cars, crossings, seed)
    return Trial(
        task, [kinds[k] for k in found], crowd, traffic, follower, seed
    )


def _spline_values(values: np.ndarray) -> np.ndarray:
    """Returns the values (K - F - 1, N, D) of a cubic B-spline at its knots.

    Its control points are (K, N, D), at all steps; F steps are before the
    drive, and the last step is only a neighbour of the one before it. A
    spline through the values has no greater accelerations than the
    control points.
    """
    before, here, after = (
        values[_FIRST_STEP + k : len(values) - 1 + k] for k in (-1, 0, 1)
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


def whom_to_leave_out(overlaps: np.ndarray) -> list[int]:
    """Returns the bodies to remove so that none overlap, as sorted indices.

    Bodies with the most overlaps are removed first. The first body, the ego
    car, is never removed.

    Args:
        overlaps: (N, N) bool, symmetric: which bodies overlap.
    """
    overlaps = overlaps.copy()
    out: list[int] = []
    while True:
        involved = overlaps.sum(axis=0)
        involved[0] = 0
        if not involved.any():
            return sorted(out)
        worst = int(involved.argmax())
        out.append(worst)
        overlaps[worst] = overlaps[:, worst] = False


def vehicle_poses(streets: Streets, cars: np.ndarray) -> np.ndarray:
    """Returns the poses (..., 5) of vehicles.

    A pose consists of x, y, z of the centre of the box's base on the ground
    [m], yaw and pitch [rad].

    Args:
        streets: the lanes on which the vehicles are.
        cars: (...) records of dtype `VEHICLE`.
    """
    half = 0.5 * cars["length"]
    front = _points_behind(streets, cars, half - cars["front_axle"])
    rear = _points_behind(streets, cars, half - cars["rear_axle"])
    x, y, z = (a - b for a, b in zip(front, rear, strict=True))
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    middle = [
        place - cars["rear_axle"] * ahead
        for place, ahead in zip(rear, (x, y, z), strict=True)
    ]
    return np.stack([*middle, arctan2(y, x), -arcsin(z)], axis=-1)


def _points_behind(
    streets: Streets, cars: np.ndarray, back: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Returns x, y, z at a distance `back` behind each front bumper [m].

    Args:
        streets: arrays of all lanes.
        cars: (...) records of dtype `VEHICLE`.
        back: (...) distances along the vehicles' paths [m].
    """
    s = cars["s"] - back
    path = cars["path"]
    column = np.full(cars.shape, CURRENT)

    def piece_in(column: np.ndarray) -> np.ndarray:
        return np.take_along_axis(path, column[..., None], -1)[..., 0]

    for _ in range(CURRENT):
        before = piece_in(np.maximum(column - 1, 0))
        is_before = (s < 0.0) & (column > 0) & (before >= 0)
        s = np.where(is_before, s + streets.pieces["length"][before], s)
        column -= is_before
    piece = piece_in(column)
    places = places_on(streets, piece, s)
    changing = (column == CURRENT) & (cars["left_lane"] >= 0)
    blended = _blended_with_left_lane(
        streets,
        cars[changing],
        piece[changing],
        s[changing],
        back[changing],
        [place[changing] for place in places],
    )
    for place, between in zip(places, blended, strict=True):
        place[changing] = between
    return places


def _blended_with_left_lane(
    streets: Streets,
    cars: np.ndarray,
    piece: np.ndarray,
    s: np.ndarray,
    back: np.ndarray,
    places: Sequence[np.ndarray],
) -> list[np.ndarray]:
    """Returns x, y, z of places between the former and the new lane [m].

    Args:
        streets: the lanes.
        cars: (M,) records of vehicles that change lanes.
        piece: (M,) number of each vehicle's new lane.
        s: (M,) distance of each place along the new lane [m].
        back: (M,) distance of each place behind the front bumper [m].
        places: x, y, z of the places on the new lane, each (M,) [m].
    """
    u = (s - cars["change_start"]) / cars["change_length"]
    u = np.minimum(np.maximum(u, 0.0), 1.0)
    # The quintic of `base.elementary.smooth_step`, but without powers, which
    # are slow and round in another way.
    share = u * u * u * (10.0 - 15.0 * u + 6.0 * (u * u))
    lengths = streets.pieces["length"]
    scale = lengths[cars["left_lane"]] / lengths[piece]
    there = cars["s"] * scale - back
    return [
        before + share * (place - before)
        for place, before in zip(
            places,
            places_on(streets, cars["left_lane"], there),
            strict=True,
        )
    ]


# At the start, a vehicle needs this length of lane in addition to its own [m].
_SPACE = 9.0
# At the start, a vehicle drives at this share of the allowed speed.
_PART_OF_SPEED = 0.5
# Greatest braking that a vehicle needs at the start [m/s^2].
_FIRST_BRAKING = 0.75
# Drivers' wanted speeds differ from those of their kind by up to this share.
_FACTOR_SPREAD = 0.1
# Least distance of a vehicle's ends from the ends of its lane at the start [m].
_FROM_ENDS = 1.0
# Number of random places that are tried for a vehicle.
_PLACE_TRIES = 200


def room_for_vehicles(graph: LaneGraph) -> int:
    """Returns the number of vehicles that can move in the lanes of a graph."""
    mean = sum(kind.share * kind.size[0] for kind in KINDS)
    mean /= sum(kind.share for kind in KINDS)
    return int(
        sum(graph.pieces[k].length // (mean + 2 * _SPACE) for k in graph.lanes)
    )


def place_vehicles(
    kinds: Sequence[VehicleKind], streets: Streets, rng: np.random.Generator
) -> tuple[np.ndarray, list[int]]:
    """Places vehicles in lanes at random, away from the ego car's first place.

    Args:
        kinds: kind of each vehicle.
        streets: arrays of all lanes, with the ego car.
        rng: the random generator.

    Returns:
        Records of dtype `VEHICLE` of the vehicles for which a place was found;
        and the index of each of these vehicles in `kinds`.
    """
    places = _draw_places(kinds, streets, rng)
    found = [place.number for place in places]
    cars = np.zeros(len(found), VEHICLE)
    for name in ("held", "left_lane", "path"):
        cars[name] = -1
    cars["since"], cars["change_length"] = np.inf, 1.0
    cars["path"][:, CURRENT] = [place.lane for place in places]
    cars["s"] = [place.s for place in places]
    for car, kind in zip(cars, (kinds[k] for k in found), strict=True):
        car["length"], car["large"] = kind.size[0], kind.is_large
        car["rear_axle"], car["front_axle"] = kind.axles
        car["top"], car["factor"] = kind.top_speed, kind.speed_factor
        car["a"], car["b"] = kind.acceleration, kind.deceleration
        car["headway"] = kind.headway
    cars["factor"] *= rng.uniform(
        1.0 - _FACTOR_SPREAD, 1.0 + _FACTOR_SPREAD, len(cars)
    )
    cars["v"] = _first_speeds(streets, cars)
    return cars, found


class _Place(NamedTuple):
    """Where a vehicle begins.

    Attributes:
        number: number of the vehicle.
        lane: number of the lane's piece.
        s: place of the front bumper on the lane [m].
    """

    number: int
    lane: int
    s: float


def _draw_places(
    kinds: Sequence[VehicleKind], streets: Streets, rng: np.random.Generator
) -> list[_Place]:
    """Returns the random places of vehicles; some may find none.

    For the arguments, see `place_vehicles`.
    """
    free = np.flatnonzero(~streets.pieces["is_way"])
    lengths = streets.pieces["length"]
    share = lengths[free] / lengths[free].sum()
    # Lane -> the spans in it that vehicles need [m].
    taken: dict[int, list[tuple[float, float]]] = {}
    places = []
    for number, kind in enumerate(kinds):
        for _ in range(_PLACE_TRIES):
            lane = int(rng.choice(free, p=share))
            low = kind.size[0] + _FROM_ENDS
            if lengths[lane] < low + _FROM_ENDS:
                continue
            s = float(rng.uniform(low, lengths[lane] - _FROM_ENDS))
            start, end = s - kind.size[0] - _SPACE / 2, s + _SPACE / 2
            if any(start < b and a < end for a, b in taken.get(lane, [])):
                continue
            if streets.until[0, lane] == 0.0 or not is_ego_far(
                streets, 0, lane, s
            ):
                continue
            taken.setdefault(lane, []).append((start, end))
            places.append(_Place(number, lane, s))
            break
    return places


def _first_speeds(streets: Streets, cars: np.ndarray) -> np.ndarray:
    """Returns the speeds (N,) at which vehicles begin [m/s].

    They can stop before the line, or behind the vehicle ahead.

    Args:
        streets: arrays of all lanes.
        cars: (N,) records of dtype `VEHICLE`, with all but the speed.
    """
    lanes = streets.pieces[cars["path"][:, CURRENT]]
    points = lanes["first"] + (cars["s"] / lanes["step"]).astype(int)
    allowed = streets.speed[points]
    v = _PART_OF_SPEED * np.minimum(cars["top"], cars["factor"] * allowed)
    left = np.minimum(lanes["length"] - cars["s"], _SPACE / 2)
    return np.minimum(v, np.sqrt(2.0 * _FIRST_BRAKING * left))
