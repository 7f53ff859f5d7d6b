"""What an export does to scans: their motion, their unit, their number."""

from helpers.drive_files import T0_NS, make_scan, write_recording, yaw_pose
import numpy as np
import pytest

from cns_drake.export import export_drive
from evaluation import open_drive
from evaluation.base import InputError

NUM = 100


def record(folder, section=None, intensity=(), name="town_07"):
    """Six turns of 100 ms, in each of which the vehicle drives 1 m."""
    scan = make_scan(np.tile([20.0, 0.0, 0.0], (NUM, 1)))
    scan["t"] = np.arange(NUM) * 1_000_000
    scan["intensity"][: len(intensity)] = intensity
    scenario = {"map": "town", "stage": "01", "lidars": {"lidar": section}}
    return write_recording(
        folder / name,
        [scan] * 6,
        [yaw_pose(1.0 * k, 0.0, 0.0, 0.0) for k in range(6)],
        stamps_ns=[T0_NS + k * 100_000_000 for k in range(6)],
        attachments=None if section is None else {"scenario.json": scenario},
    )


def export(recording, format_name, output, **options):
    notes = []
    folder = export_drive(
        open_drive(recording),
        format_name,
        output,
        on_note=notes.append,
        **options,
    )
    return open_drive(folder), notes


@pytest.mark.parametrize("format_name", ["kitti", "cns"])
def test_motion_is_taken_out(tmp_path, format_name):
    section = {"preset": "cns", "motion_distortion": True}
    drive, notes = export(
        record(tmp_path, section), format_name, tmp_path / "out"
    )
    np.testing.assert_allclose(
        drive.scan(2)["x"], 20.0 + np.arange(NUM) / NUM, atol=1e-5
    )
    assert len(notes) == 1
    assert "the motion is taken out" in notes[0]


@pytest.mark.parametrize("format_name", ["kitti", "cns", "mulran", "tum"])
def test_nothing_is_said_of_scans_at_rest(tmp_path, format_name):
    recording = record(tmp_path, {"preset": "cns"})
    notes = []
    folder = export_drive(
        open_drive(recording),
        format_name,
        tmp_path / "out",
        on_note=notes.append,
    )
    assert notes == []
    if format_name != "tum":
        np.testing.assert_array_equal(open_drive(folder).scan(2)["x"], 20.0)


@pytest.mark.parametrize(
    ("section", "recorded", "written"),
    [
        # A byte of 256 levels, in hundredths, as KITTI has it.
        (
            {"preset": "vlp-16", "returns": "calibrated"},
            [0, 1, 100, 128, 252, 253, 255],
            [0, 0, 0.39, 0.5, 0.98, 0.99, 0.99],
        ),
        # This preset has KITTI's hundredths.
        (
            {"preset": "hdl-64e", "returns": "calibrated"},
            [0, 1, 61, 99, 100, 255],
            [0, 0.01, 0.61, 0.99, 0.99, 0.99],
        ),
        ({"preset": "hdl-64e"}, [0.0, 0.25, 1.0], [0.0, 0.25, 1.0]),
        (None, [0.0, 7.0, 255.0], [0.0, 7.0, 255.0]),
    ],
)
def test_intensities_have_the_scale_of_kitti(
    tmp_path, section, recorded, written
):
    recording = record(tmp_path, section, recorded)
    drive, notes = export(recording, "kitti", tmp_path / "kitti")
    found = drive.scan(1)["intensity"][: len(written)]
    np.testing.assert_allclose(found, written, atol=1e-7)
    assert any("intensities above 1" in note for note in notes) == (
        section is None
    )
    # CNS has no scale of its own.
    drive, notes = export(recording, "cns", tmp_path / "cns")
    assert notes == []
    found = drive.scan(1)["intensity"][: len(written)]
    np.testing.assert_allclose(found, recorded, atol=1e-7)


def test_drives_of_one_number(tmp_path):
    """All random cities are called 00 by themselves."""
    for k in range(3):
        recording = record(tmp_path, {"preset": "cns"}, name=f"town_{k}_00")
        drive, _ = export(recording, "kitti", tmp_path / "out", sequence=k + 5)
        assert len(drive) == 6
    folders = sorted(one.name for one in (tmp_path / "out/sequences").iterdir())
    assert folders == ["05", "06", "07"]
    assert (tmp_path / "out/poses/06.txt").is_file()
    with pytest.raises(InputError, match="--sequence: tum"):
        export_drive(open_drive(recording), "tum", tmp_path / "tum", sequence=5)
