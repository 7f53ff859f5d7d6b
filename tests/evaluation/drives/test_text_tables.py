"""Tables of text as other programs write them."""

import os

import numpy as np
import pytest

from cns_drake.base.errors import InputError
from evaluation.drives.text_tables import (
    parse_seconds,
    parse_stamps_ns,
    read_numbers,
    read_stamped_rows,
)


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
    "text", ["1e1000000", "-1e999999", "9" * 5000, "1e19", "inf", "nan", "0x1"]
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
