"""Curves are drawn where there are points, and stay among them."""

import numpy as np
import pytest

from evaluation.results import Results, Row, draw_chart


def curves(x, y):
    """The curves (N, 2) of a scatter plot of a method's AUC over x."""
    rows = [
        Row(
            "e", "town", "a", "b", 1, {"query.x": float(at), "query.number": k},
            "place", "mine", False, "own", "auc", float(value),
        )
        for k, (at, value) in enumerate(zip(x, y, strict=True))
    ]  # fmt: skip
    chart = {"kind": "scatter", "x": "query.x", "y": "auc"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    _, *found = axes.get_lines()
    return [line.get_xydata() for line in found]


def test_no_curve_crosses_a_gap():
    """Three controls and three pairs of a city: the case of a report."""
    x = np.array([0.006, 0.009, 0.014, 0.25, 0.27, 0.29])
    y = np.array([0.98, 1.0, 0.99, 0.2, 0.9, 0.5])
    assert curves(x, y) == []
    # With more points, each side has a curve of its own.
    sides = [np.linspace(*ends, 7) for ends in ((0.0, 0.1), (0.3, 0.4))]
    x = np.concatenate(sides)
    found = curves(x, 1.0 - x)
    ends = [(one[0, 0], one[-1, 0]) for one in found]
    assert ends == [(0.0, 0.1), (0.3, 0.4)]
    for one in found:
        np.testing.assert_allclose(one[:, 1], 1.0 - one[:, 0])


@pytest.mark.parametrize("seed", range(5))
def test_a_curve_stays_among_its_points(seed):
    """A regression alone would leave their range at a steep end."""
    rng = np.random.default_rng(seed)
    rough = np.sort(rng.random(12)) ** 3, rng.integers(2, size=12)
    steep = np.linspace(0.0, 1.0, 9)
    for x, y in (rough, (steep, np.where(steep < 0.7, 1.0, 0.0))):
        for one in curves(x, y):
            inside = (x >= one[0, 0]) & (x <= one[-1, 0])
            assert inside.sum() >= 5
            assert one[:, 1].min() >= y[inside].min()
            assert one[:, 1].max() <= y[inside].max()


def test_points_without_a_range_have_no_curve():
    assert curves(np.full(7, 0.5), np.ones(7)) == []


def test_the_order_of_points_does_not_matter():
    x = np.linspace(0.0, 1.0, 9)
    y = np.cos(1.5 * x)
    shuffled = np.random.default_rng(0).permutation(9)
    (one,), (other,) = (curves(x[o], y[o]) for o in (np.arange(9), shuffled))
    np.testing.assert_array_equal(one, other)
