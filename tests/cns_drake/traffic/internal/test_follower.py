"""The ego car among the vehicles: closed forms, and a whole drive."""

from functools import cache

import numpy as np
import pytest

from cns_drake.motion import KNOT_PERIOD, Trajectory
from cns_drake.roads import LanePath, Speeds
from cns_drake.scenarios import (
    DrivePlan,
    DriverConfig,
    TrafficConfig,
    count_frames,
    load_scenario,
)
from cns_drake.simulation import load_stage, plan_scenario_traffic
from cns_drake.traffic import CURRENT, VEHICLE, EgoBox, LaneGraph, Piece
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.follower import Follower, find_runs
from cns_drake.traffic.occupants import find_occupants
from cns_drake.traffic.streets import make_streets
from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP
from cns_drake.traffic.vehicle_records import begin_traffic, make_crossings

BOX = EgoBox(-1.05, 3.75, 1.03)
ANGLE = 0.6
AHEAD = np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0])


def line(first, last):
    """Returns points from one distance to another along a heading [m]."""
    s = np.arange(first, last + 0.1, 0.5)
    return (s[:, None] - 10.0) * AHEAD + [3.0, -4.0, 1.0]


class Street:
    """A lane of 300 m, a way of 30 m, a lane of 300 m, and a car on them."""

    def __init__(self):
        graph = LaneGraph(
            (
                Piece(line(0, 300), 14.0, False, (1,), junction=0),
                Piece(line(300, 330), 14.0, True, (2,), junction=0),
                Piece(line(330, 630), 14.0, False, (1,), junction=0),
            ),
        )
        path = LanePath(line(10, 620)[::4], 2.0, np.full(306, 14.0))
        self.trajectory = Trajectory(path, Speeds())
        self.follower = Follower(graph, self.trajectory, BOX, 0)
        far = np.tile((1e4, 0.0), (2, 1))
        streets = make_streets(graph, BOX, far, np.zeros(2))
        self.cars = np.zeros(2, VEHICLE)
        self.cars["path"], self.cars["held"] = -1, -1
        self.cars["left_lane"] = -1
        self.cars[1] = self.follower.record(streets)[0]
        crossings = make_crossings(graph)
        self.traffic = begin_traffic(streets, self.cars, crossings, 0)

    def put(self, s, v):
        """Puts the other vehicle, of 4 m, to a place of the first lane."""
        self.cars[0]["path"][CURRENT] = 0
        self.cars[0]["s"], self.cars[0]["v"] = s, v
        self.cars[0]["length"] = 4.0

    def step(self):
        find_occupants(self.traffic, 0)
        self.follower.step(self.traffic, len(self.follower.u) - 1)

    def drive(self):
        """Returns places at each step, until the car has arrived."""
        while not self.follower.arrived:
            self.step()
        for _ in range(20):
            self.step()
        return np.array(self.follower.u)


def test_keeps_the_equilibrium_gap():
    """Behind a leader at constant speed: (s0 + v T) / sqrt(1 - (v/v0)^4)."""
    street = Street()
    s, v = 35.0, 5.0
    while s < 290.0:
        street.put(s, v)
        street.step()
        s += v * STEP
    ego = street.cars[1]
    ratio = v / float(ego["top"])
    expected = (STANDSTILL_GAP + v * ego["headway"]) / np.sqrt(1 - ratio**4)
    assert s - 4.0 - ego["s"] == pytest.approx(expected, rel=0.02)
    assert ego["v"] == pytest.approx(v, rel=0.01)


def test_stops_before_the_line_until_it_may_go():
    street = Street()
    for _ in range(900):
        street.step()
    assert street.cars[1]["v"] == pytest.approx(0.0, abs=0.05)
    assert 298.0 < street.cars[1]["s"] < 300.0
    assert street.cars[1]["path"][CURRENT + 1] == 1
    street.cars[1]["granted"], street.cars[1]["held"] = True, 1
    street.drive()
    # It has left its way.
    assert street.cars[1]["held"] == -1
    assert not street.cars[1]["granted"]


def test_alone_it_drives_as_it_may():
    """Its drive starts and ends at rest, within the plain one's bounds."""
    street = Street()
    street.cars[1]["granted"], street.cars[1]["held"] = True, 1
    street.drive()
    plain = street.trajectory
    positions = street.follower.positions()
    drive = plain.with_positions(positions)
    assert plain.duration <= drive.duration < 1.15 * plain.duration
    u, rate, change = drive.path_parameter(np.arange(0, drive.duration, 0.01))
    assert u[0] == pytest.approx(0.0, abs=1e-12)
    assert positions[-1] == drive.path.end
    assert rate[0] == pytest.approx(0.0, abs=1e-9)
    assert rate.max() <= Speeds().cruise
    assert np.abs(change).max() <= Speeds().longitudinal_acceleration
    # An acceleration changes within two knots.
    jerk = np.abs(np.diff(change)).max() / 0.01
    assert jerk < 2 * Speeds().longitudinal_acceleration / KNOT_PERIOD


@cache
def followed(follows=True, vehicles=40, walkers=10):
    scenario = load_scenario("riverside_01")
    # The first two legs, on which it stops for others.
    route = scenario.route.model_copy(update={"root": scenario.route.root[:2]})
    scenario = scenario.model_copy(
        update={
            "route": route,
            "traffic": TrafficConfig(vehicles=vehicles, walkers=walkers),
            "driver": DriverConfig(follows=follows),
        }
    )
    drive = DrivePlan(scenario)
    trajectory = drive.trajectory
    world = load_stage(drive, with_vehicle=False) if walkers else None
    plan = plan_scenario_traffic(scenario, trajectory, world)
    return scenario, trajectory, world, plan


@pytest.mark.night
@pytest.mark.slow
def test_a_drive_among_others():
    scenario, plain, world, plan = followed()
    drive = DrivePlan(scenario).trajectory_at(plan.positions)
    times = np.arange(0.0, drive.duration, 0.05)
    speed = np.linalg.norm(drive.path_motion(times).v, axis=1)
    assert (speed < 0.5).mean() > 0.03
    assert drive.length == plain.length
    assert count_frames(scenario, drive) > count_frames(scenario, plain)
    bound = scenario.speeds.longitudinal_acceleration
    assert np.abs(drive.path_parameter(times)[2]).max() < 1.1 * bound
    again = plan_scenario_traffic(scenario, drive, world)
    np.testing.assert_array_equal(again.positions, plan.positions)
    np.testing.assert_array_equal(again.vehicles.values, plan.vehicles.values)
    # Nobody meets the car.
    R, p = drive.poses(times)
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    middle = BOX.middles(p[:, :2], yaw)[:, :2]
    xy = plan.vehicles.at(times)[0][..., :2]
    nearest = np.linalg.norm(xy - middle[:, None], axis=2).min()
    assert 1.8 < nearest < 15.0


def test_without_it_the_drive_stays_as_it_is():
    *_, plan = followed(False, vehicles=1, walkers=0)
    assert plan.positions is None


def test_changes_to_the_lane_of_its_way_in_time():
    """The car leaves its lane at the stop line alone, for a way beside it."""
    aside = 3.5 * np.array([-AHEAD[1], AHEAD[0], 0.0])
    graph = LaneGraph(
        (
            Piece(line(0, 100), 14.0, False, (2,), junction=0, left=1),
            Piece(line(0, 100) + aside, 14.0, False, (3,), junction=0, right=0),
            Piece(line(100, 130), 14.0, True, (4,), junction=0),
            Piece(line(100, 130) + aside, 14.0, True, (5,), junction=0),
            Piece(line(130, 200), 14.0, False, (2,), junction=0),
            Piece(line(130, 200) + aside, 14.0, False, (3,), junction=0),
        ),
    )
    share = np.clip((100.0 - np.arange(0.0, 180.0)) / 4.0 + 0.5, 0.0, 1.0)
    points = line(0, 179)[::2] + share[:, None] * aside
    runs = find_runs(graph, points[:, :2])
    assert [run.piece for run in runs] == [1, 0, 2, 4]
    lane = runs[1]
    assert lane.last == pytest.approx(100.0, abs=1e-6)
    assert lane.last - lane.first == pytest.approx(25.0)
    assert lane.first - lane.s == pytest.approx(0.0, abs=1e-6)
    assert runs[0].last == lane.first
    # It is still beside where it leaves the other lane.
    assert lane.beside == 1
    assert lane.parts == pytest.approx(110.0, abs=3.0)
    assert {run.beside for run in runs if run is not lane} == {-1}


def test_leaves_the_lanes_where_it_drives_away_from_them():
    """30 deg aside after 50 m: it is on no lane from 2 m beside it on."""
    graph = LaneGraph((Piece(line(0, 100), 14.0, False, (0,), junction=0),))
    s = np.arange(0.0, 40.0)[:, None]
    turned = np.pi / 6 + ANGLE
    away = np.array([np.cos(turned), np.sin(turned)])
    points = np.concatenate(
        [line(0, 49)[::2, :2], line(50, 50)[0, :2] + s * away]
    )
    lane, outside = find_runs(graph, points)
    assert (lane.piece, lane.first, lane.s) == (0, 0.0, pytest.approx(0.0))
    assert outside.piece == -1
    # A place is on the lane while its square distance is at most 4 m^2.
    assert lane.last == outside.first == 55.0
    assert outside.last == len(points)
    (alone,) = find_runs(graph, points[60:])
    assert (alone.piece, alone.beside) == (-1, -1)


@pytest.mark.parametrize(("aside", "is_on"), [(1.95, True), (2.05, False)])
def test_goes_on_along_many_pieces(aside, is_on):
    """That costs nothing, however short they are."""
    pieces = [
        Piece(line(2 * k, 2 * k + 2), 14.0, k % 2 == 1, (k + 1,), junction=0)
        for k in range(30)
    ]
    pieces[-1] = Piece(pieces[-1].points, 14.0, True, (0,), junction=0)
    points = line(0, 60)[::2, :2] + aside * np.array([-AHEAD[1], AHEAD[0]])
    runs = find_runs(LaneGraph(tuple(pieces)), points)
    assert [run.piece for run in runs] == ([*range(30)] if is_on else [-1])
    for run in runs[1:]:
        assert run.first == pytest.approx(2.0 * run.piece, abs=1e-6)
        assert run.s == 0.0
