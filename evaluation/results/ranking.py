"""Ranks methods by their means over conditions."""

from __future__ import annotations

from collections.abc import Iterable
import math
from typing import NamedTuple
import zlib

import numpy as np
from scipy.special import stdtrit

from evaluation.recognition import (
    UNKNOWN,
    Interval,
    Metric,
    metric_named,
    resampled_weights,
)
from evaluation.results.table import Row

# Least number of maps or conditions whose spread gives a mean an interval.
LEAST_UNITS = 4


class Ranked(NamedTuple):
    """A method's mean of a metric over conditions, with a 95 % interval."""

    method: str
    value: float
    interval: Interval


def rank_methods(rows: Iterable[Row]) -> tuple[list[Ranked], np.ndarray]:
    """Returns methods ranked by their means over conditions.

    The least mean is the best if less of the metric is better.

    Only conditions that were measured with all methods count, and of these only
    those in which the values of all methods are defined. The intervals of
    the means are t intervals. The independent units of the intervals are maps
    if there are several maps, and conditions otherwise. Intervals are limited
    to the metric's range. With two or three units, intervals are unknown,
    because they would be too wide to be useful. Each bootstrap sample contains
    the same units for all methods and for all tables of the same maps; tables
    of other maps are sampled independently. For a single condition, the
    intervals come from the rows.

    Args:
        rows: rows of one metric.

    Returns:
        The M methods, the best first; and (B, M) the mean of each method in
        each bootstrap sample. Both are empty if no condition counts.
    """
    common = _common_conditions(rows)
    if not common:
        return [], np.empty((0, 0))
    names = sorted(common[0])
    values = np.array(
        [[by_method[n].value for n in names] for by_method in common]
    )
    of_map = [by_method[names[0]].map for by_method in common]
    units = of_map if len(set(of_map)) > 1 else list(range(len(common)))
    _, unit_of_row = np.unique(units, return_inverse=True)
    seed = zlib.crc32(" ".join(sorted(set(of_map))).encode())
    weights = resampled_weights(len(common), seed, unit_of_row)
    with np.errstate(invalid="ignore"):
        samples = weights @ values / weights.sum(axis=1, keepdims=True)
    first = [common[0][name] for name in names]
    metric = metric_named(first[0].metric)
    number = len(set(units))
    if number == 1:
        intervals = [Interval(row.low, row.high) for row in first]
    elif number < LEAST_UNITS:
        intervals = [UNKNOWN] * len(names)
    else:
        intervals = _t_intervals(values, unit_of_row, metric)
    means = values.mean(axis=0).tolist()
    found = [
        Ranked(*columns)
        for columns in zip(names, means, intervals, strict=True)
    ]
    sign = 1.0 if metric.better == "less" else -1.0
    order = sorted(
        range(len(names)), key=lambda k: (sign * found[k].value, names[k])
    )
    return [found[k] for k in order], samples[:, order]


def _common_conditions(rows: Iterable[Row]) -> list[dict[str, Row]]:
    """Returns method -> row of each condition measured with all methods."""
    table: dict[tuple, dict[str, Row]] = {}
    for row in rows:
        if not math.isnan(row.value):
            table.setdefault(row.without("method"), {})[row.label] = row
    methods = {name for by_method in table.values() for name in by_method}
    return [
        by_method
        for by_method in table.values()
        if len(by_method) == len(methods)
    ]


def _t_intervals(
    values: np.ndarray, unit_of_row: np.ndarray, metric: Metric
) -> list[Interval]:
    """Returns the 95 % t interval of the mean of each column.

    The standard error of a column's mean m is clustered by units: with N rows
    x_i in G units, it is sqrt(G / (G - 1) * sum_g (sum_{i in g} (x_i - m))^2)
    / N, and the t distribution has G - 1 degrees of freedom (Cameron and
    Miller, Journal of Human Resources 50, 2015).

    Args:
        values: (N, M) values.
        unit_of_row: (N,) number of each row's unit, from 0 to G - 1.
        metric: the metric, to whose range the intervals are limited.
    """
    means = values.mean(axis=0)
    number = int(unit_of_row.max()) + 1
    is_in = unit_of_row == np.arange(number)[:, None]
    squares = ((is_in @ (values - means)) ** 2).sum(axis=0)
    errors = np.sqrt(number / (number - 1) * squares) / len(values)
    margins = stdtrit(number - 1, 0.975) * errors
    ends = np.clip(
        [means - margins, means + margins], metric.least, metric.greatest
    )
    return [Interval(*pair) for pair in ends.T.tolist()]
