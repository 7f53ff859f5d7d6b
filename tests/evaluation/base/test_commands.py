"""Options of commands."""

import math

import pytest

from evaluation.base import InputError
from evaluation.base.commands import check_finite


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_options_are_finite_numbers(value):
    check_finite({"far": 1e308, "name": "nan", "count": 3, "x": None})
    with pytest.raises(InputError, match=rf"^--max-range: {value} is not"):
        check_finite({"max_range": value})
    with pytest.raises(InputError, match=r"^--pose: "):
        check_finite({"pose": (0.0, value)})
