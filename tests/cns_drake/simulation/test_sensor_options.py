"""Noise, losses and motion distortion of LiDARs on a driving vehicle."""

from helpers.drives import spatial_velocity
from helpers.internal.link_budgets import reach_of
from helpers.small_map import scenario_values
import numpy as np
from pydrake.math import RigidTransform
import pytest
from scipy.special import lambertw

from cns_drake.recording import FRAME_PERIOD
from cns_drake.scenarios import DrivePlan, make_scenario, plan_drive
from cns_drake.sensors import WeatherConfig, make_pattern, sensor_pose
from cns_drake.simulation import load_drive, make_station, simulate
from evaluation.drives import deskew, open_drive
from evaluation.lidar_sheets import LIDAR_PRESETS
from worlds.shapes import CLASS_IDS

# A tilted sensor off the vehicle's middle, so that no transform is trivial.
MOUNT = {"xyz": [1.2, -0.4, 1.7], "rpy_deg": [3.0, -2.0, 40.0]}
# In the first bend, at about 30 km/h: see `test_the_vehicle_is_turning`.
BEND_FRAME = 590


def scenario_of(small_map, **lidars):
    values = scenario_values(small_map)
    configs = {name: MOUNT | options for name, options in lidars.items()}
    return make_scenario(values | {"lidars": configs, "seed": 11}, "test")


def scans_at(scenario, frame):
    """Returns LiDAR name -> scan at a frame of a fresh Diagram."""
    diagram = make_station(scenario)
    context = diagram.CreateDefaultContext()
    context.SetTime(frame * FRAME_PERIOD)
    return {
        name: diagram.GetOutputPort(f"{name}_scan").Eval(context)
        for name in scenario.lidars
    }


def positions(scan):
    return np.stack([scan[axis] for axis in "xyz"], axis=1).astype(float)


def to_world(scan, trajectory, X_BS, time):
    """Returns points in the world, each by the pose at its own time."""
    t_ns, column = np.unique(scan["t"], return_inverse=True)
    X_WS = [trajectory.pose(time + t * 1e-9) @ X_BS for t in t_ns]
    R = np.array([X.rotation().matrix() for X in X_WS])
    p = np.array([X.translation() for X in X_WS])
    p_S = positions(scan)
    return np.einsum("nij,nj->ni", R[column], p_S) + p[column]


def distance_to_geometry(scenario, p_W):
    """Returns the distances of points from the small map's nearest box."""
    world = load_drive(DrivePlan(scenario)).world
    inspector = world.scene_graph.model_inspector()
    nearest = np.full(len(p_W), np.inf)
    for geometry in inspector.GetAllGeometryIds():
        name = inspector.GetName(geometry)
        if not name.startswith("city::"):
            continue
        half = inspector.GetShape(geometry).size() / 2.0
        X_FG = inspector.GetPoseInFrame(geometry)
        p_G = (X_FG.inverse() @ p_W.T).T
        outside = np.abs(p_G) - half
        signed = np.linalg.norm(np.maximum(outside, 0.0), axis=1)
        signed += np.minimum(outside.max(axis=1), 0.0)
        nearest = np.minimum(nearest, np.abs(signed))
    return nearest


@pytest.fixture(scope="module")
def bend(small_map):
    """A swept scan in a bend: its scenario, trajectory and points."""
    scenario = scenario_of(small_map, lidar={"motion_distortion": True})
    scan = scans_at(scenario, BEND_FRAME)["lidar"]
    return scenario, plan_drive(scenario), scan


def test_the_vehicle_is_turning(bend):
    _, trajectory, _ = bend
    V_WB = spatial_velocity(trajectory, BEND_FRAME * FRAME_PERIOD)
    assert np.linalg.norm(V_WB.translational()) > 4.0
    assert abs(V_WB.rotational()[2]) > 0.2


def test_deskewed_points_lie_on_the_geometry(bend):
    """Each point has the pose at its own time; that at the stamp is wrong."""
    scenario, trajectory, scan = bend
    X_BS = sensor_pose(scenario.lidars["lidar"])
    time = BEND_FRAME * FRAME_PERIOD
    # Half a step of rounding along each axis, and the error of float32.
    rounding = np.sqrt(3.0) * 2.0**-11 + 1e-4
    p_W = to_world(scan, trajectory, X_BS, time)
    assert distance_to_geometry(scenario, p_W).max() < rounding
    at_stamp = (trajectory.pose(time) @ X_BS) @ positions(scan).T
    assert distance_to_geometry(scenario, at_stamp.T).max() > 0.2


def test_every_column_has_its_true_time(bend):
    scenario, _, scan = bend
    pattern = make_pattern(scenario.lidars["lidar"])
    azimuth = np.arctan2(scan["y"], scan["x"]).astype(float)
    # The turn starts at the rear and goes clockwise.
    turned = np.mod(np.pi - azimuth, 2.0 * np.pi)
    expected = turned / (2.0 * np.pi) * FRAME_PERIOD * 1e9
    column_ns = FRAME_PERIOD * 1e9 / pattern.num_columns
    late = scan["t"] - expected
    late -= np.rint(late / (FRAME_PERIOD * 1e9)) * FRAME_PERIOD * 1e9
    # The points are so far away that rounding hardly turns the beam.
    far = np.hypot(scan["x"], scan["y"]) > 5.0
    assert np.abs(late[far]).max() < 0.1 * column_ns
    assert len(np.unique(scan["t"])) > 1000


def test_the_first_column_is_that_of_a_deskewed_scan(small_map, bend):
    """Both scans cast this column from the pose at the stamp."""
    _, _, swept = bend
    still = scans_at(scenario_of(small_map, lidar={}), BEND_FRAME)["lidar"]
    first = [positions(scan[scan["t"] == 0]) for scan in (swept, still)]
    assert len(first[0]) > 5
    np.testing.assert_allclose(*first, atol=2.0**-9)


def test_at_rest_nothing_is_distorted(small_map):
    """The drive starts at rest and hardly moves within a turn."""
    swept = scenario_of(small_map, lidar={"motion_distortion": True})
    still = scenario_of(small_map, lidar={})
    first, second = (scans_at(s, 0)["lidar"] for s in (swept, still))
    assert len(first) == len(second)
    assert np.abs(positions(first) - positions(second)).max() < 0.01


def test_lidars_of_one_vehicle_each_measure_in_their_own_way(small_map):
    scans = scans_at(
        scenario_of(
            small_map,
            plain={},
            noisy={"range_noise": 0.05, "resolution": 0.0},
            noisy_too={"range_noise": 0.05, "resolution": 0.0},
            lossy={"dropout": 0.25},
            swept={"motion_distortion": True, "preset": "vlp-16"},
        ),
        BEND_FRAME,
    )
    alone = scans_at(scenario_of(small_map, plain={}), BEND_FRAME)
    np.testing.assert_array_equal(scans["plain"], alone["plain"])
    errors = []
    for name in ("noisy", "noisy_too"):
        _, a, b = np.intersect1d(
            beams(scans[name]), beams(scans["plain"]), return_indices=True
        )
        p, exact = positions(scans[name])[a], positions(scans["plain"])[b]
        distance = np.linalg.norm(exact, axis=1)
        along = np.einsum("ij,ij->i", p - exact, exact) / distance
        across = np.linalg.norm(np.cross(p, exact), axis=1) / distance
        assert abs(along.std() / 0.05 - 1.0) < 0.05
        assert across.max() < 2e-3  # The rounding of `plain`.
        errors.append(along[:20_000])
    length = min(map(len, errors))
    correlation = np.corrcoef(errors[0][:length], errors[1][:length])[0, 1]
    assert abs(correlation) < 0.05
    share = len(scans["lossy"]) / len(scans["plain"])
    assert abs(share - 0.75) < 0.02
    assert set(beams(scans["lossy"])) < set(beams(scans["plain"]))
    assert scans["swept"]["ring"].max() == 15


def beams(scan):
    return scan["t"].astype(np.int64) * 128 + scan["ring"]


def test_noise_does_not_depend_on_where_a_run_begins(small_map):
    """Frame 5 is the same after frames 0 to 4 as on its own."""
    scenario = scenario_of(
        small_map, lidar={"range_noise": 0.02, "dropout": 0.1}
    )
    diagram = make_station(scenario)
    context = diagram.CreateDefaultContext()
    port = diagram.GetOutputPort("lidar_scan")
    scans = []
    for frame in range(6):
        context.SetTime(frame * FRAME_PERIOD)
        scans.append(port.Eval(context).copy())
    alone = scans_at(scenario, 5)["lidar"]
    np.testing.assert_array_equal(scans[5], alone)
    common = min(len(scans[0]), len(scans[1]))
    assert (scans[0][:common] != scans[1][:common]).any()


def test_noise_of_standing_vehicle_changes_from_frame_to_frame(small_map):
    """The cached scan is not reused for the next frame."""
    scenario = scenario_of(small_map, lidar={"range_noise": 0.02})
    diagram = make_station(scenario)
    end = plan_drive(scenario).duration
    context = diagram.CreateDefaultContext()
    port = diagram.GetOutputPort("lidar_scan")
    scans = []
    for wait in (1.0, 1.05):
        context.SetTime(end + wait)
        scans.append(positions(port.Eval(context)))
    common = min(map(len, scans))
    assert common > 10_000
    assert np.abs(scans[0][:common] - scans[1][:common]).max() > 0.01


@pytest.fixture(scope="module")
def swept_recording(small_map, tmp_path_factory):
    """Folder of a recording of the first bend with a moving LiDAR."""
    values = scenario_values(small_map) | {"frames": 130}
    values["lidars"] = {
        "lidar": MOUNT | {"motion_distortion": True, "columns": 128},
        "rear": {"preset": "vlp-16", "columns": 16, "range_noise": 0.1},
    }
    output = tmp_path_factory.mktemp("swept")
    scenario = make_scenario(values, "test")
    return scenario, simulate(scenario, output).folder


@pytest.mark.parametrize("frame", [0, 60, 128, 129])
def test_recorded_poses_deskew(swept_recording, frame):
    """`deskew` finds the poses of the trajectory."""
    scenario, folder = swept_recording
    drive = open_drive(folder)
    trajectory = plan_drive(scenario)
    X_BS = sensor_pose(scenario.lidars["lidar"])
    time = frame * FRAME_PERIOD
    X_WS = trajectory.pose(time) @ X_BS
    p_W = to_world(drive.scan(frame), trajectory, X_BS, time)
    found = deskew(drive, frame)
    error = np.linalg.norm(
        positions(found) - (X_WS.inverse() @ p_W.T).T, axis=1
    )
    # The last turn is extrapolated.
    assert error.max() < (5e-4 if frame < 129 else 5e-3)
    for field in ("t", "ring", "intensity"):
        np.testing.assert_array_equal(found[field], drive.scan(frame)[field])
    moved = np.abs(positions(found) - positions(drive.scan(frame))).max()
    assert frame == 0 or moved > 0.05


def test_files_state_their_distortion(swept_recording, short_recording):
    (note,) = open_drive(swept_recording[1]).notes
    assert "taken while the LiDAR moved" in note
    assert open_drive(short_recording).notes == ()


def test_swept_pose_is_where_the_vehicle_is(small_map):
    """The poses of a sweep, one by one, against the trajectory's."""
    trajectory = plan_drive(scenario_of(small_map, lidar={}))
    times = np.linspace(0.0, trajectory.duration + 1.0, 50)
    R, p = trajectory.poses(times)
    for k, time in enumerate(times):
        X_WB = trajectory.pose(time)
        found = RigidTransform(np.vstack([np.c_[R[k], p[k]], [0, 0, 0, 1]]))
        assert found.IsNearlyEqualTo(X_WB, 1e-12)


def test_all_lidars_feel_the_same_weather(small_map):
    """Fog limits the range of both LiDARs."""
    units = {
        "front": {"preset": "vlp-16", "columns": 128},
        "back": {"preset": "os1-32", "columns": 128},
    }
    scenario = scenario_of(small_map, **units)
    visibility = 20.0
    clear, foggy = (
        scans_at(scenario.with_returns("calibrated", weather), BEND_FRAME)
        for weather in (None, WeatherConfig(visibility=visibility))
    )
    scattered = CLASS_IDS["outlier"]
    alpha = np.log(20.0) / visibility
    for name, unit in units.items():
        reach = reach_of(LIDAR_PRESETS[unit["preset"]].returns)
        farthest = lambertw(alpha * reach).real / alpha
        r_clear, r_foggy = (
            np.linalg.norm(positions(scans[name]), axis=1)
            for scans in (clear, foggy)
        )
        assert r_clear.max() > farthest > r_foggy.max() > 5.0
        assert not np.any(clear[name]["label"] == scattered)
        assert np.any(foggy[name]["label"] == scattered)
