"""Single scans of worlds, and their files."""

from helpers.small_map import box_visual, world_text
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.scene import load_world
from cns_drake.sensors import make_beam_pattern
from cns_drake.simulation import scan as take_scan
from cns_drake.simulation import scan_world
from evaluation.base import InputError

X_WS = RigidTransform(RollPitchYaw(0.05, -0.1, 2.0), [3.0, -2.0, 1.7])


@pytest.fixture
def world(tmp_path):
    path = tmp_path / "world.sdf"
    path.write_text(
        world_text(
            [
                box_visual("ground", (0, 0, -1, 0, 0, 0), (200, 200, 2)),
                box_visual("wall", (0, 21, 5, 0, 0, 0), (60, 2, 10)),
            ]
        )
    )
    return path


@pytest.fixture
def scan(world):
    return take_scan(world, X_WS)


def test_the_usual_lidar_is_exact(world, scan, tmp_path):
    pattern = make_beam_pattern("cns", 0.05)
    exact = scan_world(load_world(world), X_WS, pattern)
    np.testing.assert_array_equal(scan, exact)
    take_scan(world, X_WS, output=str(tmp_path / "scan.npy"))
    np.testing.assert_array_equal(
        np.load(tmp_path / "scan.npy"), expected(exact)
    )


def test_points_lie_on_the_world(scan):
    p_W = (X_WS @ np.stack([scan["x"], scan["y"], scan["z"]])).T
    on_ground = np.abs(p_W[:, 2]) < 1e-4
    on_wall = np.abs(p_W[:, 1] - 20.0) < 1e-4
    assert (on_ground | on_wall).all()
    assert on_ground.sum() > 5000
    assert on_wall.sum() > 2000


def expected(scan):
    return np.stack([scan[n] for n in ("x", "y", "z", "intensity")], axis=1)


def test_bin_is_kittis(world, scan, tmp_path):
    take_scan(world, X_WS, output=tmp_path / "new" / "scan.bin")
    read = np.fromfile(tmp_path / "new" / "scan.bin", "<f4").reshape(-1, 4)
    np.testing.assert_array_equal(read, expected(scan))


@pytest.mark.slow
def test_pcd_is_read_by_open3d(world, scan, tmp_path):
    import open3d

    take_scan(world, X_WS, output=tmp_path / "scan.pcd")
    cloud = open3d.t.io.read_point_cloud(str(tmp_path / "scan.pcd"))
    np.testing.assert_array_equal(
        cloud.point.positions.numpy(), expected(scan)[:, :3]
    )
    np.testing.assert_array_equal(
        cloud.point.intensity.numpy().ravel(), scan["intensity"]
    )


def test_empty_scans_can_be_saved(world, tmp_path):
    far = RigidTransform([0.0, 0.0, 5000.0])
    for ending in ("bin", "npy", "pcd"):
        take_scan(world, far, output=tmp_path / f"scan.{ending}")
    assert (tmp_path / "scan.bin").stat().st_size == 0
    assert np.load(tmp_path / "scan.npy").shape == (0, 4)


def test_unknown_ending(world, tmp_path):
    with pytest.raises(InputError, match=r"scan\.txt: unknown ending '.txt'"):
        take_scan(world, X_WS, output=tmp_path / "scan.txt")


def test_a_pose_that_is_not_finite(world):
    with pytest.raises(ValueError, match="X_WS: not finite"):
        take_scan(world, RigidTransform([0.0, np.nan, 1.0]))


def test_nothing_is_left_where_it_cannot_be_written(world, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file"):
        take_scan(world, X_WS, output=tmp_path / "file" / "scan.npy")
    assert [path.name for path in tmp_path.glob("*scan*")] == []
