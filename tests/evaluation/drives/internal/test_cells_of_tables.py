"""Tables of text as other programs write them."""

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives.text_tables import parse_seconds
from evaluation.drives.trajectories import read_quaternions


def test_times_near_zero_and_at_the_end():
    assert parse_seconds(np.array(["1e-1000000"])).tolist() == [0]
    assert parse_seconds(np.array(["9223372036.854775807"])) == 2**63 - 1
    with pytest.raises(ValueError, match="is no time"):
        parse_seconds(np.array(["9223372036.854775808"]))


W_FIRST = "qw qx qy qz"
W_LAST = "qx qy qz qw"


@pytest.mark.parametrize(
    ("header", "order"),
    [
        ("", W_LAST),
        ("timestamp x y z qx qy qz qw", W_LAST),
        ("# timestamp tx ty tz qx qy qz qw", W_LAST),
        ("timestamp x y z qw qx qy qz", W_FIRST),
        ("# timestamp x y z qw qx qy qz", W_FIRST),
        ("#Time[ns] pos.x[m] pos.y[m] pos.z[m] q_w q_x q_y q_z", W_FIRST),
        ("t x y z w x y z", W_FIRST),
        ("t x y z x y z w", W_LAST),
        # Of a remark that is no header, nothing follows.
        ("# the estimate of run 3: x y z", W_LAST),
        ("zeit ost nord hoch qa qb qc qd", W_LAST),
    ],
)
def test_names_in_a_header_are_used(tmp_path, header, order):
    path = tmp_path / "estimate.tum"
    half = np.array([0.1, 0.2, 0.3])
    rows = []
    for k, angle in enumerate(half):
        values = {
            "qx": 0.0,
            "qy": 0.0,
            "qz": np.sin(angle),
            "qw": np.cos(angle),
        }
        quat = " ".join(repr(float(values[name])) for name in order.split())
        rows.append(f"{k}5 {k} 7 -2 {quat}")
    path.write_text("\n".join([header, *rows]) + "\n")
    found = read_quaternions(path, None)
    assert found.stamps_ns.tolist() == [5, 15, 25]
    np.testing.assert_array_equal(
        found.X_WB[:, :3, 3], [[k, 7, -2] for k in range(3)]
    )
    np.testing.assert_allclose(
        np.arctan2(found.X_WB[:, 1, 0], found.X_WB[:, 0, 0]), 2.0 * half
    )


def test_columns_of_euroc_among_others(tmp_path):
    """EuRoC's ground truth has q_w first, and velocities and biases behind."""
    path = tmp_path / "data.csv"
    names = [f"p_RS_R_{one} [m]" for one in "xyz"]
    names += [f"q_RS_{one} []" for one in "wxyz"]
    names += [f"v_RS_R_{one} [m s^-1]" for one in "xyz"]
    header = ", ".join(["#timestamp", *names])
    row = "1403636580838555648,4.5,-1.75,0.5,0.0,1.0,0.0,0.0,7,8,9"
    path.write_text(f"{header}\n{row}\n")
    found = read_quaternions(path, ",")
    assert found.stamps_ns.tolist() == [1403636580838555648]
    expected = np.diag([1.0, -1.0, -1.0, 1.0])
    expected[:3, 3] = 4.5, -1.75, 0.5
    np.testing.assert_allclose(found.X_WB[0], expected)
    path.write_text(f"{header}\n{row}\n{row},1\n")
    with pytest.raises(InputError, match="row 2: 12 columns instead of 11"):
        read_quaternions(path, ",")


@pytest.mark.parametrize(
    ("header", "fault"),
    [
        (
            "timestamp x y z qw qx qy q0",
            "header: 'qw' in column 5; the columns",
        ),
        ("time x y z roll pitch yaw qx", "header: 'qx' in column 8"),
        ("timestamp x y z qw qx qx qz", "header: qx is there twice"),
        ("timestamp x y z qw qx qy", "header: 7 names for 8 columns"),
    ],
)
def test_a_header_that_contradicts(tmp_path, header, fault):
    path = tmp_path / "estimate.tum"
    path.write_text(f"{header}\n1 2 3 4 0 0 0 1\n")
    with pytest.raises(InputError, match=f"^{path}: {fault}"):
        read_quaternions(path, None)
