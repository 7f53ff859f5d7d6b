"""Ranks methods by their means over conditions."""

from __future__ import annotations

from collections.abc import Iterable
import math
from typing import NamedTuple
import zlib

import numpy as np
from scipy.special import stdtrit

from evaluation.recognition.bootstrap import (
    UNKNOWN,
    Interval,
    resampled_weights,
)
from evaluation.results.ranges import Range, range_of
from evaluation.results.table import Row

# Least number of maps or conditions whose spread gives a mean an interval.
LEAST_UNITS = 4


class Ranked(NamedTuple):
    """A method's mean of a metric over conditions, with a 95 % interval."""

    method: str
    value: float
    interval: Interval


def rank_methods(
    rows: Iterable[Row], *, least_first: bool = False
) -> tuple[list[Ranked], np.ndarray]:
    """Returns methods ranked by their means over conditions.

    Only conditions that were measured with all methods count. The intervals of
    the means are t intervals. The independent units of the intervals are maps
    if there are several maps, and conditions otherwise. Intervals are limited
    to the metric's range. With two or three units, intervals are unknown,
    because they would be too wide to be useful. The bootstrap samples contain
    the same units for all methods and for all tables of the same maps; tables
    of other maps are sampled independently. For a single condition, the
    intervals come from the rows.

    Args:
        rows: rows of one metric.
        least_first: whether a smaller value is better, so that the least value
            comes first.

    Returns:
        The M methods, the best first; and (B, M) the mean of each method in
        each bootstrap sample. Both are empty if no condition counts.
    """
    table: dict[tuple, dict[str, Row]] = {}
    for row in rows:
        if not math.isnan(row.value):
            table.setdefault(row.without("method"), {})[row.label] = row
    methods = {name for some in table.values() for name in some}
    common = [some for some in table.values() if len(some) == len(methods)]
    if not common:
        return [], np.empty((0, 0))
    names = sorted(methods)
    values = np.array([[some[n].value for n in names] for some in common])
    of_map = [some[names[0]].map for some in common]
    units = of_map if len(set(of_map)) > 1 else list(range(len(common)))
    _, numbered = np.unique(units, return_inverse=True)
    seed = zlib.crc32(" ".join(sorted(set(of_map))).encode())
    weights = resampled_weights(len(common), seed, numbered)
    with np.errstate(invalid="ignore"):
        samples = weights @ values / weights.sum(axis=1, keepdims=True)
    means = values.mean(axis=0)
    first = common[0]
    intervals = [Interval(first[n].low, first[n].high) for n in names]
    number = int(numbered.max()) + 1
    if number > 1:
        intervals = [UNKNOWN] * len(names)
    if number >= LEAST_UNITS:
        is_in = numbered == np.arange(number)[:, None]
        squares = ((is_in @ (values - means)) ** 2).sum(axis=0)
        spreads = np.sqrt(number / (number - 1) * squares) / len(common)
        margins = stdtrit(number - 1, 0.975) * spreads
        ends = np.clip(
            [means - margins, means + margins],
            *(range_of(first[names[0]].metric) or Range())[:2],
        )
        intervals = [Interval(*pair) for pair in ends.T.tolist()]
    found = [
        Ranked(*one)
        for one in zip(names, means.tolist(), intervals, strict=True)
    ]
    sign = 1.0 if least_first else -1.0
    order = sorted(
        range(len(names)), key=lambda k: (sign * found[k].value, names[k])
    )
    return [found[k] for k in order], samples[:, order]
