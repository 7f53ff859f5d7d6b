"""Methods take rings and field of view from the LiDAR of a drive."""

from helpers import dataset_folders
from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import make_block_scene, run
import numpy as np
import pytest

from cns_drake.sensors import SpinningPattern, make_beam_pattern
from evaluation.drives import LidarField, lidar_field, open_drive
from evaluation.lidar_sheets import LIDAR_PRESETS
from evaluation.methods import make_method
from evaluation.recognition import describe_drive

POINTS = np.random.default_rng(2).uniform(-40.0, 40.0, (3000, 3))


def test_fields_are_those_of_the_presets():
    for name in LIDAR_PRESETS:
        field = lidar_field(name)
        pattern = make_beam_pattern(name)
        if (
            isinstance(pattern, SpinningPattern)
            and len(pattern.elevations_rad) > 1
        ):
            elevations_deg = np.rad2deg(pattern.elevations_rad)
            assert field.rings == len(elevations_deg)
            assert field.lowest_deg == pytest.approx(elevations_deg.min())
            assert field.highest_deg == pytest.approx(elevations_deg.max())
        elif hasattr(pattern, "elevations_deg"):
            assert (
                field.lowest_deg,
                field.highest_deg,
            ) == pattern.elevations_deg
        elif hasattr(pattern, "fov_deg"):
            height = pattern.fov_deg + pattern.height_deg
            assert field.highest_deg == pytest.approx(0.5 * height)
            assert field.lowest_deg == -field.highest_deg
        else:
            # A plane has no field of view up and down.
            assert field is None
    assert lidar_field("os9") is None
    assert lidar_field(["cns"]) is None
    assert lidar_field({"columns": 3}) is None
    assert lidar_field("cns", 10**9) is None
    assert lidar_field("cns", 48) == LidarField(48, -22.5, 22.5)
    assert lidar_field("hdl-32e-upside-down") == LidarField(32, -10.67, 30.67)


def descriptors(method):
    found = method.describe(POINTS)
    return found.ranges.tolist(), found.azimuths.tolist()


def test_solid_takes_the_field_of_the_lidar():
    method = make_method("solid", {})
    of_unit = method.for_lidar(LidarField(16, -15.0, 15.0))
    by_hand = make_method(
        "solid", {"elevations": 16, "lowest_deg": -15, "highest_deg": 15}
    )
    assert descriptors(of_unit) == descriptors(by_hand)
    assert descriptors(of_unit) != descriptors(method)
    # The user's own values win, each for itself.
    mixed = make_method("solid", {"elevations": 16}).for_lidar(
        LidarField(64, -15.0, 15.0)
    )
    assert descriptors(mixed) == descriptors(by_hand)
    # Shipped drives have the LiDAR that the defaults stand for.
    same = method.for_lidar(lidar_field("cns"))
    assert descriptors(same) == descriptors(method)
    assert descriptors(method.for_lidar(None)) == descriptors(method)


def test_other_methods_stay_as_they_are():
    method = make_method("scan-context++", {})
    assert method.for_lidar(LidarField(16, -15.0, 15.0)) is method
    assert method.assumption(None) is None


def record(folder, scenario):
    scans = [make_scan(make_block_scene(k)) for k in range(4)]
    return write_recording(
        folder,
        scans,
        [yaw_pose(10.0 * k, 0.0, 0.0, 0.0) for k in range(4)],
        attachments={"scenario.json": scenario} if scenario else None,
    )


def test_descriptions_of_a_drive(tmp_path):
    scenario = {"lidars": {"lidar": {"preset": "vlp-16"}}}
    drive = open_drive(record(tmp_path / "s", scenario))
    assert drive.lidar_field == LidarField(16, -15.0, 15.0)
    method = make_method("solid", {})
    (found,) = describe_drive(drive, [method], {"places"})
    cloud = np.stack([drive.scan(0)[axis] for axis in "xyz"], 1).astype(float)
    wanted = method.for_lidar(drive.lidar_field).describe_place(cloud)
    np.testing.assert_array_equal(
        found.places.descriptors[0].ranges, wanted.ranges
    )


@pytest.mark.parametrize(
    ("scenario", "settings", "is_told"),
    [
        (None, [], True),
        ({"lidars": {"lidar": {"preset": "os9"}}}, [], True),
        ({"lidars": {"lidar": {"preset": "cns"}}}, [], False),
        (
            None,
            ["elevations=16", "lowest_deg=-15", "highest_deg=15"],
            False,
        ),
    ],
)
def test_what_is_assumed_is_said(capsys, tmp_path, scenario, settings, is_told):
    record(tmp_path / "a", scenario)
    record(tmp_path / "b", scenario)
    arguments = ["pr", tmp_path / "a", tmp_path / "b", "--method", "solid"]
    for setting in settings:
        arguments += ["--set", setting]
    status, _, err = run(capsys, *arguments)
    assert status == 0
    assert err.count("taken for one of 32 beams") == is_told
    arguments[-2 * len(settings) - 1] = "btc"
    if not settings:
        assert "taken for" not in run(capsys, *arguments)[2]


def test_kitti_is_known_by_its_cameras(tmp_path):
    folder = tmp_path / "sequences" / "00"
    X = dataset_folders.make_poses(2)
    for k in range(2):
        dataset_folders.write_bytes(
            folder / f"velodyne/{k:06d}.bin",
            dataset_folders.xyzi(dataset_folders.make_points(50)),
        )
    (folder / "times.txt").write_text("0.0\n0.1\n")
    dataset_folders.write_matrices(folder / "poses.txt", None, X, " ")
    mount = "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n"
    for projection, unit in (("718.8", "hdl-64e"), ("1", None)):
        row = f"P0: {projection} 0 607 0 0 {projection} 185 0 0 0 1 0\n"
        (folder / "calib.txt").write_text(row + mount)
        assert open_drive(folder).lidar_field == lidar_field(unit)
    (folder / "calib.txt").write_text(mount)
    assert open_drive(folder).lidar_field is None
