"""Tables of the survival of each method under structural change."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from evaluation.recognition.protocol import (
    PROTOCOL_COLUMNS,
    protocol_values,
)
from evaluation.recognition.survival import Kept, Survival
from evaluation.report.method_titles import in_table_order, title
from evaluation.report.tables import MISSING, Table

NO_CONTROL = "no control"
SURVIVAL_CAPTION = (
    "What is left of AUC and R@1 where the city has changed. All queries count"
    " (mode all), also those without a match. Without change: the same routes"
    " through one stage, with a control in place of one of the two drives: the"
    " route of one through the stage of the other. Kept: the share, with its"
    " 95 % interval (bootstrap over queries, the same ones with and without the"
    " change). What is kept need not be trusted: recall at full precision, with"
    " the change, is the part of the queries that are found before the first"
    " false match."
)


def by_pair(
    survivals: Sequence[Survival],
) -> dict[tuple[str, str, str], list[Survival]]:
    """Returns (map, database, query) -> methods in the order of tables."""
    groups: dict[tuple[str, str, str], list[Survival]] = {}
    for one in survivals:
        groups.setdefault(one.pair, []).append(one)
    return {
        pair: [
            one
            for method in in_table_order(s.method for s in group)
            for one in group
            if one.method == method
        ]
        for pair, group in groups.items()
    }


def percent(share: float) -> str:
    """Returns a share as text."""
    return MISSING if math.isnan(share) else f"{100.0 * share:.0f} %"


def interval_text(kept: Kept) -> str:
    """Returns the interval of a kept share as text; empty without one."""
    low, high = kept.interval.low, kept.interval.high
    if math.isnan(low):
        return ""
    return f"{100.0 * low:.0f}–{100.0 * high:.0f}"


def survival_numbers(survivals: Sequence[Survival]) -> Table:
    """Returns all numbers, as `survival.csv` has them."""
    header = (
        "map",
        "db",
        "query",
        "method",
        "auc_unchanged",
        "auc_changed",
        "kept",
        "kept_low",
        "kept_high",
        "r1_unchanged",
        "r1_changed",
        "r1_kept",
        "r1_kept_low",
        "r1_kept_high",
        "recall_at_full_precision",
        "control",
        *PROTOCOL_COLUMNS,
    )
    rows = tuple(
        (
            *one.pair,
            one.method,
            *_numbers(one.auc),
            *_numbers(one.recall_at_1),
            one.full_precision,
            one.control,
            *protocol_values(one.protocol),
        )
        for one in survivals
    )
    return Table(header, rows)


def survival_table(survivals: Sequence[Survival]) -> Table:
    """Returns the table for print: a row for each pair and method."""
    rows = tuple(
        (
            pair[0],
            " → ".join(pair[1:]),
            title(one.method),
            *_cells(one, one.auc),
            *_cells(one, one.recall_at_1),
            one.full_precision,
        )
        for pair, group in by_pair(survivals).items()
        for one in group
    )
    return Table(
        (
            "map",
            "DB → query",
            "method",
            *("without change", "with change", "kept") * 2,
            "with change",
        ),
        rows,
        groups=(
            ("", 3),
            ("AUC", 3),
            ("R@1", 3),
            ("recall at full precision", 1),
        ),
        caption=SURVIVAL_CAPTION,
    )


def survival_summary(survivals: Sequence[Survival]) -> str:
    """Returns one or two sentences on the share of AUC that methods keep."""
    known = [one for one in survivals if one.unchanged is not None]
    pairs = dict.fromkeys(one.pair for one in survivals)
    without = len(pairs) - len({one.pair for one in known})
    parts = []
    if known:
        shares = {
            method: float(
                np.nanmedian(
                    [one.auc.share for one in known if one.method == method]
                )
            )
            for method in in_table_order(one.method for one in known)
            if any(
                not math.isnan(one.auc.share)
                for one in known
                if one.method == method
            )
        }
        listed = ", ".join(
            f"{title(method)} {percent(shares[method])}"
            for method in sorted(shares, key=lambda m: -shares[m])
        )
        number = len(pairs) - without
        over = f"median of {number} pairs" if number > 1 else "one pair"
        if listed:
            parts.append(
                f"Each method keeps part of its AUC without change ({over}):"
                f" {listed}."
            )
    if without:
        which = f"For {without} of {len(pairs)} pairs" if known else "Here"
        parts.append(
            f"{which} no control was driven (the route of one drive through"
            " the stage of the other), so what the change alone costs is not"
            " known."
        )
    return " ".join(parts)


def _numbers(kept: Kept) -> tuple[float, ...]:
    return (
        kept.unchanged,
        kept.changed,
        kept.share,
        kept.interval.low,
        kept.interval.high,
    )


def _cells(one: Survival, kept: Kept) -> tuple[object, ...]:
    if one.unchanged is None:
        return NO_CONTROL, kept.changed, None
    interval = interval_text(kept)
    text = percent(kept.share)
    if interval:
        text += f" ({interval})"
    return kept.unchanged, kept.changed, text
