"""Survival: a public noun, whether a method keeps its results under a change.

A method survives if it is not inferior to itself without the change: the upper
limit of the 95 % interval of its mean loss is below 10 % of the value without
the change. This is a non-inferiority test with a margin of 10 % (Piaggio et
al., JAMA 308, 2012).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import json_values
from evaluation.recognition import LEAST_CITIES, Interval, city_interval
from evaluation.results.keys import FROZEN_REDRAW
from evaluation.results.ranking import common_conditions
from evaluation.results.table import Row

# The metric by which a method survives a change: the share of its AUC strict
# that it retains.
RELATIVE = "relative_auc_strict"
# Greatest mean loss with which a method survives, the margin.
MARGIN = 0.1
# Probability with which a loss is shown to be small, in `largest_loss_shown`.
_POWER = 0.8
# Number of made-up studies in `largest_loss_shown`.
_STUDIES = 400


class Survival(NamedTuple):
    """Whether a method survives a change.

    Attributes:
        method: label of the method.
        loss: the mean over cities of the share that is lost.
        interval: its 95 % interval over cities; unknown for fewer than eight.
        of_cities: city -> the share that is lost there.
    """

    method: str
    loss: float
    interval: Interval
    of_cities: Mapping[str, float]

    @classmethod
    def of(cls, method: str, of_cities: Mapping[str, float]) -> Survival:
        """Returns the survival of a method from its loss in each city."""
        losses = np.array(list(of_cities.values()))
        interval = city_interval(losses, np.ones(len(losses)), (0.0, 1.0))
        return cls(method, float(losses.mean()), interval, of_cities)

    @property
    def cities(self) -> int:
        """Number of cities."""
        return len(self.of_cities)

    @property
    def verdict(self) -> str:
        """`survives`, `does not survive` or `cannot show`.

        A method survives if the upper limit of the loss is below the margin.
        It does not survive if the lower limit is above the margin. Otherwise
        the cities cannot show either.
        """
        if self.interval.high < MARGIN:
            return "survives"
        if self.interval.low > MARGIN:
            return "does not survive"
        return "cannot show"

    def to_json(self) -> dict[str, Any]:
        """Returns the attributes and the verdict; NaN becomes None."""
        return {
            "method": self.method,
            "loss": json_values(self.loss),
            "interval_95": self.interval.to_json(),
            "cities": self.cities,
            "verdict": self.verdict,
        }


def judge_survival(rows: Iterable[Row]) -> list[Survival]:
    """Returns whether each method survives, the one that loses least first.

    The loss of a pair of drives is 1 minus its retained share, and 0 if the
    share exceeds 1: a gain on one pair does not make up for a loss on another.
    The loss of a city is the mean over its pairs and seeds. Cities are the
    units, and count equally, because pairs of a city share its streets. See
    `city_interval` for the interval. A frozen redraw of a map is a city of its
    own: it has the streets of the map, but no building of it.

    Args:
        rows: rows of `relative_auc_strict`, measured with the same radius,
            protocol and verification. Only conditions that all methods have
            count.
    """
    common = common_conditions(rows)
    cities = sorted(
        {_city(row) for by_method in common for row in by_method.values()}
    )
    found = []
    for name in sorted(common[0]) if common else ():
        losses = {
            city: float(
                np.mean(
                    [
                        max(0.0, 1.0 - by_method[name].value)
                        for by_method in common
                        if _city(by_method[name]) == city
                    ]
                )
            )
            for city in cities
        }
        found.append(Survival.of(name, losses))
    return sorted(found, key=lambda one: (one.loss, one.method))


def _city(row: Row) -> str:
    redraw = row.factors.get(FROZEN_REDRAW)
    return row.map if redraw is None else f"{row.map}, fresh {redraw}"


def largest_loss_shown(num_cities: int, spread: float) -> float:
    """Returns the largest loss that cities can show to be below the margin.

    With this true mean loss, four of five studies of so many cities find that
    the method survives. With a larger loss, fewer do: then `cannot show` says
    nothing about the method.

    Args:
        num_cities: number of cities.
        spread: standard deviation of the losses of single cities, which the
            function assumes to be normally distributed.

    Returns:
        The loss; NaN if the cities cannot show even that nothing is lost.
    """
    if num_cities < LEAST_CITIES:
        return float("nan")
    rng = np.random.default_rng(num_cities)
    draws = spread * rng.normal(size=(_STUDIES, num_cities))
    ones = np.ones(num_cities)
    excess = [city_interval(losses, ones).high for losses in draws]
    loss = MARGIN - float(np.quantile(excess, _POWER))
    return loss if loss >= 0.0 else float("nan")
