"""The wired Diagram: names, ports, and agreement of its sensors."""

from helpers.small_map import scenario_values
import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from cns_drake.pictures import MeshcatRecorder
from cns_drake.recording import FRAME_PERIOD
from cns_drake.scenarios import DrivePlan, make_scenario
from cns_drake.sensors import sensor_pose
from cns_drake.simulation import load_drive, make_station

GRAVITY_W = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def scenario(small_map):
    values = scenario_values(small_map)
    # Few beams suffice, because this module hardly tests points.
    values["lidars"] = {"lidar": {"columns": 4}}
    return make_scenario(values, "test")


def test_systems_and_ports_have_their_names(scenario):
    diagram = make_station(scenario)
    names = {system.get_name() for system in diagram.GetSystems()}
    assert names == {
        "scene_graph",
        "vehicle_motion",
        "geometry_pose",
        "frame_poses",
        "lidar",
        "imu_accelerometer",
        "imu_gyroscope",
        "odometry",
    }
    ports = {
        diagram.get_output_port(k).get_name()
        for k in range(diagram.num_output_ports())
    }
    assert ports == {
        "geometry_query",
        "lidar_scan",
        "specific_force",
        "angular_velocity",
        "odometry",
    }


def test_several_lidars_share_a_vehicle(small_map):
    values = scenario_values(small_map)
    values["lidars"] = {
        "front": {"preset": "vlp-16", "xyz": [2.0, 0.0, 1.2]},
        "rear": {"columns": 8, "rpy_deg": [0.0, 0.0, 180.0]},
    }
    diagram = make_station(make_scenario(values, "test"))
    context = diagram.CreateDefaultContext()
    front = diagram.GetOutputPort("front_scan").Eval(context)
    rear = diagram.GetOutputPort("rear_scan").Eval(context)
    assert front["ring"].max() == 15
    assert len(np.unique(rear["t"])) <= 8
    assert len(front) > len(rear) > 0


def test_vehicle_is_invisible_and_on_the_ground(small_map):
    """At rest on the plate every downward beam meets the plate."""
    diagram = make_station(make_scenario(scenario_values(small_map), "test"))
    context = diagram.CreateDefaultContext()
    scan = diagram.GetOutputPort("lidar_scan").Eval(context)
    lowest = scan[scan["ring"] == 31]
    assert len(lowest) == 1024
    # Coordinates are multiples of 1 / 1024 m.
    np.testing.assert_array_equal(lowest["z"], -1638 / 1024)
    assert set(lowest["instance"]) == {1}


def test_a_page_has_the_poses_of_the_scene_graph(scenario):
    drive = load_drive(DrivePlan(scenario))
    page = MeshcatRecorder(
        drive.world, X_BSs={"lidar": RigidTransform()}, period=FRAME_PERIOD
    )
    simulator = Simulator(make_station(drive, page=page))
    simulator.AdvanceTo(8 * FRAME_PERIOD)
    query = simulator.get_system().GetOutputPort("geometry_query")
    query_object = query.Eval(simulator.get_context())
    # The body and its wheels, which turn.
    assert len(page.drive.X_WFs) > 1
    for frame, X_WFs in page.drive.X_WFs.items():
        assert len(X_WFs) == 9
        np.testing.assert_allclose(
            X_WFs[-1].GetAsMatrix4(),
            query_object.GetPoseInWorld(frame).GetAsMatrix4(),
            rtol=0.0,
            atol=1e-12,
        )


@pytest.mark.slow
def test_imu_adds_up_to_the_trajectory(scenario):
    """The IMU, integrated twice, gives the positions of the odometry.

    The only information is the IMU at 20 Hz and the first odometry. Between
    samples the signals are interpolated by cubic splines, since integrating
    20 Hz samples as steps would measure the integrator and not the IMU.
    """
    diagram = make_station(scenario)
    simulator = Simulator(diagram)
    samples = []

    def sample(context):
        time = context.get_time()
        frame = round(time / FRAME_PERIOD)
        if frame < len(samples):
            return
        odometry = diagram.GetOutputPort("odometry").Eval(context)
        samples.append(
            (
                time,
                diagram.GetOutputPort("specific_force").Eval(context),
                diagram.GetOutputPort("angular_velocity").Eval(context),
                odometry.X_WB,
                odometry.V_WB_B,
            )
        )

    simulator.Initialize()
    duration = 40.0
    sample(simulator.get_context())
    for frame in range(1, round(duration / FRAME_PERIOD) + 1):
        simulator.AdvanceTo(frame * FRAME_PERIOD)
        sample(simulator.get_context())
    times = np.array([s[0] for s in samples])
    assert len(times) == round(duration / FRAME_PERIOD) + 1

    X_BI = sensor_pose(scenario.imu)
    X_WI = [s[3] @ X_BI for s in samples]
    p_WI_expected = np.array([X.translation() for X in X_WI])
    start = samples[0]
    w_WB_W = start[3].rotation() @ start[4].rotational()
    v_WB = start[3].rotation() @ start[4].translational()
    p_BI_W = start[3].rotation() @ X_BI.translation()
    p = _integrate(
        times,
        np.array([s[1] for s in samples]),
        np.array([s[2] for s in samples]),
        Rotation.from_matrix(X_WI[0].rotation().matrix()),
        p_WI_expected[0],
        v_WB + np.cross(w_WB_W, p_BI_W),
    )
    drift = np.linalg.norm(p - p_WI_expected, axis=1)
    way = np.linalg.norm(np.diff(p_WI_expected, axis=0), axis=1).sum()
    assert way > 300.0
    assert drift.max() < 0.05


def _integrate(times, force, rate, R_WI, p, v, substeps=10):
    """Integrates an IMU, midpoint rule on splines of its samples."""
    fine = np.linspace(times[0], times[-1], (len(times) - 1) * substeps + 1)
    step = fine[1] - fine[0]
    middle = (fine[:-1] + fine[1:]) / 2.0
    turns = Rotation.from_rotvec(CubicSpline(times, rate)(middle) * step)
    halves = Rotation.from_rotvec(CubicSpline(times, rate)(middle) * step / 2)
    forces = CubicSpline(times, force)(middle)
    positions = [p]
    for k in range(len(middle)):
        a = (R_WI * halves[k]).apply(forces[k]) + GRAVITY_W
        p = p + v * step + a * step**2 / 2.0
        v = v + a * step
        R_WI = R_WI * turns[k]
        if (k + 1) % substeps == 0:
            positions.append(p)
    return np.array(positions)
