"""Texts that several commands print."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import math
from typing import TYPE_CHECKING

from evaluation.base import terminal

if TYPE_CHECKING:
    from evaluation.recognition import Interval
    from evaluation.verbs import Measured


def spaced_interval(interval: Interval) -> str:
    """Returns an interval after two spaces; "" if it is unknown."""
    if math.isnan(interval.low):
        return ""
    low, high = map(terminal.number_text, (interval.low, interval.high))
    return f"  [{low}, {high}]"


def metric_rows(
    found: Measured, beside: Mapping[str, str] | None = None
) -> Iterator[tuple[str, str]]:
    """Yields the name and the value of each metric that was measured.

    Args:
        found: what was measured.
        beside: name of a metric -> what stands beside its value.
    """
    from evaluation.recognition import METRICS

    for name, number in found.numbers.items():
        metric = METRICS[name]
        value = terminal.number_text(number.value)
        if metric.is_whole and math.isfinite(number.value):
            value = f"{number.value:.0f}"
        text = f"{value}{spaced_interval(number.interval)}"
        if beside and name in beside:
            text += f"  ({beside[name]})"
        yield metric.label, text
