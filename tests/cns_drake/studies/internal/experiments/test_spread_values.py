"""Evenly spaced values, against NumPy's."""

import numpy as np
import pytest

from cns_drake.studies.experiments.spread_values import expand_spread


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


@pytest.mark.parametrize(
    "value", [[1, 2], 3, "a", {}, {"from": 1, "to": 2}, None]
)
def test_other_values_stay(value):
    assert expand_spread(value) is value


@pytest.mark.parametrize(
    "value",
    [(0, 1, 1), (0, 1, 10_001), (0, 1, 2.0), (True, 2, 2), (0, "1", 2)]
    + [(0, float(end), 3) for end in ("inf", "nan")],
)
def test_what_cannot_be_expand_spread(value):
    with pytest.raises(ValueError, match="from and to are numbers, count from"):
        expand_spread(dict(zip(("from", "to", "count"), value, strict=True)))


@pytest.mark.parametrize("ends", [(0, 1), (0.0, 2), (1, 2.5)])
def test_seeds_are_whole(ends):
    value = {"from": ends[0], "to": ends[1], "count": 3}
    assert len(expand_spread(value)) == 3
    with pytest.raises(
        ValueError, match=r"3 numbers from .* are not all whole"
    ):
        expand_spread(value, whole=True)
