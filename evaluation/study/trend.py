"""Place recognition over structural change, with many databases.

One query drive is compared with many databases, from cities that changed more
or less. Each pair gives a TCR_sym and, for each method, an AUC.
"""

from collections.abc import Callable, Sequence
import math
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from scipy.stats import rankdata

from cns_drake.base.files import make_folder
from evaluation.recognition.metrics import percentile_interval
from evaluation.recognition.protocol import check_one_protocol
from evaluation.report import tables
from evaluation.report.drawing import method_entry, method_style, save
from evaluation.study.trend_databases import TrendPoint

# Width of the kernel that smooths over TCR_sym, as part of its range. The band
# comes from drawing databases with replacement. Fewer points than the least are
# joined by straight lines.
_BANDWIDTH = 0.15
_RESAMPLES = 1000
_LEAST_POINTS = 5
_GRID = 60
# Columns of the table, apart from those of the protocol.
_NUMBERS = (
    "database",
    "method",
    "tcr_sym",
    "auc",
    "auc_low",
    "auc_high",
    "recall_at_1",
    "queries",
    "with_match",
    "auc_unchanged",
    "kept",
    "visible_change",
)
# Measures of change: attribute of a point -> its name on an axis.
_CHANGES = {
    "tcr_sym": r"TCR$_\mathrm{sym}$",
    "visible_change": "visible change",
}


def write_trend(points: Sequence[TrendPoint], folder: Path) -> Path:
    """Writes `trend.csv`, `correlations.csv` and figures.

    The figures are `trend`, and `visible_change`: what fails over TCR_sym and
    over visible change.

    Returns:
        The path of `trend.csv`.

    Raises:
        InputError: a file cannot be written, or points are of two protocols.
    """
    make_folder(folder)
    path = folder / "trend.csv"
    check_one_protocol(point.protocol for point in points)
    numbers: tables.Columns[TrendPoint] = tables.keyed(
        {name: name for name in _NUMBERS},
        lambda point, name: _rounded(getattr(point, name)),
    )
    strict: tables.Columns[TrendPoint] = {
        "auc_strict": lambda point: _rounded(point.auc_strict)
    }
    columns = {**numbers, **tables.protocol_columns("protocol"), **strict}
    table = tables.Table.of(points, columns)
    table.write_csv(path)
    correlation_table(points).write_csv(folder / "correlations.csv")
    draw_trend(points, folder / "trend")
    _draw_failures(points, folder / "visible_change")
    return path


def correlation_table(points: Sequence[TrendPoint]) -> tables.Table:
    """Returns how well each measure of change predicts each method's failure.

    A row has Spearman's rank correlation of 1 - AUC with TCR_sym and with the
    visible change over all databases, with 95 % intervals by bootstrap over
    databases, and the interval of the difference of the two.
    """
    rows: list[tuple[object, ...]] = []
    for method in tables.in_table_order(point.method for point in points):
        known = np.array(
            [
                (one.failure, *(getattr(one, name) for name in _CHANGES))
                for one in points
                if one.method == method
            ]
        )
        known = known[~np.isnan(known).any(axis=1)]
        if len(known) == 0:
            continue
        rng = np.random.default_rng(0)
        draws = rng.integers(len(known), size=(_RESAMPLES, len(known)))
        found = _correlations(known)
        samples = _correlations(known[draws])
        cells: list[object] = [method, len(known)]
        for value, sampled in (
            *zip(found, samples.T, strict=True),
            (found[1] - found[0], samples[:, 1] - samples[:, 0]),
        ):
            interval = percentile_interval(sampled)
            cells += [
                _rounded(number)
                for number in (float(value), interval.low, interval.high)
            ]
        rows.append(tuple(cells))
    names = ("rho_tcr_sym", "rho_visible_change", "difference")
    return tables.Table(
        (
            *("method", "databases"),
            *(
                f"{name}{end}"
                for name in names
                for end in ("", "_low", "_high")
            ),
        ),
        tuple(rows),
    )


def _correlations(values: np.ndarray) -> np.ndarray:
    """Returns Spearman's correlation of the first column with the others.

    Values are (..., N, C), correlations (..., C - 1); NaN where a column is
    constant.
    """
    ranks = rankdata(values, axis=-2)
    ranks -= ranks.mean(axis=-2, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        ranks /= np.linalg.norm(ranks, axis=-2, keepdims=True)
    return (ranks[..., :1] * ranks[..., 1:]).sum(axis=-2)


def _rounded(value: object) -> object:
    if not isinstance(value, float) or math.isnan(value):
        return value
    return f"{value:.6f}"


def draw_trend(points: Sequence[TrendPoint], stem: Path) -> None:
    """Draws AUC over TCR_sym: points, a line and its 95 % band.

    The line is smooth, or straight from point to point where points are few.

    A second panel shows the kept share of AUC, if databases have controls.
    """
    survives = any(not math.isnan(point.kept) for point in points)
    number = 2 if survives else 1
    width = 12.0 if survives else 6.4
    figure = Figure(figsize=(width, 4.4), layout="constrained")
    panels = figure.subplots(1, number, squeeze=False)[0]
    _draw_panel(panels[0], points, "AUC", lambda point: point.auc)
    panels[0].set_ylim(0.0, 1.02)
    if survives:
        label = "share of AUC that is kept"
        _draw_panel(panels[1], points, label, lambda point: point.kept)
        panels[1].set_ylim(bottom=0.0)
        panels[1].axhline(1.0, color="gray", linewidth=0.8)
    _save(figure, points, stem)


def _draw_failures(points: Sequence[TrendPoint], stem: Path) -> None:
    """Draws what fails over both measures of change."""
    figure = Figure(figsize=(12.0, 4.4), layout="constrained")
    panels = figure.subplots(1, len(_CHANGES), sharey=True)
    for axes, change in zip(panels, _CHANGES, strict=True):
        _draw_panel(axes, points, "1 - AUC", lambda one: one.failure, change)
        axes.set_ylim(-0.02, 1.02)
    _save(figure, points, stem)


def _save(figure: Figure, points: Sequence[TrendPoint], stem: Path) -> None:
    """Writes a figure with the methods in the legend of its first panel."""
    handles = [
        method_entry(method, with_line=True)
        for method in tables.in_table_order(point.method for point in points)
    ]
    figure.axes[0].legend(handles=handles, fontsize=8, framealpha=0.8)
    save(figure, stem)


def _draw_panel(
    axes: Axes,
    points: Sequence[TrendPoint],
    label: str,
    value: Callable[[TrendPoint], float],
    change: str = "tcr_sym",
) -> None:
    for method in tables.in_table_order(point.method for point in points):
        colour, style, marker = method_style(method)
        known = sorted(
            (getattr(p, change), value(p))
            for p in points
            if p.method == method
            and not math.isnan(value(p) + getattr(p, change))
        )
        if not known:
            continue
        x, y = np.array(known).T
        axes.plot(x, y, marker, color=colour, markersize=3.5, alpha=0.55, mew=0)
        if np.ptp(x) == 0.0:
            continue
        if len(x) < _LEAST_POINTS:
            axes.plot(x, y, style, color=colour)
            continue
        grid = np.linspace(x[0], x[-1], _GRID)
        low, high = smooth_band(x, y, grid)
        axes.fill_between(grid, low, high, color=colour, alpha=0.18, lw=0)
        axes.plot(grid, smooth(x, y, grid), style, color=colour)
    axes.set(xlabel=_CHANGES[change], ylabel=label)
    axes.grid(alpha=0.3)


def smooth(x: np.ndarray, y: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Returns the local linear regression of y over x at places (M,).

    Not all x are equal. Gaussian weights; Fan and Gijbels, Local Polynomial
    Modelling (1996), equation 3.1 with p = 1.
    """
    width = _BANDWIDTH * max(np.ptp(grid), 1e-12)
    offset = x[None, :] - grid[:, None]
    weight = np.exp(-0.5 * (offset / width) ** 2)
    s0, s1, s2 = ((weight * offset**power).sum(axis=1) for power in (0, 1, 2))
    t0, t1 = ((weight * offset**power) @ y for power in (0, 1))
    determinant = s0 * s2 - s1**2
    # One distinct value of x has no slope, only a mean.
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
