"""RKO-LIO, as published, finds a drive on springs from LiDAR and IMU.

RKO-LIO reads the folder itself, with frames and extrinsics. Wrong axes, units,
stamps, gravity or positions of the sensors would lead it astray, and so would
an IMU whose motion is not the LiDAR's.
"""

import os
import subprocess

import numpy as np
import pytest

from cns_drake.recording import START_NS
from cns_drake.scenarios import RideConfig, load_scenario, plan_drive
from cns_drake.simulation import simulate
from evaluation.base import poses

# RKO-LIO requires other versions than users of this project get, so it has an
# environment of its own.
PROGRAM = os.environ.get("CNS_DRAKE_TEST_RKO_LIO")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.night,
    pytest.mark.skipif(not PROGRAM, reason="CNS_DRAKE_TEST_RKO_LIO is not set"),
]

# The first eight seconds of the drive, a start from rest.
SECONDS = 8


def test_rko_lio_finds_the_drive(tmp_path, capsys):
    base = load_scenario("metropolis_04").with_lidar("os1-128")
    lidar = base.lidars["lidar"].model_copy(
        update={"motion_distortion": True, "columns": 512, "rate": 10}
    )
    scenario = base.model_copy(
        update={
            "frames": 10 * SECONDS,
            "imu": base.imu.model_copy(update={"rate": 200}),
            "lidars": {"lidar": lidar},
            "ride": RideConfig(roughness="A"),
        }
    )
    folder = simulate(scenario, tmp_path / "recordings").folder
    command = [PROGRAM, folder, "-d", "rosbag"]
    command += ["--imu", "/imu/data", "--lidar", "/lidar/points"]
    command += ["--base_frame", "base_link", "--log"]
    command += ["-o", tmp_path / "found", "-n", "drive"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (table,) = (tmp_path / "found").rglob("*_tum.txt")
    rows = np.loadtxt(table)
    found = poses.make_pose(
        poses.rotation_from_quaternion(rows[:, 4:]), rows[:, 1:4]
    )

    # The car's true positions at RKO-LIO's times, the ends of scans.
    times = rows[:, 0] - START_NS * 1e-9
    exact = poses.make_pose(*plan_drive(scenario).poses(times))
    assert len(found) >= 10 * SECONDS - 2
    found, exact = (poses.inverse(X[0]) @ X for X in (found, exact))
    length = np.linalg.norm(exact[-1, :3, 3])
    assert length > 50.0
    errors = np.linalg.norm(found[:, :3, 3] - exact[:, :3, 3], axis=1)
    turn = exact[-1, :3, :3].T @ found[-1, :3, :3]
    angle_deg = np.degrees(np.arccos(min((np.trace(turn) - 1.0) / 2.0, 1.0)))
    with capsys.disabled():
        print(
            f"\nRKO-LIO: {errors[-1]:.2f} m and {angle_deg:.2f} deg off"
            f" after {length:.1f} m"
        )
    assert errors.max() < 0.01 * length
    assert angle_deg < 1.0
