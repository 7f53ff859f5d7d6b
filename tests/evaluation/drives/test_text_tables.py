"""Tables of text as other programs write them."""

import os

import numpy as np
import pytest

from cns_drake.base.errors import InputError
from evaluation.drives.text_tables import read_numbers, read_stamped_rows


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (b",\n", "no row of numbers"),
        (b" , ,\n1 2\n", ""),
        (b"time,x\n", "no row of numbers"),
        (b"", "no row of numbers"),
        (b"\xff\n", "not UTF-8 text"),
        (b"1 2\n3\n", "row 2: 1 numbers instead of 2"),
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
