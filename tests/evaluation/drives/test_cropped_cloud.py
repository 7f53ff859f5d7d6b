from fractions import Fraction

from helpers.drive_files import make_scan, yaw_pose
import numpy as np
import pytest

from cns_drake.base.errors import InputError
from evaluation.drives.cropped_cloud import CroppedCloud


def cropped(scans, X_FSs, max_range=50.0, fields=()):
    cloud = CroppedCloud(max_range, fields, "drive")
    for scan, X_FS in zip(scans, X_FSs, strict=True):
        cloud.add(scan, X_FS, num_more=1)
    return cloud.finish()


def random_scan(number, seed=3):
    rng = np.random.default_rng(seed)
    scan = make_scan(rng.uniform(-60.0, 60.0, (number, 3)))
    scan["ring"] = rng.integers(0, 64, number)
    return scan


def tilted_pose():
    X = yaw_pose(1.0, 2.0, 3.0, 0.3)
    X[:3, :3] = X[:3, :3] @ yaw_pose(0.0, 0.0, 0.0, 1.1)[:3, [2, 0, 1]].T
    return X


def rounded_once(a, b, c):
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def test_points_are_moved_with_fused_multiply_adds():
    scan, X = random_scan(200), tilted_pose()
    expected = []
    for point in zip(*(scan[axis].tolist() for axis in "xyz"), strict=True):
        moved = []
        for row in X[:3].tolist():
            total = point[0] * row[0]
            total = rounded_once(point[1], row[1], total)
            moved.append(rounded_once(point[2], row[2], total) + row[3])
        if max(map(abs, moved)) <= 50.0:
            expected.append(moved)
    assert 50 < len(expected) < 150
    np.testing.assert_array_equal(cropped([scan], [X]), expected)


def test_unmoved_points_keep_their_bits():
    coordinates = np.array(
        [
            [-0.0, 1.0, 50.0],
            [0.1, np.nan, 0.0],
            [np.inf, 0.0, 0.0],
            [0.0, 0.0, -50.001],
            [-50.0, 0.3, 0.0],
        ]
    )
    scan = make_scan(coordinates)
    expected = coordinates.astype(np.float32).astype(float)[[0, 4]]
    assert cropped([scan], [None]).tobytes() == expected.tobytes()
    assert len(cropped([scan], [None], max_range=49.0)) == 0


def stored_otherwise(scan):
    """Yields a scan as other readers give it."""

    def retyped(descr):
        other = np.zeros(len(scan), descr)
        for name in other.dtype.names:
            if name in scan.dtype.names:
                other[name] = scan[name]
        return other

    yield retyped([(axis, "<f8") for axis in "xyz"])
    yield retyped([(axis, ">f4") for axis in "xyz"])
    yield retyped([("z", "<f4"), ("x", "<f8"), ("y", "<f4")])
    yield retyped([("tag", "u1"), *((axis, "<f4") for axis in "xyz")])
    yield retyped([*((axis, "<f4") for axis in "xyz"), ("ring", "u1")])
    yield np.repeat(scan, 2)[::2]
    yield scan[::-1].copy()[::-1]
    shifted = np.empty(scan.nbytes + 1, np.uint8)[1:].view(scan.dtype)
    shifted[:] = scan
    yield shifted
    fixed = scan.copy()
    fixed.flags.writeable = False
    yield fixed


@pytest.mark.parametrize("number", [0, 1, 500])
@pytest.mark.parametrize("X", [None, tilted_pose()])
def test_all_ways_of_storing_a_scan_give_the_same_cloud(number, X):
    scan = random_scan(number)
    scan["y"][::7] = np.nan
    expected = cropped([scan], [X])
    assert expected.shape == (len(expected), 3)
    assert len(expected) < max(number, 1)
    for other in stored_otherwise(scan):
        assert cropped([other], [X]).tobytes() == expected.tobytes()


def test_longer_and_longer_scans_follow_each_other():
    scans = [random_scan(n, seed=n) for n in (0, 3, 100, 1000, 20)]
    poses = [None, tilted_pose(), None, yaw_pose(4.0, 0.0, 0.0, 2.0), None]
    parts = [cropped([s], [X]) for s, X in zip(scans, poses, strict=True)]
    np.testing.assert_array_equal(cropped(scans, poses), np.concatenate(parts))


def test_fields_stay_with_their_points():
    scans = [random_scan(300), random_scan(500, seed=4)]
    poses = [None, tilted_pose()]
    for scan in scans:
        # The field shows where in its scan a point was.
        scan["t"] = np.arange(len(scan))
    plain = cropped(scans, poses)
    found = cropped(scans, poses, fields=("t", "ring"))
    assert found.dtype.names == ("x", "y", "z", "t", "ring")
    np.testing.assert_array_equal(
        np.stack([found[axis] for axis in "xyz"], axis=1), plain
    )
    second = int(np.flatnonzero(np.diff(found["t"].astype(int)) < 0)[0]) + 1
    for scan, part in ((scans[0], found[:second]), (scans[1], found[second:])):
        assert (np.diff(part["t"].astype(int)) > 0).all()
        np.testing.assert_array_equal(part["ring"], scan["ring"][part["t"]])
    kept = scans[0][found["t"][:second]]
    np.testing.assert_array_equal(found["x"][:second], kept["x"])
    is_near = [np.abs(scans[0][axis]) <= 50.0 for axis in "xyz"]
    assert second == np.logical_and.reduce(is_near).sum()


def test_a_field_that_a_scan_lacks():
    with pytest.raises(InputError, match=r"^drive: .* no field 'echo' .*x, y"):
        cropped([random_scan(3)], [None], fields=("echo",))
