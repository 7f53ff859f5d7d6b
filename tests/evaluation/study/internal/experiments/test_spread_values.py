"""Evenly spaced values, against NumPy's."""

import numpy as np
import pytest

from evaluation.study.experiments.factors import expand_spread


@pytest.mark.parametrize(
    ("first", "last", "count", "kind"),
    [
        (0, 1000, 3, int),
        (5, 1, 5, int),
        (7, 7, 2, int),
        (0, 10, 4, float),
        (0.0, 10, 3, float),
        (0, 0.6, 20, float),
        (-1.5, 2.25, 9_999, float),
    ],
)
def test_numbers_are_spread_evenly(first, last, count, kind):
    found = expand_spread({"from": first, "to": last, "count": count})
    assert {type(one) for one in found} == {kind}
    line = np.linspace(first, last, count)
    np.testing.assert_allclose(found, line, rtol=0, atol=0.5001e-4)
    assert (found[0], found[-1], len(found)) == (first, last, count)
