"""The values that the paper prints, as data.

Two misprints are corrected, each with a note in its row: Table I gives
Downtown 01-04 the value of 02-04, and one R@1 of RING++ on Riverside 02->01
contradicts the F1 beside it. The paper does not state the mode of
`recognition.metrics` of a method. The mode is inferred from the relation
between R@1, F1 and AUC in all its rows.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import cache
from importlib import resources

from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.report.reference import Published


def is_protocol(method: str, protocol: RetrievalProtocol) -> bool:
    """Returns whether the paper ran a method by a protocol.

    Args:
        method: its name.
        protocol: how it was run, its number of scans included.
    """
    scans = 10 if method == "btc" else 1
    compared = replace(protocol, exclude_recent=None)
    return compared == RetrievalProtocol(scans_per_place=scans)


def is_printed(result: RecognitionResult) -> bool:
    """Returns whether the paper has a number for map, method and protocol."""
    return (
        result.pair[0] in city_names()
        and result.method in method_names()
        and is_protocol(result.method, result.outcome.protocol)
    )


def mode_of(method: str) -> Mode:
    """Returns the mode in which the paper seems to count a method."""
    for key in recognition_values():
        if key[3] == method:
            return key[4]
    return "all"


def values_of(result: RecognitionResult, mode: Mode) -> Published | None:
    """Returns the paper's values, if it counted in this mode.

    None for numbers that were found by another protocol than the paper's.
    """
    if not is_protocol(result.method, result.outcome.protocol):
        return None
    return recognition_values().get((*result.pair, result.method, mode))


def auc_over_change(method: str) -> list[tuple[float, float]]:
    """Returns the points (TCR_sym, AUC) of a method in the paper's tables."""
    return [
        (tcr_between(*key[:3]), value.auc)
        for key, value in recognition_values().items()
        if key[3] == method
    ]


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
    """Returns (map, drive, later drive) -> TCR_sym."""
    return {
        (row["map"], row["sequence_a"], row["sequence_b"]): float(
            row["tcr_sym"]
        )
        for row in _rows("tcr.csv")
    }


def tcr_between(map_name: str, first: str, second: str) -> float:
    """Returns the TCR_sym of two drives, in either order."""
    earlier, later = sorted((first, second))
    return tcr_values()[map_name, earlier, later]


@cache
def recognition_values() -> dict[tuple[str, str, str, str, Mode], Published]:
    """Returns (map, database, query, method, mode) -> values."""
    return {
        (
            row["map"],
            row["database"],
            row["query"],
            row["method"],
            "filtered" if row["mode"] == "filtered" else "all",
        ): Published(
            float(row["auc"]), float(row["recall_at_1"]), float(row["f1_max"])
        )
        for row in _rows("place_recognition.csv")
    }


def _rows(name: str) -> list[dict[str, str]]:
    text = resources.files(__package__).joinpath(name).read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))
