"""Tables of what methods retain under a change of the city.

A method's retained result is its result under structural change, divided by its
result without change. Each pair of drives can have a control: the same two
routes, both driven in one stage of the city. A loss from the control to the
pair is therefore due only to the change, and not to the routes.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import math
from typing import NamedTuple

from evaluation.results.headlines import KEPT, survival_sentences
from evaluation.results.keys import OWN, STAGE
from evaluation.results.table import Row
from evaluation.results.table_forms import (
    CAPTIONS,
    MISSING,
    Columns,
    Table,
    by_pair,
    by_pair_and_method,
    keyed,
    title,
)

NO_CONTROL = "no control"


class Survival(NamedTuple):
    """Results of a method on a pair of drives, and on the pair's control.

    The control has the same two routes without a change of the city.

    Attributes:
        pair: name of the map, stage of the database drive, and stage of the
            query drive.
        method: name of the method.
        before: metric -> result on the control; empty if there is no control.
        after: metric -> result on the pair, with the change of the city.
    """

    pair: tuple[str, str, str]
    method: str
    before: Mapping[str, Row]
    after: Mapping[str, Row]

    def number(self, side: str, metric: str, end: str = "value") -> float:
        """Returns the value of a metric, or a limit of its 95 % interval.

        Args:
            side: `before` (without the change) or `after` (with the change).
            metric: name of the metric.
            end: `value`; or `low` or `high` for a limit of the interval.

        Returns:
            The value or limit; NaN if it is unknown.
        """
        row = getattr(self, side).get(metric)
        return math.nan if row is None else getattr(row, end)


def survivals(rows: Iterable[Row], stages: Mapping[str, str]) -> list[Survival]:
    """Joins the results without a change of the city to the results with it.

    Args:
        rows: rows of pairs of drives, and of their controls.
        stages: name of a drive -> its stage.

    Returns:
        A `Survival` for each method on each pair of drives, sorted by pair, and
        within a pair by method in the order of tables.
    """
    found: dict[
        tuple[tuple[str, str, str], str],
        tuple[dict[str, Row], dict[str, Row]],
    ] = {}
    for row in rows:
        # Drives that never meet are in no table.
        if row.task == "place" and {row.database, row.query} <= stages.keys():
            pair = row.map, stages[row.database], stages[row.query]
            sides = found.setdefault((pair, row.method), ({}, {}))
            sides[row[STAGE] == OWN][row.metric] = row
    return by_pair_and_method(
        [Survival(*key, *sides) for key, sides in found.items()]
    )


def percent(share: float) -> str:
    """Returns a share as text in per cent."""
    return MISSING if math.isnan(share) else f"{100.0 * share:.0f} %"


def interval_text(kept: Row) -> str:
    """Returns the 95 % interval of a row's value in per cent, as `(81–90)`.

    The value must be a share. The text is empty if the interval is unknown.
    """
    if math.isnan(kept.low):
        return ""
    return f"({100.0 * kept.low:.0f}–{100.0 * kept.high:.0f})"


def survival_numbers(survivals: Sequence[Survival]) -> Table:
    """Returns the table `survival.csv`.

    For each method, the table contains results without and with change of the
    city, and the retained share: the result with change divided by the result
    without change.
    """
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
    return Table.of(
        survivals,
        {
            "map": lambda s: s.pair[0],
            "db": lambda s: s.pair[1],
            "query": lambda s: s.pair[2],
            "method": lambda s: s.method,
            **keyed(numbers, lambda s, place: s.number(*place)),
            "protocol": lambda s: s.after["auc"].protocol,
        },
    )


def survival_table(survivals: Sequence[Survival]) -> Table:
    """Returns a table, for print, of how much of its AUC each method retains.

    The retained AUC is the AUC with change, divided by the AUC without change.
    """
    return Table.of(
        survivals,
        {
            "map": lambda s: s.pair[0],
            "DB → query": lambda s: " → ".join(s.pair[1:]),
            "method": lambda s: title(s.method),
            **_metric_columns("AUC", "auc", "kept"),
            **_metric_columns("AUC strict", "auc_strict"),
            **_metric_columns("R@1", "r1", "kept_r1"),
            ("recall at full precision", "with change"): lambda s: s.number(
                "after", "recall_at_full_precision"
            ),
        },
        CAPTIONS["survival"],
    )


def _metric_columns(
    group: str, metric: str, kept: str | None = None
) -> Columns[Survival]:
    """Returns columns: a metric without and with change, and the ratio."""

    def share(survival: Survival) -> str | None:
        row = survival.after.get(str(kept))
        if row is None:
            return None
        return f"{percent(row.value)} {interval_text(row)}".rstrip()

    columns: dict[str | tuple[str, str], Callable[[Survival], object]] = {
        (group, "without change"): lambda s: (
            s.number("before", metric) if s.before else NO_CONTROL
        ),
        (group, "with change"): lambda s: s.number("after", metric),
    }
    return columns if kept is None else columns | {(group, "retained"): share}


def survival_summary(survivals: Sequence[Survival]) -> str:
    """Returns sentences on how much methods retain, and on which survive."""
    groups = by_pair(survivals)
    known = [survival for survival in survivals if survival.before]
    without = len(groups) - len(by_pair(known))
    text = survival_sentences(
        [survival.after[KEPT] for survival in known if KEPT in survival.after]
    )
    parts = [text] if text else []
    if without:
        which = f"For {without} of {len(groups)} pairs" if known else "Here"
        parts.append(
            f"{which} no control was driven (both routes in one stage), so the"
            " cost of the change alone is not known."
        )
    return " ".join(parts)
