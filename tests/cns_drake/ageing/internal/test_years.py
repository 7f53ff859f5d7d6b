"""The years of an ageing city: ascending, and within bounds."""

import pytest

from cns_drake.ageing import LAST_YEAR
from cns_drake.ageing.aged_map import check_years
from cns_drake.base import InputError


def test_years_up_to_the_bounds():
    years = (-LAST_YEAR, 0, LAST_YEAR)
    assert check_years(iter(years)) == years


@pytest.mark.parametrize(
    "years", [[], [2, 2], [5, 1], [1, 201], [-201, 0]], ids=str
)
def test_faulty_years(years):
    with pytest.raises(InputError, match="--years"):
        check_years(years)
