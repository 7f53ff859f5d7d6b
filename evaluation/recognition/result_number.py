"""A single result of a task: one number of the table of results."""

from __future__ import annotations

from typing import NamedTuple

from evaluation.recognition.sign_flips import UNKNOWN, Interval


class Number(NamedTuple):
    """A result of a task.

    Attributes:
        method: method, estimator or baseline; "" if there is none. For a place
            recognition method, it is the method's name with its settings.
        verified: whether geometric verification was used.
        metric: name of the metric.
        value: its value.
        interval: its 95 % interval.
        n: number of queries, points or other items from which the value is
            computed.
    """

    method: str
    verified: bool
    metric: str
    value: float
    interval: Interval = UNKNOWN
    n: int = 0
