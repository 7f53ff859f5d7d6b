"""Turning round: room, steering, faults; the oracle is the driven curve."""

from helpers.turning_roads import drive, driven, leg, network_of
import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
import pytest

from cns_drake.motion import Speeds, Trajectory, VehicleMotion, vehicle_file
from cns_drake.scenarios import load_scenario, plan_drive
from evaluation.base import InputError
from worlds.shapes import (
    POINT_SPACING,
    TIGHTEST_RADIUS,
    load_waypoint_path,
    make_waypoint_path,
)

# Radius of the loop in which the car turns round [m].
LOOP_RADIUS = 4.4


@pytest.mark.slow
def test_the_wheels_of_the_shipped_car_keep_to_their_limits(tmp_path):
    plant = MultibodyPlant(time_step=0.0)
    vehicle = Parser(plant).AddModels(str(vehicle_file()))[0]
    plant.Finalize()
    network = network_of(tmp_path)
    trajectory = drive(network, leg("in"), leg("up"), leg("up", "backward"))
    motion = VehicleMotion(plant, vehicle, trajectory)
    context = motion.CreateDefaultContext()
    angles = []
    for time in np.linspace(0, trajectory.duration, 1000):
        context.SetTime(time)
        q = motion.GetOutputPort("position").Eval(context)
        angles.append(q[steering_rows(plant)])
    limits = plant.GetPositionUpperLimits()[steering_rows(plant)]
    used = np.abs(angles).max() / limits[0]
    # The smoothed loop comes close to the limit, and keeps it.
    assert 0.97 < used <= 1.0


def steering_rows(plant):
    return [
        plant.GetJointByName(f"front_{side}_steering").position_start()
        for side in ("left", "right")
    ]


@pytest.mark.slow
def test_bends_are_driven_down_to_the_limit_of_steering(tmp_path):
    angle = np.linspace(0, 3 * np.pi, 300)
    refused, driven_ = [], []
    for radius in np.arange(4.2, 4.5, 0.02):
        circle = np.column_stack(
            [radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle]
        )
        np.savetxt(tmp_path / "d.csv", circle, delimiter=",")
        (tmp_path / "d.yaml").write_text(
            "{world: d.sdf, waypoints: d.csv, speeds: {cruise: 3}}"
        )
        (tmp_path / "d.sdf").write_text("<sdf version='1.9'/>")
        path = load_waypoint_path(tmp_path / "d.csv", POINT_SPACING)
        _, curvature = driven(Trajectory(path, Speeds()))
        tightest = 1 / np.abs(curvature).max()
        fault = None
        try:
            plan_drive(load_scenario(tmp_path / "d.yaml"))
        except InputError as error:
            fault = str(error)
        if fault is None:
            driven_.append(tightest)
            continue
        refused.append(tightest)
        assert f"a bend of {tightest:.2f} m radius at" in fault
        assert "waypoints farther apart" in fault
    assert TIGHTEST_RADIUS - 0.03 < max(refused) < TIGHTEST_RADIUS
    assert TIGHTEST_RADIUS < min(driven_) < TIGHTEST_RADIUS + 0.03


def test_it_turns_round_at_the_waypoint(tmp_path):
    network = network_of(tmp_path, lanes=[2, 2])
    places, _ = driven(drive(network, leg("in", end=50), leg("in", "backward")))
    # The loop's centre lies at 50 m, its far end 4.4 m on.
    first = network.roads["in"].first_station
    expected = first + 50 + LOOP_RADIUS
    assert places[:, 0].max() == pytest.approx(expected, abs=0.3)


@pytest.mark.parametrize("aside", [-1.0, 1.0])
def test_turning_round_aside_of_the_lanes(tmp_path, aside):
    network = network_of(tmp_path, lanes=[4, 4])
    legs = [leg("in", lane=2, end=50), leg("in", "backward", 2)]
    places, curvature = driven(drive(network, *legs, aside=aside))
    assert np.abs(curvature).max() <= 1 / TIGHTEST_RADIUS
    side = places[np.abs(places[:, 0] - 40).argmin(), 1]
    assert abs(side) == pytest.approx(5.25 + aside, abs=0.05)


def test_a_dead_end_has_room_from_its_radius_on(tmp_path):
    legs = [leg("down"), leg("down", "backward")]
    # A loop of 4.4 m: the front's corner is 6.58 m from its centre.
    corner = np.hypot(LOOP_RADIUS + 1.03, 3.72)
    for kerb_radius, fits in ((corner - 0.02, False), (corner + 0.2, True)):
        network = network_of(tmp_path, kerb_radius=float(kerb_radius))
        if fits:
            drive(network, *legs)
            continue
        with pytest.raises(InputError, match=r"disc 13\.2 m across.*13\.1"):
            drive(network, *legs)


@pytest.mark.parametrize(
    ("style", "legs", "fault"),
    [
        (
            {},
            [leg("in", end=50), leg("in", "backward")],
            r"route\.0 \(in forward\): no room for turning round: .* a disc "
            r"13\.2 m.* widest disc here has 7\.0 m; turn where .*wider",
        ),
        (
            {"lanes": [2, 2], "median": 2.0},
            [leg("in", end=50), leg("in", "backward")],
            r"route\.0 .*no room",
        ),
        (
            {"lanes": [2, 2]},
            [leg("in", start=40, end=45), leg("in", "backward")],
            r"route\.0 .*the road is too short for turning round",
        ),
        (
            {"lanes": [2, 2]},
            [leg("in", end=50), leg("in", "backward", start=3)],
            r"route\.1 .*start is allowed in the first leg only",
        ),
        (
            {"lanes": [2, 0]},
            [leg("up"), leg("up", "backward")],
            r"route\.0 .*has 0 lane\(s\) backward",
        ),
    ],
)
def test_faults_of_turning_round(tmp_path, style, legs, fault):
    with pytest.raises(InputError, match=r"d\.yaml: " + fault) as error:
        drive(network_of(tmp_path, **style), *legs)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("turn_deg", [-179, -155, 151, 170, 180])
def test_waypoints_that_double_back_are_loops(turn_deg):
    start = np.array([3.0, -2.0])
    heading = 0.4
    turn = np.radians(turn_deg)
    legs = [
        40.0 * np.array([np.cos(angle), np.sin(angle)])
        for angle in (heading, heading + turn)
    ]
    points = np.zeros((3, 3))
    points[:, :2] = np.cumsum([start, *legs], axis=0)
    points[1, 2] = 1.0
    path = make_waypoint_path(points, POINT_SPACING, u_turns=True)
    trajectory = Trajectory(path, Speeds())
    places, curvature = driven(trajectory)
    tightest = 1 / np.abs(curvature).max()
    assert TIGHTEST_RADIUS <= tightest < TIGHTEST_RADIUS + 0.1
    # The loop passes the waypoint, its farthest point.
    near = np.linalg.norm(places - points[1, :2], axis=1).min()
    assert near < 0.3
    yaw = trajectory.path.evaluate([0.0, trajectory.path.end]).yaw
    assert yaw[1] - yaw[0] == pytest.approx(turn, abs=1e-6)
    np.testing.assert_allclose(places[-1], points[2, :2], atol=1e-9)
    assert path.points[:, 2].max() == pytest.approx(1.0)


def test_doubling_back_needs_the_field_and_room():
    points = [(0, 0, 0), (30, 0, 0), (2, 0, 0)]
    with pytest.raises(InputError, match=r"1: turns by 180 .*u_turns: true"):
        make_waypoint_path(points, 2.0)
    # The loop and the bend before it: 4.4 m and sqrt(3) as much.
    needed = LOOP_RADIUS * (1 + np.sqrt(3))
    for length, fits in ((needed - 0.01, False), (needed + 0.01, True)):
        back = [(0, 0, 0), (length, 0, 0), (length - 30, 0, 0)]
        if fits:
            make_waypoint_path(back, 2.0, u_turns=True)
            continue
        with pytest.raises(InputError, match=r"1: .* needs 12\.02 m .* 12\.01"):
            make_waypoint_path(back, 2.0, u_turns=True)


def test_a_scenario_states_whether_it_turns_round(tmp_path):
    (tmp_path / "d.csv").write_text("0,0,0\n40,0,0\n5,0,0\n")
    (tmp_path / "d.sdf").write_text("<sdf version='1.9'/>")
    text = "{world: d.sdf, waypoints: d.csv, speeds: {}%s}"
    (tmp_path / "d.yaml").write_text(text % "")
    with pytest.raises(InputError, match=r"d\.csv: line 2: .*u_turns: true"):
        plan_drive(load_scenario(tmp_path / "d.yaml"))
    (tmp_path / "d.yaml").write_text(text % ", u_turns: true")
    assert plan_drive(load_scenario(tmp_path / "d.yaml")).length > 75
    route = "{map: riverside, stage: '01', route: [{road: a, direction: "
    (tmp_path / "r.yaml").write_text(
        route + "forward, lane: 1}], speeds: {}, u_turns: true}"
    )
    with pytest.raises(InputError, match=r"r\.yaml: u_turns: .*next leg"):
        load_scenario(tmp_path / "r.yaml")


def test_noise_of_waypoints_is_no_turn():
    """Waypoints every 1 cm with 1 cm of noise turn back again and again."""
    rng = np.random.default_rng(0)
    line = np.c_[np.arange(0.0, 20.0, 0.01), np.zeros((2000, 2))]
    noisy = line + rng.normal(0.0, 0.01, line.shape) * [1.0, 1.0, 0.0]
    with pytest.raises(InputError, match="less than 1 m apart") as refusal:
        make_waypoint_path(noisy, POINT_SPACING)
    assert "u_turns" not in str(refusal.value)
