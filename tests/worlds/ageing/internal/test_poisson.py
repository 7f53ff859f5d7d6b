"""Rates from files, and counts of events."""

import numpy as np
import pytest

from worlds.ageing.rates import Tally, poisson_p


def test_poisson_p():
    # P(N >= 9 | 4) = 0.02136, by summing the series.
    terms = [4.0**0]
    for k in range(1, 9):
        terms.append(terms[-1] * 4 / k)
    tail = 1.0 - np.exp(-4.0) * sum(terms)
    assert poisson_p(9, 4.0) == pytest.approx(2 * tail)
    assert poisson_p(4, 4.0) == 1.0
    tally = Tally({"lamps": 0.5})
    tally.count("lamps", 0.5, True, 1)
    assert "lamps,0.5,1,0.500,1,1.000000" in tally.to_csv()
