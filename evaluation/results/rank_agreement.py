"""How similarly two tables rank the methods that are in both."""

from collections.abc import Sequence
import itertools
from typing import NamedTuple
import warnings

import numpy as np
from scipy.stats import kendalltau

from cns_drake.base import InputError
from evaluation.recognition import (
    Interval,
    percentile_interval,
    resampled_metrics,
    weights_by_drive,
)
from evaluation.results.compared_answers import check_same_queries, drive_number
from evaluation.results.metric_tables import RESAMPLED_METRICS, MetricTable
from evaluation.results.ranking import LEAST_UNITS, rank_methods


class Agreement(NamedTuple):
    """How similarly two tables rank the methods that are in both tables.

    Attributes:
        first, second: names of the two tables.
        methods: names of the methods that are in both tables.
        tau: Kendall's tau-b (Kendall, Biometrika 33, 1945): 1 if the two tables
            rank the methods in the same order, -1 if they rank them in opposite
            orders; NaN if all values of a table are equal.
        interval: 95 % interval of `tau`.
    """

    first: str
    second: str
    methods: tuple[str, ...]
    tau: float
    interval: Interval


def rank_agreement(
    first: MetricTable, second: MetricTable, metric: str
) -> Agreement:
    """Compares the rankings of two tables, each over its own conditions.

    The interval is by bootstrap. For a table with four or more maps, maps are
    sampled, because a ranking should hold on other maps, too. For a table with
    fewer maps, blocks of the routes are sampled if the answers to all queries
    are known, and otherwise the units of `rank_methods`.

    Raises:
        InputError: fewer than two methods have results in all conditions of
            both tables.
    """
    whole = [
        {
            method
            for method in table.methods
            if all(
                (method, condition) in table.rows
                for condition in table.conditions
            )
        }
        for table in (first, second)
    ]
    methods = tuple(sorted(set.intersection(*whole)))
    if len(methods) < 2:
        raise InputError(
            f"{first.name}, {second.name}: fewer than two methods are on all"
            f" conditions of both ({', '.join(methods) or 'none'})"
        )
    one, one_samples = _means_and_samples(first, methods, metric)
    other, other_samples = _means_and_samples(second, methods, metric)
    samples = zip(one_samples, other_samples, strict=True)
    taus = np.array([_kendall_tau(*pair) for pair in samples])
    return Agreement(
        first.name,
        second.name,
        methods,
        _kendall_tau(one, other),
        percentile_interval(taus),
    )


def _means_and_samples(
    table: MetricTable, methods: Sequence[str], metric: str
) -> tuple[np.ndarray, np.ndarray]:
    """Returns means (M,) of methods, and their bootstrap samples (B, M).

    `rank_agreement` says what is sampled.
    """
    ranked, samples = rank_methods(
        row for (method, _), row in table.rows.items() if method in methods
    )
    order = [[mean.method for mean in ranked].index(name) for name in methods]
    means = np.array([mean.value for mean in ranked])[order]
    measured = list(itertools.product(table.conditions, methods))
    if (
        len({row.map for row in table.rows.values()}) >= LEAST_UNITS
        or metric not in RESAMPLED_METRICS
        or any(
            (method, condition) not in table.answers
            for condition, method in measured
        )
    ):
        return means, samples[:, order]
    asked = [
        [table.answers[method, condition] for method in methods]
        for condition in table.conditions
    ]
    for of_condition in asked:
        for answers in of_condition:
            check_same_queries(of_condition[0], answers)
    drawn = weights_by_drive(
        [of_condition[0].outcomes.own_blocks for of_condition in asked],
        [drive_number(of_condition[0]) for of_condition in asked],
    )
    samples_of_asked = [
        [
            getattr(resampled_metrics(answers.outcomes, weights), metric)
            for answers in of_condition
        ]
        for of_condition, (_, weights) in zip(asked, drawn, strict=True)
    ]
    return means, np.mean(samples_of_asked, axis=0).T


def _kendall_tau(first: np.ndarray, second: np.ndarray) -> float:
    with warnings.catch_warnings():
        # SciPy warns if all values are equal; the result is then NaN.
        warnings.simplefilter("ignore")
        return float(kendalltau(first, second).statistic)
