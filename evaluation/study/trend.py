"""How place recognition depends on structural change, over many databases.

One drive asks, many others, of more or less changed cities, are its database
in turn: every pair gives a TCR_sym and, for each method, an AUC.
"""

from __future__ import annotations

from collections.abc import Sequence
import csv
from dataclasses import astuple, fields
import io
from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from evaluation.report.drawing import method_style, plain, save
from evaluation.report.result_tables import in_paper_order, title
from evaluation.study.trend_points import TrendPoint
from evaluation.support.files import completing, make_folder

# Of the kernel that smooths over TCR_sym, as part of its range; and how the
# band is found: by drawing databases with replacement.
_BANDWIDTH = 0.15
_RESAMPLES = 1000
_LEAST_POINTS = 5
_GRID = 60


def write_trend(points: Sequence[TrendPoint], folder: Path) -> Path:
    """Writes `trend.csv` and the figure `trend`; returns the table's path.

    Raises:
        InputError: a file cannot be written.
    """
    make_folder(folder)
    path = folder / "trend.csv"
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(field.name for field in fields(TrendPoint))
    for point in points:
        table.writerow(
            f"{value:.6f}" if isinstance(value, float) else value
            for value in astuple(point)
        )
    with completing(path) as part:
        part.write_text(out.getvalue(), encoding="utf-8")
    draw_trend(points, folder / "trend")
    return path


def draw_trend(points: Sequence[TrendPoint], stem: Path) -> None:
    """Draws AUC over TCR_sym: points, a smooth line and its 95 % band.

    Args:
        points: of all databases and methods.
        stem: path to write, without ending.
    """
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    axes = figure.subplots()
    for method in in_paper_order(point.method for point in points):
        colour, style, marker = method_style(method)
        x, y = np.array(
            sorted((p.tcr_sym, p.auc) for p in points if p.method == method)
        ).T
        axes.plot(x, y, marker, color=colour, markersize=3.5, alpha=0.55, mew=0)
        if len(x) < _LEAST_POINTS or np.ptp(x) == 0.0:
            axes.plot([], [], style, color=colour, label=plain(title(method)))
            continue
        grid = np.linspace(x[0], x[-1], _GRID)
        low, high = smooth_band(x, y, grid)
        axes.fill_between(grid, low, high, color=colour, alpha=0.18, lw=0)
        axes.plot(
            grid,
            smooth(x, y, grid),
            style,
            color=colour,
            label=plain(title(method)),
        )
    axes.set(xlabel=r"TCR$_\mathrm{sym}$", ylabel="AUC", ylim=(0.0, 1.02))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, framealpha=0.8)
    save(figure, stem, "svg")


def smooth(x: np.ndarray, y: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Returns the local linear regression of y over x at places.

    Gaussian weights; Fan and Gijbels, Local Polynomial Modelling (1996),
    equation 3.1 with p = 1.

    Args:
        x, y: (N,) points; x not all equal.
        grid: (M,) places.
    """
    width = _BANDWIDTH * max(np.ptp(grid), 1e-12)
    offset = x[None, :] - grid[:, None]
    weight = np.exp(-0.5 * (offset / width) ** 2)
    s0, s1, s2 = ((weight * offset**power).sum(axis=1) for power in (0, 1, 2))
    t0, t1 = ((weight * offset**power) @ y for power in (0, 1))
    determinant = s0 * s2 - s1**2
    # With one distinct place only, the mean is all that there is.
    flat = determinant <= 1e-12 * s0 * width**2 * s0
    safe = np.where(flat, 1.0, determinant)
    return np.where(flat, t0 / s0, (s2 * t0 - s1 * t1) / safe)


def smooth_band(
    x: np.ndarray, y: np.ndarray, grid: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the 95 % band of `smooth` by resampling points."""
    rng = np.random.default_rng(0)
    curves = np.empty((_RESAMPLES, len(grid)))
    for k in range(_RESAMPLES):
        drawn = rng.integers(len(x), size=len(x))
        curves[k] = smooth(x[drawn], y[drawn], grid)
    low, high = np.percentile(curves, [2.5, 97.5], axis=0)
    return low, high
