"""Ranks methods by their means over conditions."""

from collections.abc import Iterable
import math
from typing import NamedTuple

import numpy as np

from evaluation.recognition import Interval, city_interval, metric_named
from evaluation.results.table import Row


class Ranked(NamedTuple):
    """A method's mean of a metric over conditions, with a 95 % interval."""

    method: str
    value: float
    interval: Interval


def rank_methods(rows: Iterable[Row]) -> list[Ranked]:
    """Returns methods ranked by their means over conditions, the best first.

    The least mean is the best if less of the metric is better.

    Only conditions that were measured with all methods count, and of these only
    those in which the values of all methods are defined. The intervals are for
    means over all possible maps, see `city_interval`: the maps are the
    independent units, because conditions of one map share its streets. With
    fewer than eight maps, intervals are unknown. For a single condition, the
    intervals come from the rows.

    Args:
        rows: rows of one metric.

    Returns:
        The M methods; empty if no condition counts.
    """
    common = common_conditions(rows)
    if not common:
        return []
    names = sorted(common[0])
    values = np.array(
        [[by_method[n].value for n in names] for by_method in common]
    )
    of_map = [by_method[names[0]].map for by_method in common]
    maps, map_of_row = np.unique(of_map, return_inverse=True)
    first = [common[0][name] for name in names]
    metric = metric_named(first[0].metric)
    if len(common) == 1:
        intervals = [Interval(row.low, row.high) for row in first]
    else:
        is_in = (map_of_row == np.arange(len(maps))[:, None]).astype(float)
        weights = is_in.sum(axis=1)
        intervals = []
        for column in values.T:
            greatest = metric.greatest
            if metric.share_of:
                # Where no map retains more, no map is taken to.
                greatest = max(1.0, float((is_in @ column / weights).max()))
            ends = metric.least, greatest
            intervals.append(city_interval(is_in @ column, weights, ends))
    found = [
        Ranked(*columns)
        for columns in zip(
            names, values.mean(axis=0).tolist(), intervals, strict=True
        )
    ]
    sign = 1.0 if metric.better == "less" else -1.0
    return sorted(found, key=lambda one: (sign * one.value, one.method))


def common_conditions(rows: Iterable[Row]) -> list[dict[str, Row]]:
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
