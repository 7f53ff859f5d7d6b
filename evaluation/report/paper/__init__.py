"""The values that the paper prints, as data.

Two misprints are corrected, each with a note in its row: Table I gives
Downtown 01-04 the value of 02-04, and one R@1 of RING++ on Riverside 02->01
contradicts the F1 beside it. Which mode of `recognition.metrics` a method was
evaluated in is not said; it is inferred from the relation between R@1, F1 and
AUC in all its rows.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

from evaluation.recognition.protocol import RetrievalProtocol

if TYPE_CHECKING:
    from evaluation.recognition.metrics import Mode


@dataclass(frozen=True)
class PaperRecognition:
    """One cell of the paper's Table II."""

    auc: float
    recall_at_1: float
    f1_max: float


def is_protocol(method: str, protocol: RetrievalProtocol) -> bool:
    """Tells whether the paper ran a method by a protocol.

    Args:
        method: its name.
        protocol: that it ran by, its number of scans included.
    """
    scans = 10 if method == "btc" else 1
    asked = replace(protocol, exclude_recent=None)
    return asked == RetrievalProtocol(scans_per_place=scans)


@cache
def city_names() -> frozenset[str]:
    """Returns the maps that the paper made."""
    return frozenset(key[0] for key in recognition_values())


@cache
def method_names() -> frozenset[str]:
    """Returns the methods that the paper ran."""
    return frozenset(key[3] for key in recognition_values())


@cache
def tcr_values() -> dict[tuple[str, str, str], float]:
    """Returns (map, sequence, later sequence) -> TCR_sym."""
    return {
        (row["map"], row["sequence_a"], row["sequence_b"]): float(
            row["tcr_sym"]
        )
        for row in _rows("tcr.csv")
    }


def tcr_between(map_name: str, first: str, second: str) -> float:
    """Returns the TCR_sym of two sequences, in either order."""
    earlier, later = sorted((first, second))
    return tcr_values()[map_name, earlier, later]


@cache
def recognition_values() -> dict[
    tuple[str, str, str, str, Mode], PaperRecognition
]:
    """Returns (map, database, query, method, mode) -> values."""
    return {
        (
            row["map"],
            row["database"],
            row["query"],
            row["method"],
            "filtered" if row["mode"] == "filtered" else "all",
        ): PaperRecognition(
            float(row["auc"]), float(row["recall_at_1"]), float(row["f1_max"])
        )
        for row in _rows("place_recognition.csv")
    }


def _rows(name: str) -> list[dict[str, str]]:
    text = resources.files(__name__).joinpath(name).read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))
