"""Tables of text as other programs write them."""

import os

import numpy as np
import pytest

from cns_drake.base import InputError
from evaluation.drives import parse_seconds, read_quaternions
from evaluation.drives.text_tables import (
    parse_stamps_ns,
    read_numbers,
    read_stamped_rows,
)
from evaluation.drives.trajectories import read_angles


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (b",\n", "no row of numbers"),
        (b" , ,\n1 2\n", ""),
        (b"time,x\n", "no row of numbers"),
        (b"", "no row of numbers"),
        (b"\xff\n", "not a text file"),
        (b"1 2\n3\n", "row 2: 1 columns instead of 2"),
        (b"1 2\n3;4\n", "row 2: separated by semicolons instead of white"),
        (b"1 2\n3,4\n", "row 2: separated by commas instead of white space"),
    ],
)
def test_tables_that_are_none(tmp_path, text, fault):
    path = tmp_path / "times.txt"
    path.write_bytes(text)
    if not fault:
        np.testing.assert_array_equal(read_numbers(path, float), [[1, 2]])
        return
    with pytest.raises(InputError, match=f"^{path}: .*{fault}"):
        read_numbers(path, float)


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        ("1;2;3", "separated by semicolons instead of commas"),
        ("1\t2\t3", "separated by tabs instead of commas"),
        ("1 2 3", "1 columns instead of 3"),
        ("1,\t2", "2 columns instead of 3"),
    ],
)
def test_rows_of_poses_with_another_separator(tmp_path, row, fault):
    path = tmp_path / "poses.csv"
    path.write_text(f"time{row[1]}x{row[1]}y\n{row}\n")
    with pytest.raises(InputError, match=f"^{path}: row 1: {fault}"):
        read_stamped_rows(path, 2, ",")


def test_a_table_of_many_gigabytes(tmp_path):
    path = tmp_path / "gt.csv"
    path.touch()
    os.truncate(path, 10 << 30)
    with pytest.raises(InputError, match=f"^{path}: larger than"):
        read_stamped_rows(path, 7, ",")


@pytest.mark.parametrize(
    "encode",
    [
        lambda text: b"\xef\xbb\xbf" + text.encode(),
        lambda text: text.encode("utf-16"),
        lambda text: b"\xfe\xff" + text.encode("utf-16-be"),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: text.replace(" ", "\t").encode(),
    ],
)
@pytest.mark.parametrize("header", ["", "# a remark\n", "x y\n"])
def test_texts_of_other_editors(tmp_path, encode, header):
    path = tmp_path / "times.txt"
    path.write_bytes(encode(f"{header}1 2\n3 4\n"))
    np.testing.assert_array_equal(read_numbers(path, float), [[1, 2], [3, 4]])


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1 2\n3 x\n", "row 2: could not convert 'x' to a number"),
        ("1,5 2\n", "row 1: could not convert '1,5' to a number"),
        ("1 2\n1_0 2\n", "row 2: could not convert '1_0' to a number"),
        ("1 2 3\n", None),
    ],
)
def test_faults_of_rows_are_in_our_words(tmp_path, text, fault):
    path = tmp_path / "times.txt"
    path.write_text(text)
    if fault is None:
        assert read_numbers(path, float).shape == (1, 3)
        return
    with pytest.raises(InputError, match=f"^{path}: {fault}$"):
        read_numbers(path, float)


@pytest.mark.parametrize(
    "text",
    [
        "1e1000000",
        "-1e999999",
        "9" * 5000,
        "1e19",
        "inf",
        "nan",
        "0x1",
        "1_0",
        "1_0.5",
        "٢",
    ],
)
def test_times_that_are_none(text):
    for parse in (parse_seconds, parse_stamps_ns):
        with pytest.raises(ValueError, match="is no time"):
            parse(np.array(["1.5", text]))


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
        ("#Time[s] pos.x[m] pos.y[m] pos.z[m] q_w q_x q_y q_z", W_FIRST),
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
        rows.append(f"{k}.5 {k} 7 -2 {quat}")
    path.write_text("\n".join([header, *rows]) + "\n")
    found = read_quaternions(path, None, parse_seconds)
    assert found.stamps_ns.tolist() == [500000000, 1500000000, 2500000000]
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


def test_angles_by_name(tmp_path):
    """As Boreas' table, with the heading first and fewer velocities."""
    path = tmp_path / "lidar_poses.csv"
    plain = tmp_path / "plain.csv"
    plain.write_text("1000,1,2,3,9,9,9,0.1,0.2,0.3,9,9,9\n")
    path.write_text(
        "GPSTime,heading,pitch,roll,altitude,northing,easting,vel_east\n"
        "1000,0.3,0.2,0.1,3,2,1,nan\n"
    )
    (one, _), (two, notes) = read_angles(plain, 3), read_angles(path, 3)
    assert notes == ()
    np.testing.assert_array_equal(one.X_WB, two.X_WB)
    assert one.X_WB[0, :3, 3].tolist() == [1, 2, 3]


def test_numbered_rows_may_have_any_order(tmp_path):
    rows = [f"{n} {n}.5 0 0 0 0 0 1" for n in (481, 26, 3528)]
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(rows))
    with pytest.raises(InputError, match="not later"):
        read_quaternions(path, None)
    found = read_quaternions(path, None, in_order=False)
    assert found.stamps_ns.tolist() == [26, 481, 3528]
    assert found.X_WB[:, 0, 3].tolist() == [26.5, 481.5, 3528.5]
    path.write_text("\n".join([*rows, "26 9 9 9 0 0 0 1"]))
    with pytest.raises(InputError, match="not later"):
        read_quaternions(path, None, in_order=False)
