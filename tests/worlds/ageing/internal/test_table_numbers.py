"""Numbers in the tables of a map."""

import pytest

from evaluation.base import InputError
from worlds.ageing.old_world import _number_within


def test_numbers_up_to_a_size():
    assert _number_within("-2e0", 2.0, "x") == -2.0
    for text in (
        "",
        "abc",
        "nan",
        "inf",
        "-inf",
        "2.0000001",
        "1e1000000",
        "1_0",
        "٢",
    ):
        with pytest.raises(InputError, match=r"^x: .* is no number up to 2"):
            _number_within(text, 2.0, "x")
