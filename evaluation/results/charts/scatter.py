"""Scatter: a metric over another metric or a numeric factor."""

from collections.abc import Iterator
from typing import NamedTuple

from matplotlib.figure import Figure
import numpy as np

from evaluation.base import InputError
from evaluation.results.charts.chart import Chart, FewPointsError, start_at_zero
from evaluation.results.charts.words import in_words
from evaluation.results.figure_text import escape_dollars
from evaluation.results.method_names import title
from evaluation.results.summaries import LEAST_POINTS, paired_values


def draw_scatter(chart: Chart) -> Figure:
    """Returns the chart."""
    x_name, y_name = chart.keys["x"], chart.keys["y"]
    shown = {row.identity for row in chart.rows}
    points = [
        (row, at)
        for row, at in paired_values(chart.results, x_name, y_name)
        if row.identity in shown
    ]
    if not points:
        raise InputError(f"charts: scatter: no {y_name} has a {x_name}")
    number = len({row.without("method") for row, _ in points})
    if number < LEAST_POINTS:
        raise FewPointsError(
            f"a trend of {in_words(y_name)} over {in_words(x_name)} needs"
            f" {LEAST_POINTS} pairs of drives or more, not {number}"
        )
    figure = chart.figure(380.0)
    axes = figure.subplots()
    for label, (colour, style, marker) in chart.styles.items():
        known = sorted(
            (at, row.value) for row, at in points if title(row.label) == label
        )
        if not known:
            continue
        x, y = np.array(known).T
        axes.plot(x, y, marker, color=colour, mew=0, alpha=0.55)
        for curve in curves(x, y):
            axes.plot(curve.x, curve.y, style, color=colour)
    axes.set(
        xlabel=escape_dollars(in_words(x_name)),
        ylabel=escape_dollars(in_words(y_name)),
    )
    start_at_zero(axes, x=x_name, y=y_name)
    # On a phone there is room for a few numbers.
    axes.locator_params(axis="x", nbins=6)
    axes.grid()
    return figure


# Width of the Gaussian weights, as a part of the range of x.
_BANDWIDTH = 0.15
# Widest gap that a curve crosses: two widths, so that no part of it is farther
# than one width from a point.
_WIDEST_GAP = 2.0
# Number of points of a curve over the whole range of x.
_GRID = 60


class _Curve(NamedTuple):
    """A smooth curve through a run of points without gaps.

    Attributes:
        x: (M,) coordinates of the curve.
        y: (M,) the curve.
    """

    x: np.ndarray
    y: np.ndarray


def curves(x: np.ndarray, y: np.ndarray) -> Iterator[_Curve]:
    """Yields curves through points, one for each run of points without a gap.

    Runs of fewer than five points, or with a single x, have no curve. A curve
    is a local linear regression. It is limited to the range from the least to
    the greatest y of the run, because values outside of this range were not
    measured, and may be impossible. It has no band: conditions of one map share
    its streets, so points are not independent.

    Args:
        x, y: (N,) coordinates of the points.
    """
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    span = float(np.ptp(x)) if len(x) else 0.0
    width = _BANDWIDTH * span
    ends = np.flatnonzero(np.diff(x) > _WIDEST_GAP * width) + 1
    for at, values in zip(np.split(x, ends), np.split(y, ends), strict=True):
        if len(at) < LEAST_POINTS or np.ptp(at) == 0.0:
            continue
        number = max(2, round(_GRID * float(np.ptp(at)) / span))
        grid = np.linspace(at[0], at[-1], number)
        shown = smooth(at, values, grid, width)
        yield _Curve(grid, np.clip(shown, values.min(), values.max()))


def smooth(
    x: np.ndarray,
    y: np.ndarray,
    grid: np.ndarray,
    width: float,
) -> np.ndarray:
    """Returns the local linear regression of y over x, with Gaussian weights.

    Source: Fan and Gijbels, Local Polynomial Modelling, 1996, equation 3.1 with
    p = 1.

    Args:
        x, y: (N,) coordinates of the points.
        grid: (M,) values of x at which the regression is computed.
        width: standard deviation of the weights, in units of x.

    Returns:
        (M,) values of the regression.
    """
    offset = x[:, None] - grid[None, :]
    weight = np.exp(-0.5 * (offset / width) ** 2)
    s0, s1, s2 = ((weight * offset**power).sum(axis=0) for power in (0, 1, 2))
    t0, t1 = (y @ (weight * offset**power) for power in (0, 1))
    determinant = s0 * s2 - s1**2
    # One distinct value of x has no slope, only a mean.
    flat = determinant <= 1e-12 * s0 * width**2 * s0
    safe = np.where(flat, 1.0, determinant)
    return np.where(flat, t0 / s0, (s2 * t0 - s1 * t1) / safe)
