"""Curves are drawn where there are points, and stay among them."""

import numpy as np
import pytest

from evaluation.results.charts.scatter import curves, smooth


def test_no_curve_crosses_a_gap():
    """Three controls and three pairs of a city: the case of a report."""
    x = np.array([0.006, 0.009, 0.014, 0.25, 0.27, 0.29])
    y = np.array([0.98, 1.0, 0.99, 0.2, 0.9, 0.5])
    assert list(curves(x, y)) == []
    # With more points, each side has a curve of its own.
    sides = [np.linspace(*ends, 7) for ends in ((0.0, 0.1), (0.3, 0.4))]
    x = np.concatenate(sides)
    found = list(curves(x, 1.0 - x))
    assert [(one.x[0], one.x[-1]) for one in found] == [(0.0, 0.1), (0.3, 0.4)]
    for one in found:
        np.testing.assert_allclose(one.y, 1.0 - one.x)


@pytest.mark.parametrize("seed", range(20))
def test_a_curve_stays_among_its_points(seed):
    rng = np.random.default_rng(seed)
    x = np.sort(rng.random(12)) ** 3
    y = np.where(rng.random(12) < 0.5, 0.0, 1.0)
    for one in curves(x, y):
        inside = (x >= one.x[0]) & (x <= one.x[-1])
        assert inside.sum() >= 5
        assert one.y.min() >= y[inside].min()
        assert one.y.max() <= y[inside].max()


def test_a_regression_alone_would_leave_their_range():
    """Why curves are limited: the slope of a steep end overshoots."""
    x = np.linspace(0.0, 1.0, 9)
    y = np.where(x < 0.7, 1.0, 0.0)
    (one,) = curves(x, y)
    assert smooth(x, y, one.x, 0.15).min() < -0.03
    assert one.y.min() == 0.0


@pytest.mark.parametrize("x", [[], [0.5], [0.5] * 7])
def test_points_without_a_range_have_no_curve(x):
    assert list(curves(np.array(x), np.ones(len(x)))) == []


def test_the_order_of_points_does_not_matter():
    x = np.linspace(0.0, 1.0, 9)
    y = np.cos(3.0 * x)
    shuffled = np.random.default_rng(0).permutation(9)
    (one,), (other,) = (
        list(curves(x[order], y[order])) for order in (np.arange(9), shuffled)
    )
    np.testing.assert_array_equal(one.y, other.y)
