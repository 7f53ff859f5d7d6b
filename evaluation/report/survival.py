"""The survival of each method under structural change: tables of rows.

A control drive takes the place of one drive of a pair: it follows the same
route, but in the stage of the other drive. What a method loses from the control
to the pair is due to the change alone, and not to the routes.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import math
from typing import NamedTuple

import numpy as np

from evaluation.report.rows import OWN, STAGE
from evaluation.results import table_forms as tables
from evaluation.results.table import Row

NO_CONTROL = "no control"


class Survival(NamedTuple):
    """A method on a pair of drives: metric -> row.

    Attributes:
        pair: map, stage of the database, and of the query.
        method: its name.
        before: without the change; empty without a control.
        after: with the change.
    """

    pair: tuple[str, str, str]
    method: str
    before: Mapping[str, Row]
    after: Mapping[str, Row]

    def number(self, side: str, metric: str, end: str = "value") -> float:
        """Returns the value before or after the change, or a limit of it.

        The limits are those of its interval.
        """
        row = getattr(self, side).get(metric)
        return math.nan if row is None else getattr(row, end)


def survivals(rows: Iterable[Row], stages: Mapping[str, str]) -> list[Survival]:
    """Returns what each method keeps on each pair, in the order of tables.

    The stages are those of drives.
    """
    found: dict[
        tuple[tuple[str, str, str], str],
        tuple[dict[str, Row], dict[str, Row]],
    ] = {}
    for row in rows:
        if row.task == "place":
            pair = row.map, stages[row.database], stages[row.query]
            sides = found.setdefault((pair, row.method), ({}, {}))
            sides[row[STAGE] == OWN][row.metric] = row
    pairs = list(dict.fromkeys(pair for pair, _ in found))
    methods = tables.in_table_order(method for _, method in found)
    return sorted(
        (
            Survival(pair, method, before, after)
            for (pair, method), (before, after) in found.items()
        ),
        key=lambda s: (pairs.index(s.pair), methods.index(s.method)),
    )


def by_pair(
    survivals: Iterable[Survival],
) -> dict[tuple[str, str, str], list[Survival]]:
    """Returns (map, database, query) -> what each method keeps."""
    groups: dict[tuple[str, str, str], list[Survival]] = {}
    for one in survivals:
        groups.setdefault(one.pair, []).append(one)
    return groups


def percent(share: float) -> str:
    """Returns a share as text in per cent."""
    return tables.MISSING if math.isnan(share) else f"{100.0 * share:.0f} %"


def interval_text(kept: Row) -> str:
    """Returns the interval of a kept share as text; empty without one."""
    if math.isnan(kept.low):
        return ""
    return f"({100.0 * kept.low:.0f}–{100.0 * kept.high:.0f})"


def survival_numbers(survivals: Sequence[Survival]) -> tables.Table:
    """Returns what methods keep, for `survival.csv`."""
    numbers: dict[str | tuple[str, str], tuple[str, ...]] = {
        "auc_unchanged": ("before", "auc"),
        "auc_changed": ("after", "auc"),
        "kept": ("after", "kept"),
        "kept_low": ("after", "kept", "low"),
        "kept_high": ("after", "kept", "high"),
        "r1_unchanged": ("before", "r1"),
        "r1_changed": ("after", "r1"),
        "r1_kept": ("after", "kept_r1"),
        "r1_kept_low": ("after", "kept_r1", "low"),
        "r1_kept_high": ("after", "kept_r1", "high"),
        "recall_at_full_precision": ("after", "recall_at_full_precision"),
        "auc_strict_unchanged": ("before", "auc_strict"),
        "auc_strict_changed": ("after", "auc_strict"),
    }
    return tables.Table.of(
        survivals,
        {
            "map": lambda s: s.pair[0],
            "db": lambda s: s.pair[1],
            "query": lambda s: s.pair[2],
            "method": lambda s: s.method,
            **tables.keyed(numbers, lambda s, place: s.number(*place)),
            "protocol": lambda s: s.after["auc"].protocol,
        },
    )


def survival_table(survivals: Sequence[Survival]) -> tables.Table:
    """Returns what methods keep, for print: a row per pair and method."""
    return tables.Table.of(
        survivals,
        {
            "map": lambda s: s.pair[0],
            "DB → query": lambda s: " → ".join(s.pair[1:]),
            "method": lambda s: tables.title(s.method),
            **_shown("AUC", "auc", "kept"),
            **_shown("AUC strict", "auc_strict"),
            **_shown("R@1", "r1", "kept_r1"),
            ("recall at full precision", "with change"): lambda s: s.number(
                "after", "recall_at_full_precision"
            ),
        },
        tables.CAPTIONS["survival"],
    )


def _shown(
    group: str, metric: str, kept: str | None = None
) -> tables.Columns[Survival]:
    """Returns the columns of a number without change, with it, and kept."""

    def share(one: Survival) -> str | None:
        row = one.after.get(str(kept))
        if row is None:
            return None
        return f"{percent(row.value)} {interval_text(row)}".rstrip()

    columns: dict[str | tuple[str, str], Callable[[Survival], object]] = {
        (group, "without change"): lambda s: (
            s.number("before", metric) if s.before else NO_CONTROL
        ),
        (group, "with change"): lambda s: s.number("after", metric),
    }
    return columns if kept is None else columns | {(group, "kept"): share}


def survival_summary(survivals: Sequence[Survival]) -> str:
    """Returns one or two sentences on the share of AUC that methods keep."""
    groups = by_pair(survivals)
    known = [one for one in survivals if one.before]
    without = len(groups) - len(by_pair(known))
    shares: dict[str, list[float]] = {}
    for one in known:
        if not math.isnan(share := one.number("after", "kept")):
            shares.setdefault(one.method, []).append(share)
    medians = {
        m: float(np.median(shares[m])) for m in tables.in_table_order(shares)
    }
    parts = []
    if medians:
        listed = ", ".join(
            f"{tables.title(method)} {percent(medians[method])}"
            for method in sorted(medians, key=lambda m: -medians[m])
        )
        number = len(groups) - without
        over = f"median of {number} pairs" if number > 1 else "one pair"
        parts.append(
            f"Each method keeps part of its AUC without change ({over}):"
            f" {listed}."
        )
    if without:
        which = f"For {without} of {len(groups)} pairs" if known else "Here"
        parts.append(
            f"{which} no control was driven (both routes in one stage), so the"
            " cost of the change alone is not known."
        )
    return " ".join(parts)
