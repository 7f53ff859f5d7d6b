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
        (b"1 2\n3\n", "columns"),
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


def test_a_table_of_many_gigabytes(tmp_path):
    path = tmp_path / "gt.csv"
    path.touch()
    os.truncate(path, 10 << 30)
    with pytest.raises(InputError, match=f"^{path}: larger than"):
        read_stamped_rows(path, 7, ",")


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
