"""The choice of a recording's LiDAR in commands."""

import json

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import assert_refused, make_block_scene, run
import pytest


@pytest.fixture(scope="module")
def roofs(tmp_path_factory):
    """Two drives whose only LiDAR is named roof."""
    folder = tmp_path_factory.mktemp("roofs")
    for stage, side in (("01", 0.0), ("02", 1.0)):
        scans = [make_block_scene(i) - [0.0, side, 0.0] for i in range(4)]
        write_recording(
            folder / f"town_{stage}",
            [make_scan(scan) for scan in scans],
            [yaw_pose(10.0 * i, side, 0.0, 0.0) for i in range(4)],
            lidar_topic="/roof/points",
        )
    return folder


@pytest.mark.parametrize("command", ["tcr", "pr"])
def test_pairs(capsys, roofs, command):
    both = [command, roofs / "town_01", roofs / "town_02"]
    both += ["--method", "solid"] if command == "pr" else []
    status, out, _ = run(capsys, *both, "--lidar", "roof", "--json")
    assert status == 0
    assert json.loads(out)
    assert_refused(
        capsys, [*both, "--lidar", "rear"], "/rear/points", "/roof/points"
    )
