"""Prescribed motion against the plant, finite differences and rolling."""

from helpers.drives import (
    CAREFUL,
    helix_points,
    lane_path,
    spatial_acceleration,
    spatial_velocity,
    wavy_points,
)
import numpy as np
from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
import pytest

from cns_drake.motion import Trajectory, VehicleMotion, vehicle_file

WHEELS = {
    f"{end}_{side}_wheel": (x, y)
    for end, x in (("front", 2.8), ("rear", 0.0))
    for side, y in (("left", 0.79), ("right", -0.79))
}
RADIUS = 0.33
POST = """<sdf version="1.9"><model name="post"><static>true</static>
<pose>3 4 5 0 0 0</pose><link name="link"/></model></sdf>"""
CART = """<sdf version="1.9"><model name="cart">
<link name="frame"/><link name="wheel"><pose>0.4 0.3 0.2 0 0 0</pose></link>
<joint name="axle" type="revolute"><parent>frame</parent><child>wheel</child>
<axis><xyz>{axis}</xyz></axis></joint></model></sdf>"""


def make_plant(*models):
    plant = MultibodyPlant(time_step=0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()
    for text in models:
        parser.AddModelsFromString(text, "sdf")
    vehicle = parser.AddModels(str(vehicle_file()))[0]
    plant.Finalize()
    return plant, vehicle


@pytest.fixture(scope="module")
def hilly():
    plant, vehicle = make_plant(POST)
    trajectory = Trajectory(lane_path(wavy_points(3)), CAREFUL)
    return plant, trajectory, VehicleMotion(plant, vehicle, trajectory)


def evaluate(motion, name, time):
    context = motion.CreateDefaultContext()
    context.SetTime(time)
    return motion.GetOutputPort(name).Eval(context)


def velocities(motion, time):
    values = evaluate(motion, "body_spatial_velocities", time)
    return np.array([value.get_coeffs() for value in values])


def test_the_ports_are_those_of_a_plant(hilly):
    plant, trajectory, motion = hilly
    time = 0.4 * trajectory.duration
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, evaluate(motion, "position", time))
    for name in (
        "body_poses",
        "body_spatial_velocities",
        "body_spatial_accelerations",
    ):
        found = evaluate(motion, name, time)
        assert len(found) == plant.num_bodies()
        model = plant.GetOutputPort(name).Allocate().get_value()
        assert type(found[0]) is type(model[0])
    poses = plant.get_body_poses_output_port().Eval(context)
    for X_WB, expected in zip(
        evaluate(motion, "body_poses", time), poses, strict=True
    ):
        assert X_WB.IsNearlyEqualTo(expected, 1e-12)


def test_the_base_follows_the_trajectory(hilly):
    plant, trajectory, motion = hilly
    base = plant.GetBodyByName("base_link").index()
    for time in (0.0, 7.3, trajectory.duration):
        X_WB = evaluate(motion, "body_poses", time)[base]
        assert X_WB.IsNearlyEqualTo(trajectory.pose(time), 1e-12)
        V_WB = evaluate(motion, "body_spatial_velocities", time)[base]
        expected = spatial_velocity(trajectory, time).get_coeffs()
        np.testing.assert_allclose(V_WB.get_coeffs(), expected, atol=1e-12)
        A_WB = evaluate(motion, "body_spatial_accelerations", time)[base]
        expected = spatial_acceleration(trajectory, time).get_coeffs()
        np.testing.assert_allclose(A_WB.get_coeffs(), expected, atol=1e-12)


def test_rates_of_all_bodies_are_derivatives(hilly):
    plant, trajectory, motion = hilly
    step = 1e-4
    for time in np.linspace(2.0, trajectory.duration - 2.0, 7):
        before, after = (
            evaluate(motion, "body_poses", time + k * step) for k in (-1, 1)
        )
        V = velocities(motion, time)
        for index in range(plant.num_bodies()):
            p = after[index].translation() - before[index].translation()
            np.testing.assert_allclose(V[index, 3:], p / (2 * step), atol=1e-5)
            turn = after[index].rotation() @ before[index].rotation().inverse()
            angle = turn.ToAngleAxis()
            w = angle.angle() * angle.axis() / (2 * step)
            np.testing.assert_allclose(V[index, :3], w, atol=1e-4)
        A = evaluate(motion, "body_spatial_accelerations", time)
        change = velocities(motion, time + step)
        change = (change - velocities(motion, time - step)) / (2 * step)
        found = np.array([value.get_coeffs() for value in A])
        # A wheel turns at up to 27 rad/s: its third derivatives are large.
        np.testing.assert_allclose(found, change, atol=1e-3)


def test_other_models_stay_where_they_are(hilly):
    plant, _, motion = hilly
    post = plant.GetBodyByName("link").index()
    X_WP = evaluate(motion, "body_poses", 9.0)[post]
    np.testing.assert_allclose(X_WP.translation(), [3, 4, 5])
    np.testing.assert_array_equal(velocities(motion, 9.0)[post], np.zeros(6))


def test_no_wheel_slips():
    plant, vehicle = make_plant()
    points = wavy_points(5) * [1, 1, 0]
    trajectory = Trajectory(lane_path(points), CAREFUL)
    motion = VehicleMotion(plant, vehicle, trajectory)
    for time in np.linspace(0.0, trajectory.duration, 25):
        V = velocities(motion, time)
        for name in WHEELS:
            V_WC = V[plant.GetBodyByName(name).index()]
            to_ground = np.array([0, 0, -RADIUS])
            slip = V_WC[3:] + np.cross(V_WC[:3], to_ground)
            np.testing.assert_allclose(slip, np.zeros(3), atol=1e-9)


def test_states_at_ticks_are_those_at_each_time(hilly):
    plant, trajectory, alone = hilly
    vehicle = plant.GetModelInstanceByName("vehicle")
    period = 0.05
    motion = VehicleMotion(plant, vehicle, trajectory, period=period)
    ticks = [0, 1, 63, 64, 200, 63, 1]
    times = [tick * period for tick in ticks]
    for time in [*times, np.nextafter(3.2, 0.0), np.nextafter(3.2, 4.0), 0.123]:
        for name in ("position", "body_spatial_velocities"):
            at_tick, expected = (
                evaluate(one, name, time) for one in (motion, alone)
            )
            if name != "position":
                at_tick, expected = (
                    [V.get_coeffs() for V in Vs] for Vs in (at_tick, expected)
                )
            np.testing.assert_array_equal(at_tick, expected)


def test_rear_wheels_roll_by_their_own_distance():
    plant, vehicle = make_plant()
    points = helix_points(30.0, 0.0, 100)
    trajectory = Trajectory(lane_path(points), CAREFUL)
    motion = VehicleMotion(plant, vehicle, trajectory)
    end = trajectory.duration
    X_start, X_end = trajectory.pose(0.0), trajectory.pose(end)
    turned = (X_start.rotation().inverse() @ X_end.rotation()).ToAngleAxis()
    # The bend is one whole turn and a part of the next.
    angle = 2 * np.pi + turned.angle() * np.sign(turned.axis()[2])
    for side, y in (("left", 0.79), ("right", -0.79)):
        joint = plant.GetJointByName(f"rear_{side}_rolling")
        q = evaluate(motion, "position", end)
        expected = (trajectory.length - y * angle) / RADIUS
        assert q[joint.position_start()] == pytest.approx(expected, abs=1e-6)
        q = evaluate(motion, "position", 0.0)
        assert q[joint.position_start()] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_an_axis_may_point_either_way(sign):
    plant = MultibodyPlant(time_step=0.0)
    text = CART.format(axis=f"0 {sign} 0")
    (cart,) = Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    straight = np.outer(2.0 * np.arange(40), [1.0, 0, 0])
    trajectory = Trajectory(lane_path(straight), CAREFUL)
    motion = VehicleMotion(plant, cart, trajectory)
    wheel = plant.GetBodyByName("wheel").index()
    time = trajectory.duration / 2
    speed = spatial_velocity(trajectory, time).translational()[0]
    expected = [0, speed / 0.2, 0, speed, 0, 0]
    np.testing.assert_allclose(
        velocities(motion, time)[wheel], expected, atol=1e-9
    )


def test_a_joint_that_is_no_wheel_is_refused():
    plant = MultibodyPlant(time_step=0.0)
    text = CART.format(axis="1 0 0")
    (cart,) = Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    trajectory = Trajectory(lane_path(helix_points(30, 0, 40)), CAREFUL)
    with pytest.raises(ValueError, match="joint axle neither turns about"):
        VehicleMotion(plant, cart, trajectory)


def test_time_may_go_back(hilly):
    _, _, motion = hilly
    context = motion.CreateDefaultContext()
    port = motion.GetOutputPort("position")
    first = []
    for time in (3.0, 11.0, 3.0, 11.0):
        context.SetTime(time)
        first.append(port.Eval(context).copy())
    np.testing.assert_array_equal(first[0], first[2])
    np.testing.assert_array_equal(first[1], first[3])
    assert np.abs(first[0] - first[1]).max() > 1.0


def test_the_vehicle_is_a_car():
    scene_graph = SceneGraph()
    plant = MultibodyPlant(time_step=0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.AddModels(str(vehicle_file()))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.ValidateContext(context)
    base = plant.GetFrameByName("base_link")
    for frame, p_BF in (("lidar", [0, 0, 1.6]), ("imu", [-1, 0, 1.6])):
        X_BF = plant.GetFrameByName(frame).CalcPose(context, base)
        np.testing.assert_allclose(X_BF.translation(), p_BF)
        assert X_BF.rotation().IsNearlyIdentity()
    for name, (x, y) in WHEELS.items():
        X_BC = plant.GetFrameByName(name).CalcPose(context, base)
        np.testing.assert_allclose(X_BC.translation(), [x, y, RADIUS])
    mass = plant.CalcTotalMass(context)
    assert 1200 < mass < 2200
    p_BM = plant.CalcCenterOfMassPositionInWorld(context)
    assert 0.8 < p_BM[0] < 2.0
    assert p_BM[1] == pytest.approx(0, abs=1e-9)
    inspector = scene_graph.model_inspector()
    seen = inspector.GetAllGeometryIds(Role.kPerception)
    assert len(seen) > 40
    assert not inspector.GetAllGeometryIds(Role.kProximity)
