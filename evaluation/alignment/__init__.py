"""Alignment of drives with poses in different worlds."""

from evaluation.alignment.align import (
    Alignment,
    AlignmentReport,
    When,
    align,
    in_one_world,
)

__all__ = ["Alignment", "AlignmentReport", "When", "align", "in_one_world"]
