"""`cns-eval localise --estimate` by closed forms and as KISS-ICP does."""

import json

from helpers.drive_files import T0_NS, make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import assert_refused, run
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.base import InputError, poses
from evaluation.alignment import segment_errors, trajectory_errors
from evaluation.alignment.estimated_trajectories import aligned_offsets
from evaluation.drives import open_drive, parse_seconds, read_quaternions

STEP = 2.5
# The first pose more than 100 m of path behind another.
PART = 41 * STEP


def bent_poses(count, swing=0.8):
    """Returns poses STEP apart, whose heading swings to both sides [rad]."""
    yaw = swing * np.sin(0.07 * np.arange(count))
    # The car drives along chords.
    along = np.r_[0.0, yaw[:-1] + 0.5 * np.diff(yaw)]
    xy = STEP * np.c_[np.cos(along), np.sin(along)].cumsum(axis=0)
    return [yaw_pose(x, y, 0.0, a) for (x, y), a in zip(xy, yaw, strict=True)]


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A drive of 120 frames, 50 ms and 2.5 m apart, through bends."""
    folder = tmp_path_factory.mktemp("drives") / "bends_01"
    scan = make_scan(np.ones((3, 3)))
    X_WBs = bent_poses(120)
    write_recording(folder, [scan] * len(X_WBs), X_WBs, p_BS=(1.0, 0.4, 1.6))
    return folder


def write_tum(path, stamps_ns, X, header=""):
    quat = Rotation.from_matrix(X[:, :3, :3]).as_quat()
    rows = [
        " ".join([f"{stamp // 10**9}.{stamp % 10**9:09d}", *map(repr, row)])
        for stamp, row in zip(
            stamps_ns.tolist(), np.c_[X[:, :3, 3], quat].tolist(), strict=True
        )
    ]
    path.write_text(header + "\n".join(rows) + "\n")
    return path


def moved(X):
    """Returns the same trajectory in another world."""
    turn = Rotation.from_rotvec([0.3, -0.2, 2.0]).as_matrix()
    return poses.make_pose(turn, np.array([40.0, -7.0, 3.0])) @ X


def test_true_poses_that_are_too_far_apart(tmp_path):
    """As of keyframes: the gap is in the drive, and no scan is meant."""
    X = bent_poses(5)
    stamps_ns = [T0_NS + k * 2_000_000_000 for k in range(5)]
    scan = make_scan(np.ones((3, 3)))
    folder = tmp_path / "sparse_01"
    write_recording(folder, [scan] * 5, X, stamps_ns=stamps_ns)
    middle = np.array(stamps_ns[:-1]) + 1_000_000_000
    path = write_tum(tmp_path / "e.tum", middle, np.array(X[:-1]))
    with pytest.raises(InputError) as error:
        trajectory_errors(
            open_drive(folder), read_quaternions(path, None, parse_seconds)
        )
    assert str(error.value).endswith(
        f"no pose for the estimated pose at {middle[0]} ns: the poses there"
        " are 2.00 s apart, more than 1 s"
    )


def score(capsys, drive, path, *options):
    status, out, err = run(
        capsys, "localise", drive, "--estimate", path, "--json", *options
    )
    assert status == 0, err
    return json.loads(out), err


def test_a_moved_copy_has_no_error(capsys, drive, tmp_path):
    truth = open_drive(drive)
    header = "# timestamp tx ty tz qx qy qz qw\n# from another program\n"
    path = write_tum(
        tmp_path / "copy.tum", truth.stamps_ns, moved(truth.X_WS), header
    )
    values, err = score(capsys, drive, path)
    assert err == ""
    assert values["poses"] == 120
    assert values["ate_max"] < 1e-9
    assert values["drift_100m_90"] < 1e-9
    # The rounding of an arc cosine near 1.
    assert values["drift_100m_rotation_deg"] < 1e-5
    assert values["length"] == pytest.approx(values["drive_length"])
    # The LiDAR, ahead of the rear axle and beside it, does not move with it.
    wrong, _ = score(capsys, drive, path, "--frame", "base_link")
    assert wrong["ate"] > 0.1


def test_poses_of_the_vehicle(capsys, drive, tmp_path):
    rows = open_drive(drive).odometry
    X_WB = poses.make_pose(
        poses.rotation_from_quaternion(rows["quat_xyzw"]), rows["position"]
    )
    path = write_tum(tmp_path / "b.tum", rows["stamp_ns"], moved(X_WB))
    values, _ = score(capsys, drive, path, "--frame", "base_link")
    assert values["ate_max"] < 1e-9
    assert values["frame"] == "base_link"
    assert values["length"] == pytest.approx(119 * STEP)


def test_a_drift_by_the_metre():
    X = np.array(bent_poses(120, swing=0.0))
    Y = X.copy()
    Y[:, :3, 3] *= 1.01
    starts, ends, E = segment_errors(X, moved(Y))
    # 119 steps; the last start has 41 behind it.
    np.testing.assert_array_equal(starts, np.arange(0, 79, 10))
    np.testing.assert_array_equal(ends, starts + 41)
    errors = np.linalg.norm(E[:, :3, 3], axis=1)
    np.testing.assert_allclose(errors, 0.01 * PART, rtol=1e-9)
    # The alignment moves the middles together: errors are 1 % of the distance
    # from there.
    middle = (np.arange(120) - 59.5) * STEP
    np.testing.assert_allclose(
        aligned_offsets(X[:, :3, 3], moved(Y)[:, :3, 3]),
        0.01 * np.abs(middle),
        atol=1e-9,
    )


def test_a_turn_by_the_metre(capsys, drive, tmp_path):
    """A gyroscope that gains 0.01 deg each metre."""
    truth = open_drive(drive)
    steps = poses.inverse(truth.X_WS[:-1]) @ truth.X_WS[1:]
    lengths = np.linalg.norm(steps[:, :3, 3], axis=1)
    gains = np.radians(0.01 * lengths)
    wrong = Rotation.from_rotvec(np.c_[0 * gains, 0 * gains, gains])
    Y = [np.eye(4)]
    for X, R in zip(steps, wrong.as_matrix(), strict=True):
        Y.append(Y[-1] @ X @ poses.make_pose(R, np.zeros(3)))
    path = write_tum(tmp_path / "t.tum", truth.stamps_ns, np.array(Y))
    values, _ = score(capsys, drive, path)
    parts = []
    for start in range(0, len(steps), 10):
        some = np.cumsum(lengths[start:])
        if some[-1] > 100.0:
            parts.append(some[some > 100.0][0])
    assert values["drift_segments"] == len(parts)
    assert values["drift_100m_rotation_deg"] == pytest.approx(
        0.01 * np.mean(parts), rel=1e-6
    )


@pytest.mark.parametrize("count", [60, 120])
def test_the_measures_of_kiss_icp(capsys, drive, tmp_path, count):
    from kiss_icp.metrics import absolute_trajectory_error, sequence_error

    truth = open_drive(drive)
    rng = np.random.default_rng(5)
    # Errors add up from step to step, as those of an odometry.
    turns = Rotation.from_rotvec(rng.normal(0.0, 0.002, (count, 3)))
    jumps = poses.make_pose(turns.as_matrix(), rng.normal(0, 0.02, (count, 3)))
    X = truth.X_WS[:count]
    Y = [np.eye(4)]
    for one, jump in zip(poses.inverse(X[:-1]) @ X[1:], jumps, strict=False):
        Y.append(Y[-1] @ one @ jump)
    Y = np.array(Y)
    path = write_tum(tmp_path / "k.tum", truth.stamps_ns[:count], moved(Y))
    values, _ = score(capsys, drive, path)
    _, ate = absolute_trajectory_error(list(X), list(moved(Y)))
    assert values["ate"] == pytest.approx(ate, rel=1e-5)
    # It averages over parts of 100 m, 200 m and so on; fewer than 200 m have
    # parts of 100 m alone.
    if values["length"] < 200.0:
        percent, _ = sequence_error(list(X), list(Y))
        assert values["drift_100m"] == pytest.approx(percent, rel=1e-5)


def test_times_between_scans(capsys, drive, tmp_path):
    """A program that gives poses at the ends of scans, 50 ms late."""
    truth = open_drive(drive)
    path = write_tum(
        tmp_path / "late.tum", truth.stamps_ns[:-1], truth.X_WS[1:]
    )
    values, _ = score(capsys, drive, path)
    assert values["ate"] > 0.01
    values, err = score(capsys, drive, path, "--time-offset", "0.05")
    assert values["ate"] < 1e-9
    assert err == ""
    # Halfway between two poses a chord of the bend has its middle.
    middles = truth.X_WS[:-1].copy()
    middles[:, :3, 3] += truth.X_WS[1:, :3, 3]
    middles[:, :3, 3] /= 2.0
    path = write_tum(
        tmp_path / "m.tum", truth.stamps_ns[:-1] + 25_000_000, middles
    )
    assert score(capsys, drive, path)[0]["ate"] < 1e-9


def test_an_estimate_of_another_clock(capsys, drive, tmp_path):
    """Seconds since 1970 for a drive that begins at any other time."""
    truth = open_drive(drive)
    late_ns = 1_700_000_000_250_000_000
    path = write_tum(tmp_path / "e.tum", truth.stamps_ns + late_ns, truth.X_WS)
    words = ["localise", drive, "--estimate", path]
    # The error prints the offset that fits.
    assert_refused(capsys, words, "--time-offset=-1700000000.250")
    values, err = score(capsys, drive, path, "--time-offset", "-1700000000.25")
    assert values["ate"] < 1e-9
    assert (values["poses"], err) == (len(truth), "")


def test_poses_outside_are_counted(capsys, drive, tmp_path):
    truth = open_drive(drive)
    path = write_tum(
        tmp_path / "long.tum", truth.stamps_ns + 1_000_000_000, truth.X_WS
    )
    values, err = score(capsys, drive, path)
    assert values["poses"] == 100
    assert values["poses_outside"] == 20
    assert err == f"{path}: 20 poses before or after the drive, left out\n"


def test_a_short_path_has_no_drift(capsys, drive, tmp_path):
    truth = open_drive(drive)
    # All poses are in the LiDAR's frame, whose steps are shorter.
    steps = np.linalg.norm(np.diff(truth.X_WS[:, :3, 3], axis=0), axis=1)
    enough = int(np.argmax(np.cumsum(steps) > 100.0)) + 2
    for count, has_drift in ((enough - 1, False), (enough, True)):
        path = write_tum(
            tmp_path / "short.tum", truth.stamps_ns[:count], truth.X_WS[:count]
        )
        values, _ = score(capsys, drive, path)
        assert (values["drift_100m"] is not None) == has_drift
        assert values["drift_segments"] == int(has_drift)
        _, out, _ = run(capsys, "localise", drive, "--estimate", path)
        assert ("undefined  (the path is shorter)" in out) != has_drift


def test_seconds_without_a_point_are_seconds(capsys, tmp_path):
    stamps_ns = [1_700_000_000_000_000_000 + k * 10**9 for k in range(5)]
    scan = make_scan(np.ones((3, 3)))
    folder = write_recording(
        tmp_path / "slow", [scan] * 5, bent_poses(5), stamps_ns=stamps_ns
    )
    truth = open_drive(folder)
    path = tmp_path / "whole.tum"
    rows = [
        f"{stamp // 10**9} {' '.join(map(repr, p))} 0 0 0 1"
        for stamp, p in zip(
            stamps_ns, truth.X_WS[:, :3, 3].tolist(), strict=True
        )
    ]
    path.write_text("\n".join(rows))
    assert score(capsys, folder, path)[0]["ate"] < 1e-9


def test_estimates_that_cannot_be_used(capsys, drive, tmp_path):
    truth = open_drive(drive)
    stamps_ns, X = truth.stamps_ns, truth.X_WS
    path = tmp_path / "bad.tum"

    def refused(*words, options=()):
        assert_refused(
            capsys,
            ["localise", drive, "--estimate", path, *options],
            path.name,
            *words,
        )

    refused("No such file")
    write_tum(path, stamps_ns[[0, 2, 1, 3]], X[:4])
    refused("pose 3 at", "is not later than the one before")
    write_tum(path, stamps_ns + 6_000_000_000, X)
    refused("0 poses within", "1700000006.000 to 1700000011.950 s", "bends_01")
    write_tum(path, stamps_ns[:2], X[:2])
    refused("2 poses within", "3 at least")
    text = write_tum(path, stamps_ns, X).read_text().splitlines()
    path.write_text(
        "\n".join([*text[:4], text[4].replace(" 0.0 ", " nan ", 1)])
    )
    refused("row 5: a number is not finite")
    path.write_text("\n".join([*text[:4], "nan" + text[4][10:]]))
    refused("time: 'nan")
    path.write_text("\n".join([*text[:4], text[4][:60]]))
    refused("columns")
    path.write_text("\n".join([*text[:4], text[4].rpartition(" ")[0] + " 4"]))
    refused("row 5: quaternion")
    write_tum(path, stamps_ns, X)
    for offset in ("nan", "inf", "1e30"):
        assert_refused(
            capsys,
            ["localise", drive, "--estimate", path, "--time-offset", offset],
            "--time-offset",
        )
