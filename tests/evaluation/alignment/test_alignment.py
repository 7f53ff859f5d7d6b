import json
import pickle
from types import SimpleNamespace

from helpers.dataset_folders import (
    T0_NS,
    UTM,
    pack,
    write_bytes,
    write_matrices,
    write_quaternions,
)
from helpers.drive_files import make_scan, write_recording
from helpers.internal.eval_program import run
from helpers.towns import (
    LIDAR_HEIGHT,
    TownDrive,
    drifted,
    make_scans,
    make_town,
    rigid,
    route,
)
import numpy as np
import pytest

from evaluation.alignment import open_pair
from evaluation.base import InputError, poses, xyz
from evaluation.change import temporal_change
from evaluation.drives import Drive, Reading, RecordingSource, open_drive
from evaluation.map_update import write_session
from evaluation.maps import map_drive
from evaluation.study import RecordingInfo, drives_by_map
from evaluation.verbs import update_map

pytestmark = pytest.mark.slow

GONE = (2, 5, 8, 9, 14, 17, 20)
ELSEWHERE = rigid([40.0, -25.0, 13.0], 115.0)


class Drives:
    """Two drives through a street; the second one lacks seven houses."""

    def __init__(self):
        self.X_first = route(lane=-1.75)
        self.X_second = route(lane=1.75, reverse=True)
        self.scans_first = make_scans(make_town(), self.X_first)
        self.scans_second = make_scans(make_town(gone=GONE), self.X_second)

    def first(self, X_WS=None, **options):
        X = self.X_first if X_WS is None else X_WS
        return TownDrive("first", self.scans_first, X, **options)

    def second(self, X_WS=None, **options):
        X = self.X_second if X_WS is None else X_WS
        return TownDrive("second", self.scans_second, X, **options)


@pytest.fixture(scope="module")
def drives():
    return Drives()


def change(first: Drive, second: Drive) -> float:
    """Returns the TCR_sym of two drives."""
    maps = [map_drive(one, 5.0).centroids_W for one in (first, second)]
    return temporal_change(*maps).symmetric


@pytest.fixture(scope="module")
def truth(drives):
    value = change(drives.first(), drives.second())
    assert 0.03 < value < 0.2
    return value


def apart(X, Y):
    """Returns the largest distance between positions [m]."""
    return np.linalg.norm((X - Y)[:, :3, 3], axis=1).max()


def aligned(first: Drive, second: Drive, when: str) -> SimpleNamespace:
    """Returns two drives in one world, with the report."""
    opened = open_pair([first, second], when=when)
    (first, second), (report,) = opened.drives, opened.world.alignments
    assert opened.world.to_json()["aligned"] is True
    return SimpleNamespace(first=first, second=second, report=report)


def test_a_wrong_datum(drives, truth):
    """The datum is wrong by tens of metres and more than a quarter turn."""
    recorded = ELSEWHERE @ drives.X_second
    first, second = drives.first(), drives.second(recorded, frame="odom")
    with pytest.raises(InputError, match="second: poses in frame 'odom', th"):
        open_pair([first, second], when="never")
    result = aligned(first, second, "auto")
    assert apart(result.second.X_WS, drives.X_second) < 0.03
    np.testing.assert_array_equal(result.first.X_WS, drives.X_first)
    assert change(result.first, result.second) == pytest.approx(truth, abs=0.01)
    assert result.second.world_frame == result.first.world_frame == "map"
    report = result.report
    assert (report.held, report.moved) == ("first", "second")
    assert report.frames == ("map", "odom")
    assert report.model == "anchor"
    assert report.guess == "places that look alike"
    assert report.candidates > 20
    assert 15 <= report.inliers <= report.loops <= report.attempts
    assert report.distance_median < 0.03
    assert report.angle_median_deg < 0.1
    assert report.turn_deg == pytest.approx(-115.0, abs=0.1)
    middle = len(recorded) // 2
    np.testing.assert_allclose(
        report.move, (drives.X_second - recorded)[middle, :3, 3], atol=0.03
    )
    assert report.bend < 1e-6
    assert report.straightened == (0.0, 0.0)


def test_a_small_error_in_a_common_frame(drives, truth):
    recorded = rigid([1.5, -2.0, 0.8], 1.5) @ drives.X_second
    first, second = drives.first(), drives.second(recorded)
    for when in ("auto", "never"):
        opened = open_pair([first, second], when=when)
        assert opened.drives == [first, second]
        assert opened.world.to_json() == {
            "shared": True,
            "aligned": False,
            "why": "all poses are in frame 'map', which drives share",
        }
    result = aligned(first, second, "always")
    assert result.report.guess == "the common frame"
    assert result.report.candidates is None
    assert len(result.second) == len(recorded)
    np.testing.assert_array_equal(result.second.scan(3), second.scan(3))
    np.testing.assert_array_equal(result.second.stamps_ns, second.stamps_ns)
    assert apart(result.second.X_WS, drives.X_second) < 0.03
    assert change(result.first, result.second) == pytest.approx(truth, abs=0.01)


def test_a_common_frame_that_is_none(drives):
    """The poses name one frame but are far off: places must be recognised."""
    recorded = ELSEWHERE @ drives.X_second
    result = aligned(drives.first(), drives.second(recorded), "always")
    assert result.report.guess == "places that look alike"
    assert apart(result.second.X_WS, drives.X_second) < 0.03


def test_a_drive_that_drifts(drives, truth):
    recorded = ELSEWHERE @ drifted(drives.X_second, scale=1.02, turn_deg=5.0)
    # The trajectory is bent so strongly that no rigid pose fits.
    rigidly = drives.X_second[25] @ poses.inverse(recorded[25]) @ recorded
    assert apart(rigidly, drives.X_second) > 1.5
    result = aligned(
        drives.first(), drives.second(recorded, frame="odom"), "always"
    )
    assert result.report.model == "pose graph"
    assert result.report.bend > 1.5
    assert apart(result.second.X_WS, drives.X_second) < 0.3
    assert change(result.first, result.second) == pytest.approx(truth, abs=0.01)


@pytest.mark.night
def test_the_drive_that_drifts_gives_way(drives):
    """Forth and back, so that a drive's disagreement with itself shows."""
    X = np.concatenate([route(lane=-1.75), route(lane=1.75, reverse=True)])
    town = make_town()
    scans = make_scans(town, X)
    recorded = ELSEWHERE @ drifted(X, scale=1.01, turn_deg=4.0)
    bad = TownDrive("bad", scans, recorded, frame="odom")
    result = aligned(bad, drives.second(), "always")
    assert (result.report.held, result.report.moved) == ("second", "bad")
    assert result.report.frames == ("map", "odom")
    assert result.report.straightened[0] == 0.0
    assert result.report.straightened[1] > 0.5
    np.testing.assert_array_equal(result.second.X_WS, drives.X_second)
    assert apart(result.first.X_WS, X) < 0.3
    good = change(TownDrive("good", scans, X), drives.second())
    assert change(result.first, result.second) == pytest.approx(good, abs=0.01)
    # This does not hold if others are aligned to it already.
    bad = TownDrive("bad", scans, recorded, frame="enu")
    opened = open_pair(
        [bad, TownDrive("same", scans, recorded, frame="enu"), drives.second()]
    )
    held, *_ = opened.drives
    assert [one.held for one in opened.world.alignments] == ["bad"]
    np.testing.assert_array_equal(held.X_WS, recorded)


def test_heights_start_at_the_ground(drives):
    recorded = rigid([0.0, 0.0, 61.3], 0.0) @ drives.X_first
    result = aligned(
        drives.first(recorded, frame="utm"), drives.second(), "always"
    )
    assert result.report.ground == pytest.approx(61.3, abs=0.05)
    for drive in (result.first, result.second):
        # Other drives in the frame of the first one keep their heights.
        assert drive.world_frame not in ("utm", "map")
        np.testing.assert_allclose(drive.X_WS[:, 2, 3], LIDAR_HEIGHT, atol=0.05)


@pytest.mark.night
def test_another_town(drives):
    X = route()
    other = TownDrive("other", make_scans(make_town(seed=8), X), X, "elsewhere")
    with pytest.raises(InputError, match="other: cannot be aligned to first"):
        aligned(drives.first(), other, "always")


@pytest.mark.parametrize("number", [1, 2])
def test_next_to_nothing(drives, number):
    few = TownDrive(
        "few", drives.scans_second[:number], drives.X_second[:number]
    )
    with pytest.raises(InputError, match="few: cannot be aligned to first"):
        aligned(drives.first(), few, "always")


def test_scans_that_show_nothing(drives):
    empty = [scan[:0] for scan in drives.scans_second]
    blind = TownDrive("blind", empty, drives.X_second)
    with pytest.raises(InputError, match="blind: cannot be aligned to first"):
        aligned(drives.first(), blind, "always")


def record(folder, scans, X_WS, frame):
    """Writes a recording of the drive with the LiDAR at LIDAR_HEIGHT."""
    X_SB = rigid([0.0, 0.0, -LIDAR_HEIGHT], 0.0)
    write_recording(
        folder,
        [make_scan(xyz(scan)) for scan in scans],
        list(X_WS @ X_SB),
        p_BS=(0.0, 0.0, LIDAR_HEIGHT),
        world_frame=frame,
    )
    return folder


@pytest.fixture(scope="module")
def recordings(drives, tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings")
    return {
        "first": record(
            folder / "first", drives.scans_first, drives.X_first, "map"
        ),
        "second": record(
            folder / "second",
            drives.scans_second,
            ELSEWHERE @ drives.X_second,
            "odom",
        ),
        "third": record(
            folder / "third",
            drives.scans_second,
            rigid([-8.0, 70.0, 1.0], -50.0) @ drives.X_second,
            "third_odom",
        ),
    }


def test_a_control_joins_the_same_world(recordings, drives):
    opened = open_pair(list(recordings.values()))
    moved = [report.moved for report in opened.world.alignments]
    assert moved == ["second", "third"]
    for one in opened.drives[1:]:
        assert apart(one.X_WS, drives.X_second) < 0.05
    assert apart(opened.drives[0].X_WS, drives.X_first) < 1e-9


def test_recordings_of_a_city_are_aligned_once(recordings, drives):
    notes = []
    infos = [
        RecordingInfo(name, path, "town", name, None, world=name)
        for name, path in recordings.items()
    ]
    (city,) = drives_by_map(infos, notes.append)
    assert [note.split()[0] for note in notes] == ["world:", "first", "second"]
    assert (city.world.state, city.world.shared) == ("aligned", False)
    X_WS = {one.name: one.source().X_WS for one in city.recordings}
    X_TW = X_WS["first"][0] @ poses.inverse(drives.X_first[0])
    for name in ("second", "third"):
        assert apart(X_WS[name], X_TW @ drives.X_second) < 0.05
    # The identity of an aligned recording is that of its poses, too.
    moved = city.stages["first"].source
    assert moved.identity() != RecordingSource(moved.path).identity()
    assert moved.identity() == pickle.loads(pickle.dumps(moved)).identity()


def test_maps_of_sessions_follow_their_scans(drives, tmp_path):
    """The newer map was made in another frame; its labels stay with it."""
    notes = []
    folder = tmp_path / "maps"
    moved = drives.second(rigid([4.0, -3.0, 0.0], 8.0) @ drives.X_second)
    for side, drive in (("A", drives.first()), ("B", moved)):
        session, _ = write_session(drive, folder / side, 5.0)
        kept = np.ones(len(session.points), np.uint8)
        np.save(folder / side / "truth.npy", kept)
    labels = (folder / "A/truth.npy", folder / "B/truth.npy")
    found = {
        when: update_map(
            folder, labels=labels, align=when, on_note=notes.append
        )
        for when in ("auto", "always")
    }
    assert found["auto"].world.to_json() == {
        "shared": True,
        "aligned": False,
        "why": notes[0].removeprefix("world: "),
    }
    assert found["always"].world.aligned
    off = {
        when: one.scores["updated_map"]["chamfer"]
        for when, one in found.items()
    }
    assert off["always"] < 0.5 * off["auto"]
    assert found["always"].metrics["miou"] == 1.0
    # A map without scans has nothing by which it is aligned.
    (folder / "B/poses.txt").unlink()
    with pytest.raises(InputError, match="B: no scans and poses, by which"):
        update_map(folder, labels=labels, align="always", on_note=print)


def test_map_files_are_taken_as_they_are(recordings, drives, tmp_path):
    np.save(tmp_path / "map.npy", make_town())
    paths = [recordings["first"], tmp_path / "map.npy"]
    readings = Reading.each(2)
    opened = open_pair(paths, readings, "auto", print)
    assert opened.drives[1] == paths[1]
    assert (opened.world.shared, opened.world.state) == (None, "unknown")
    with pytest.raises(InputError, match=r"--align always: .*map\.npy"):
        open_pair(paths, readings, "always", print)
    with pytest.raises(InputError, match="--lidar roof: a map file has no"):
        open_pair(paths[1:] * 2, Reading.each(2, lidar="roof"), "auto", print)


def test_options_count_for_one_drive_or_for_all():
    one, two = Reading.each(2, lidar=["a", "b"], columns=5)
    assert (one.lidar, one.columns, two.lidar, two.columns) == ("a", 5, "b", 5)
    with pytest.raises(InputError, match=r"--odometry: given 3 times; .* or 2"):
        Reading.each(2, odometry=["/a", "/b", "/c"])


@pytest.mark.night
def test_mulran_and_helipr(capsys, tmp_path, drives, truth):
    """The paper's KAIST row has two data sets on one grid, metres apart."""
    stamps_ns = [T0_NS + 100_000_000 * i for i in range(len(drives.X_first))]
    mulran = tmp_path / "KAIST01"
    for stamp, scan in zip(stamps_ns, drives.scans_first, strict=True):
        four = np.c_[xyz(scan, np.float32), np.ones(len(scan), np.float32)]
        write_bytes(mulran / "Ouster" / f"{stamp}.bin", four.tobytes())
    # Only the reader has the mount.
    write_matrices(
        mulran / "global_pose.csv",
        stamps_ns,
        rigid(UTM, 0.0)[None].repeat(50, 0),
    )
    X_WS = open_drive(mulran).X_WS[0]
    X_BS = rigid([0, 0, 0], 0)
    X_BS[:3, :3] = X_WS[:3, :3]
    X_BS[:3, 3] = X_WS[:3, 3] - (UTM - [350_000, 4_020_000, 0])
    grid = rigid(UTM, 30.0)
    write_matrices(
        mulran / "global_pose.csv",
        stamps_ns,
        grid @ drives.X_first @ poses.inverse(X_BS),
    )
    helipr = tmp_path / "KAIST06"
    for stamp, scan in zip(stamps_ns, drives.scans_second, strict=True):
        rows = [(*p, 1.0, 0, 0, 0, 0) for p in xyz(scan).tolist()]
        data = pack("ffffIHHH", rows)
        write_bytes(helipr / "LiDAR" / "Ouster" / f"{stamp}.bin", data)
    # Another receiver is metres off, and its heights have another reference.
    off = rigid([2.0, -3.0, 24.0], 0.4)
    off[:3, 3] += UTM - off[:3, :3] @ UTM
    write_quaternions(
        helipr / "LiDAR_GT" / "global_Ouster_gt.txt",
        stamps_ns,
        off @ grid @ drives.X_second,
    )
    status, out, err = run(capsys, "tcr", mulran, helipr, "--json")
    assert status == 0, err
    values = json.loads(out)
    assert values["alignment"]["guess"] == "the common datum utm-52n"
    assert values["alignment"]["ground"] == pytest.approx(UTM[2], abs=0.1)
    assert values["alignment"]["inliers"] >= 15
    assert values["tcr_sym"] == pytest.approx(truth, abs=0.01)
