"""Smooth curves through points, drawn only where there are points."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from evaluation.results.summaries import LEAST_POINTS

# Width of the Gaussian weights, as a part of the range of x.
_BANDWIDTH = 0.15
# Widest gap that a curve crosses: two widths, so that no part of it is farther
# than one width from a point.
_WIDEST_GAP = 2.0
# Number of bootstrap samples of a curve.
_RESAMPLES = 1000
# Number of points of a curve over the whole range of x.
_GRID = 60


class Curve(NamedTuple):
    """A smooth curve through a run of points without gaps, and its 95 % band.

    Attributes:
        x: (M,) coordinates of the curve.
        y: (M,) the curve.
        low, high: (M,) limits of its band.
    """

    x: np.ndarray
    y: np.ndarray
    low: np.ndarray
    high: np.ndarray


def curves(x: np.ndarray, y: np.ndarray) -> Iterator[Curve]:
    """Yields curves through points, one for each run of points without a gap.

    Runs of fewer than five points, or with a single x, have no curve. A curve
    is a local linear regression, and its band is by bootstrap over the points
    of the run. Curve and band are limited to the range from the least to the
    greatest y of the run, because values outside of this range were not
    measured, and may be impossible.

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
        draws = np.random.default_rng(0).integers(
            len(at), size=(_RESAMPLES, len(at))
        )
        counts = np.stack([np.bincount(d, minlength=len(at)) for d in draws])
        samples = smooth(at, values, grid, width, counts)
        low, high = np.percentile(samples, [2.5, 97.5], axis=0)
        shown = smooth(at, values, grid, width), low, high
        limits = values.min(), values.max()
        yield Curve(grid, *(np.clip(one, *limits) for one in shown))


def smooth(
    x: np.ndarray,
    y: np.ndarray,
    grid: np.ndarray,
    width: float,
    counts: np.ndarray | None = None,
) -> np.ndarray:
    """Returns the local linear regression of y over x, with Gaussian weights.

    Source: Fan and Gijbels, Local Polynomial Modelling, 1996, equation 3.1 with
    p = 1.

    Args:
        x, y: (N,) coordinates of the points.
        grid: (M,) values of x at which the regression is computed.
        width: standard deviation of the weights, in units of x.
        counts: (B, N) how often each point counts in each of B samples; None if
            each point counts once.

    Returns:
        (M,) values of the regression; with `counts`, (B, M).
    """
    counts = np.ones(len(x)) if counts is None else counts
    offset = x[:, None] - grid[None, :]
    weight = np.exp(-0.5 * (offset / width) ** 2)
    s0, s1, s2 = (counts @ (weight * offset**power) for power in (0, 1, 2))
    t0, t1 = ((counts * y) @ (weight * offset**power) for power in (0, 1))
    determinant = s0 * s2 - s1**2
    # One distinct value of x has no slope, only a mean.
    flat = determinant <= 1e-12 * s0 * width**2 * s0
    safe = np.where(flat, 1.0, determinant)
    return np.where(flat, t0 / s0, (s2 * t0 - s1 * t1) / safe)
