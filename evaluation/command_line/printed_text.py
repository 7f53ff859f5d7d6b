"""Texts that several commands print."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cns_drake.base import number_text

if TYPE_CHECKING:
    from evaluation.recognition import Interval


def interval_text(interval: Interval) -> str:
    """Returns an interval as text in brackets."""
    return f"[{number_text(interval.low)}, {number_text(interval.high)}]"
