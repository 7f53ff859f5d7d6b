"""Alignment of drives with poses in different worlds."""

from evaluation.alignment.align import (
    Alignment,
    When,
    align,
    in_one_world,
)
from evaluation.alignment.alignment_report import AlignmentReport

__all__ = ["Alignment", "AlignmentReport", "When", "align", "in_one_world"]
