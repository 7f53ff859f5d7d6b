"""The change between two stages of a map, as a study keeps it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from evaluation.change.drive_change import ChangeReport


@dataclass(frozen=True)
class ChangeResult:
    """The change between two stages of a map."""

    map_name: str
    stages: tuple[str, str]
    report: ChangeReport


def symmetric_changes(
    changes: Iterable[ChangeResult],
) -> dict[tuple[str, str, str], float]:
    """Returns (map, stage, stage) -> TCR_sym, in both orders."""
    values = {}
    for result in changes:
        value = result.report.change.symmetric
        for first, second in (result.stages, result.stages[::-1]):
            values[result.map_name, first, second] = value
    return values
