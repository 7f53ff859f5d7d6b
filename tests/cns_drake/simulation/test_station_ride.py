"""A ride in a scenario: all sensors and wheels agree about one motion."""

from helpers.imu_integration import integrate_imu
from helpers.small_map import scenario_values
import numpy as np
import pytest

from cns_drake.scenarios import make_scenario
from cns_drake.sensors import sensor_pose
from cns_drake.simulation import SimulationSource, make_station


def rough(small_map, **lidar):
    values = scenario_values(small_map)
    values["ride"] = {"roughness": "C", "seed": 4}
    values["lidars"] = {"lidar": {"resolution": 0.0} | lidar}
    values["frames"] = 400
    return make_scenario(values, "test")


@pytest.fixture(scope="module")
def drive(small_map):
    return make_station(rough(small_map, columns=128))


def evaluate(diagram, context, time, *names):
    context.SetTime(time)
    return [diagram.GetOutputPort(name).Eval(context) for name in names]


def test_points_on_the_ground_lie_on_the_ground(small_map, drive):
    context = drive.CreateDefaultContext()
    X_BS = sensor_pose(rough(small_map).lidars["lidar"])
    heights, tilts = [], []
    for time in np.arange(2.0, 20.0, 1.5):
        scan, odometry = evaluate(
            drive, context, time, "lidar_scan", "odometry"
        )
        ground = scan[scan["instance"] == 1]
        assert len(ground) > 200
        p_SP = np.stack([ground[axis] for axis in "xyz"], dtype=float)
        p_WP = (odometry.X_WB @ X_BS).multiply(p_SP)
        np.testing.assert_allclose(p_WP[2], 0.0, atol=1e-3)
        heights.append(odometry.X_WB.translation()[2])
        tilts.append(odometry.X_WB.rotation().matrix()[2, 2])
    # The body does move on its springs.
    assert np.ptp(heights) > 0.01
    assert np.degrees(np.arccos(min(tilts))) > 0.5


def test_wheels_stay_on_the_ground(drive):
    context = drive.CreateDefaultContext()
    places = []
    for time in np.arange(2.0, 20.0, 1.5):
        (query,) = evaluate(drive, context, time, "geometry_query")
        inspector = query.inspector()
        wheels = [
            frame
            for frame in inspector.GetAllFrameIds()
            if inspector.GetName(frame).endswith("_wheel")
        ]
        assert len(wheels) == 4
        places += [query.GetPoseInWorld(f).translation()[2] for f in wheels]
    np.testing.assert_allclose(places, 0.33, atol=1e-3)


@pytest.mark.slow
def test_the_imu_integrates_to_the_odometry(small_map, drive):
    X_BI = sensor_pose(rough(small_map).imu)
    context = drive.CreateDefaultContext()
    period = 1 / 200
    names = ("specific_force", "angular_velocity", "odometry")
    samples = [
        evaluate(drive, context, time, *names)
        for time in np.arange(0.0, 6.0, period)
    ]
    force, rate, odometry = zip(*samples, strict=True)
    X_WIs = [one.X_WB @ X_BI for one in odometry]
    found = integrate_imu(force, rate, period, X_WIs[0])
    expected = np.array([X_WI.translation() for X_WI in X_WIs])
    assert np.linalg.norm(expected[-1] - expected[0]) > 30.0
    drift = np.linalg.norm(found - expected, axis=1)
    # The trapezoidal rule has an error that falls with the step.
    assert drift.max() < 0.001


@pytest.mark.night
@pytest.mark.slow
def test_motion_distortion_takes_each_column_from_its_own_pose(small_map):
    scenario = rough(small_map, columns=64, motion_distortion=True)
    drive = make_station(scenario)
    context = drive.CreateDefaultContext()
    X_BS = sensor_pose(scenario.lidars["lidar"])
    (scan,) = evaluate(drive, context, 9.0, "lidar_scan")
    ground = scan[scan["instance"] == 1]
    for t in np.unique(ground["t"]):
        column = ground[ground["t"] == t]
        (odometry,) = evaluate(drive, context, 9.0 + t * 1e-9, "odometry")
        p_SP = np.stack([column[axis] for axis in "xyz"], dtype=float)
        heights = (odometry.X_WB @ X_BS).multiply(p_SP)[2]
        np.testing.assert_allclose(heights, 0.0, atol=1e-3)
    # The drive simulated for the evaluation is the same.
    simulated = SimulationSource(scenario)()
    np.testing.assert_array_equal(simulated.scan(180), scan)
