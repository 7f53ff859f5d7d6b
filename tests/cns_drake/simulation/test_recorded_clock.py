"""Scan, pose and stamp of a recorded discrete LiDAR belong together."""

from helpers.bag_recordings import messages_by_topic
import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.sensors import (
    add_imu,
    add_lidar,
    add_odometry,
    make_flash_pattern,
)
from cns_drake.simulation import add_mcap_recorder
from evaluation.drives import McapDrive

# A step of the plant that is too early or too late is seen: the shortest is
# 5e-5 m, and a coordinate has 4e-6 m.
SPEED = 0.05
WALL = 40.0
AHEAD = make_flash_pattern(
    1, 1, (2.0, 2.0), min_range=0.1, max_range=90.0, period=0.05
)


def record(
    folder,
    time_step,
    seconds,
    *,
    imu_rate=200,
    rates=None,
    others=(),
    with_odometry=True,
    start=0.0,
    **options,
):
    """Records a cart that drives towards a wall at a constant speed."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.RegisterVisualGeometry(
        plant.world_body(),
        RigidTransform([WALL + 0.5, 0, 0]),
        Box(1, 9, 9),
        "wall",
        np.ones(4),
    )
    inertia = SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 1.0)
    cart = plant.AddRigidBody("cart", inertia)
    joint = plant.AddJoint(
        PrismaticJoint(
            "rail", plant.world_frame(), cart.body_frame(), [1, 0, 0]
        )
    )
    plant.Finalize()
    place = scene_graph, cart, RigidTransform(), AHEAD
    lidars = [add_lidar(builder, *place, **one) for one in (options, *others)]
    bag = add_mcap_recorder(
        builder,
        folder,
        lidars=lidars,
        odometry=add_odometry(builder, cart) if with_odometry else None,
        imu=add_imu(builder, cart, RigidTransform(), rate=imu_rate),
        rates=rates,
    )
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    own = plant.GetMyMutableContextFromRoot(context)
    joint.set_translation_rate(own, SPEED)
    context.SetTime(start)
    with bag:
        simulator.AdvanceTo(start + seconds)
    return McapDrive(folder) if with_odometry else None


def check(drive, rate, offset, seconds, delay=0.0, *, time_step):
    """Checks every frame; none is missing, and there is one a period.

    In a step, a plant is where it is at the step's end.
    """
    count = int((seconds - offset - delay) * rate + 1e-6) + 1
    expected = offset + np.arange(count) / rate
    times = drive.stamps_ns / 1e9
    np.testing.assert_allclose(times, expected, rtol=0, atol=1e-9)
    if time_step:
        times = np.ceil(times / time_step - 1e-6) * time_step
    x = drive.X_WS[:, 0, 3]
    np.testing.assert_allclose(x, SPEED * times, rtol=0, atol=1e-9)
    ahead = np.concatenate([drive.scan(k)["x"] for k in range(count)])
    np.testing.assert_allclose(ahead, WALL - x, rtol=0, atol=8e-6)


@pytest.mark.sampled(5)
@pytest.mark.slow
@pytest.mark.parametrize("rate", [5, 10, 20])
@pytest.mark.parametrize("imu_rate", [100, 200, 400])
@pytest.mark.parametrize("offset", [0.0, 0.03, 0.0125])
@pytest.mark.parametrize("time_step", [0.0, 0.001, 0.003, 0.007, 0.01])
def test_a_thousand_periods(tmp_path, rate, imu_rate, offset, time_step):
    seconds = 1000 / rate
    options = {"rate": rate, "capture_offset": offset}
    drive = record(
        tmp_path / "drive", time_step, seconds, imu_rate=imu_rate, **options
    )
    check(drive, rate, offset, seconds, time_step=time_step)
    assert len(drive.imu) == seconds * imu_rate + 1


@pytest.mark.parametrize("odometry_rate", [7, 100])
@pytest.mark.parametrize("delay", [0.0, 0.04])
def test_a_delay_and_odometry_at_a_rate_of_its_own(
    tmp_path, delay, odometry_rate
):
    drive = record(
        tmp_path / "drive",
        0.005,
        4.0,
        rate=10,
        capture_offset=0.07,
        output_delay=delay,
        rates={"odometry": odometry_rate},
    )
    check(drive, 10, 0.07, 4.0, delay, time_step=0.005)


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_poses_of_lidars_without_odometry(tmp_path, time_step):
    """Of the rates, some times are equal, and no power of two apart."""
    record(
        tmp_path / "drive",
        time_step,
        3.0,
        rate=10,
        others=[{"name": "slow", "rate": 10 / 3}, {"name": "free"}],
        with_odometry=False,
    )
    found = messages_by_topic(tmp_path / "drive")
    poses = {"lidar": {}, "slow": {}, "free": {}}
    for time_ns, message in found["/tf"]:
        for edge in message.transforms:
            x = edge.transform.translation.x
            poses[edge.child_frame_id][time_ns] = x
            at = time_ns / 1e9
            if time_step:
                at = np.ceil(at / time_step - 1e-6) * time_step
            assert x == pytest.approx(SPEED * at, abs=1e-9)
    for name, count in (("lidar", 31), ("slow", 11), ("free", 61)):
        stamps = [stamp_ns for stamp_ns, _ in found[f"/{name}/points"]]
        assert len(stamps) == count
        assert poses[name].keys() >= set(stamps)


def test_a_delayed_pose_needs_odometry(tmp_path):
    with pytest.raises(ValueError, match=r"^lidars: 'lidar' has an output_del"):
        record(
            tmp_path / "drive",
            0.01,
            1.0,
            rate=10,
            output_delay=0.02,
            with_odometry=False,
        )


@pytest.mark.parametrize("start", [0.0, 0.3, 5.0])
@pytest.mark.parametrize("delay", [0.0, 0.04])
def test_a_recording_begins_with_the_scan_of_the_start(tmp_path, start, delay):
    folder = tmp_path / "drive"
    drive = record(folder, 0.01, 0.25, start=start, rate=10, output_delay=delay)
    times = start + 0.1 * np.arange(3)
    np.testing.assert_allclose(drive.stamps_ns / 1e9, times, rtol=0, atol=1e-9)
    x = SPEED * (times - start)
    np.testing.assert_allclose(drive.X_WS[:, 0, 3], x, rtol=0, atol=1e-9)
    ahead = np.concatenate([drive.scan(k)["x"] for k in range(3)])
    np.testing.assert_allclose(ahead, WALL - x, rtol=0, atol=8e-6)
