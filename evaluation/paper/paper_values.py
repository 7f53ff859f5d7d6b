"""What the paper prints: the values of its tables, with their protocols."""

import csv
from dataclasses import replace
import functools
from importlib import resources

from evaluation.recognition.metrics import Mode
from evaluation.recognition.protocol import PAPER_PROTOCOL
from evaluation.report.reference import (
    Published,
    Reference,
)

TITLE = "the paper “The City that Never Settles”"
# Drives through a real city in the paper's tables.
KAIST = ("kaist", "01", "06")


@functools.cache
def paper() -> Reference:
    """Returns the values that the paper prints.

    Two misprints are corrected, each with a note in its row: Table I gives
    Downtown 01-04 the value of 02-04, and one R@1 of RING++ on Riverside 02->01
    contradicts the F1 beside it. The paper does not state whether a method was
    scored on all queries or only on queries with a match (the mode, see
    `evaluation.recognition.metrics`). The mode is inferred from the relation
    between R@1, F1 and AUC in all rows of the method.
    """
    changes = {
        (row["map"], row["sequence_a"], row["sequence_b"]): float(
            row["tcr_sym"]
        )
        for row in _rows("tcr.csv")
    }
    recognitions: dict[tuple[str, str, str, str, Mode], Published] = {
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
    return Reference(
        title=TITLE,
        counting="counted as the paper seems to have done: RING++ on the"
        " queries that have a match (mode filtered), the others on all (mode"
        " all)",
        changes=changes,
        # Real drives, four years apart.
        further=[("kaist (real)", "01 ↔ 06", changes[KAIST])],
        recognitions=recognitions,
        protocols={
            method: replace(
                PAPER_PROTOCOL, scans_per_place=10 if method == "btc" else 1
            )
            for *_, method, _ in recognitions
        },
    )


def _rows(name: str) -> list[dict[str, str]]:
    text = resources.files(__package__).joinpath(name).read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))
