from helpers.drive_files import make_scan, yaw_pose
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import cropped, cropped_with_fields


def random_scan(number, seed=3):
    rng = np.random.default_rng(seed)
    scan = make_scan(rng.uniform(-60.0, 60.0, (number, 3)))
    scan["ring"] = rng.integers(0, 64, number)
    return scan


def tilted_pose():
    X = yaw_pose(1.0, 2.0, 3.0, 0.3)
    X[:3, :3] = X[:3, :3] @ yaw_pose(0.0, 0.0, 0.0, 1.1)[:3, [2, 0, 1]].T
    return X


def test_each_product_and_each_sum_is_rounded():
    """Python's floats are rounded so, on every processor."""
    scan = random_scan(200)
    X = tilted_pose()
    expected = []
    for x, y, z in zip(*(scan[axis].tolist() for axis in "xyz"), strict=True):
        moved = [a * x + b * y + c * z + d for a, b, c, d in X[:3].tolist()]
        if max(map(abs, moved)) <= 50.0:
            expected.append(moved)
    assert 50 < len(expected) < 150
    np.testing.assert_array_equal(cropped(scan, 50.0, X), expected)


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
    assert cropped(scan, 50.0).tobytes() == expected.tobytes()
    assert len(cropped(scan, 49.0)) == 0


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
    expected = cropped(scan, 50.0, X)
    assert expected.shape == (len(expected), 3)
    assert len(expected) < max(number, 1)
    for other in stored_otherwise(scan):
        assert cropped(other, 50.0, X).tobytes() == expected.tobytes()


@pytest.mark.parametrize("X", [None, tilted_pose()])
def test_fields_stay_with_their_points(X):
    scan = random_scan(300)
    # The field shows where in the scan a point was.
    scan["t"] = np.arange(len(scan))
    plain = cropped(scan, 50.0, X)
    found = cropped_with_fields(scan, 50.0, ("t", "ring"), X, source="drive")
    assert 0 < len(found) < len(scan)
    assert found.dtype.names == ("x", "y", "z", "t", "ring")
    np.testing.assert_array_equal(
        np.stack([found[axis] for axis in "xyz"], axis=1), plain
    )
    assert (np.diff(found["t"].astype(int)) > 0).all()
    np.testing.assert_array_equal(found["ring"], scan["ring"][found["t"]])
    for t, point in zip(found["t"], plain, strict=True):
        np.testing.assert_array_equal(
            cropped(scan[t : t + 1], 50.0, X)[0], point
        )


def test_a_field_that_a_scan_lacks():
    with pytest.raises(InputError, match=r"^drive: .* no field 'echo' .*x, y"):
        cropped_with_fields(random_scan(3), 50.0, ("echo",), source="drive")
