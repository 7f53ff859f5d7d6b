"""Conclusions from the table of results: ranking, and retained results.

A method's retained result is its result under structural change, divided by its
result without change. Each pair of drives can have a control: the same two
routes, both driven in one stage of the city. A loss from the control to the
pair is therefore due only to the change, and not to the routes.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
import math
from typing import NamedTuple

from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.result_tables import MethodDifference
from evaluation.results import table_forms as tables
from evaluation.results.headlines import KEPT, by_significance, listed, survival
from evaluation.results.summaries import Ranked, ranking
from evaluation.results.table import OWN, STAGE, Results, Row

NO_CONTROL = "no control"
# A result, and that of its control, if there is one.
Controlled = tuple[PlaceOutcome, PlaceOutcome | None]


def ranked_methods(
    results: Results, differences: Iterable[MethodDifference] = ()
) -> tuple[list[Ranked], str]:
    """Returns the methods ranked by mean AUC, and a sentence on the ranking.

    The means are over the pairs of drives with results of all methods, without
    the controls, in which the city does not change. If there is no such pair,
    no method is returned, and the sentence says so. The sentence also says
    which methods differ significantly from the first method, by the tests of
    `differences`.
    """
    rows = results.where({STAGE: OWN}, task="place", metric="auc").rows
    ranked, _ = ranking(rows)
    measured = Counter(
        row.but("method") for row in rows if not math.isnan(row.value)
    )
    num_pairs = sum(n == len(ranked) for n in measured.values())
    of_pair: dict[object, dict[tuple[str, str], float]] = {}
    for one in differences:
        key = one.result.method, one.other.method
        of_pair.setdefault(one.result.pair, {})[key] = one.p_value
    return ranked, _ranking_sentence(ranked, num_pairs, of_pair.values())


def further_columns(results: Results) -> dict[str, dict[str, Ranked]]:
    """Returns further columns of the ranking: column -> method -> mean.

    The columns are shares of the queries with a match: R@1; near misses, which
    are wrong top-ranked places within twice the radius of a match; and the pose
    success. The means are over the pairs of drives with results of all methods.
    """
    rows = results.where({STAGE: OWN})
    matched = {
        row.but(): row.value for row in rows.where(metric="with_match").rows
    }
    columns = {
        "R@1": rows.where(metric="r1").rows,
        "near miss": [
            replace(
                row,
                metric="near_miss",
                value=row.value / max(matched[row.but()], 1.0),
                low=math.nan,
                high=math.nan,
            )
            for row in rows.where(metric="too_far").rows
        ],
        "pose success": rows.where(metric="pose_success").rows,
    }
    return {
        name: {one.method: one for one in ranking(some)[0]}
        for name, some in columns.items()
    }


def _ranking_sentence(
    ranked: Sequence[Ranked],
    num_pairs: int,
    p_values: Iterable[Mapping[tuple[str, str], float]],
) -> str:
    if not ranked:
        return "No pair of drives has an AUC of every method to rank."
    over = f"{num_pairs} pairs of drives" if num_pairs > 1 else "one pair"
    best, *others = [
        (tables.title(one.method), f"{one.value:.3f}") for one in ranked
    ]
    if not others:
        return f"{best[0]} has a mean AUC of {best[1]} over {over}."
    ties = [name for name, value in others if value == best[1]]
    if ties:
        names = listed([best[0], *ties])
        return f"{names} tie at a mean AUC of {best[1]} ({over})."
    text = (
        f"{best[0]} has the greatest mean AUC of {len(ranked)} methods,"
        f" {best[1]} over {over}"
    )
    # The pairs on which tests tell the first method from another one.
    apart = Counter(
        name
        for of_pair in p_values
        for name in by_significance(ranked[0].method, of_pair)[0]
    )
    never = [f"{name} ({auc})" for name, auc in others if not apart[name]]
    partly = [
        f"{name} ({apart[name]} of {num_pairs})"
        for name, _ in others
        if 0 < apart[name] < num_pairs
    ]
    if not never and not partly:
        return f"{text}; its lead over all others is significant on each pair."
    if not never:
        return (
            f"{text}; its lead over {listed(partly)} is significant on some"
            " pairs only."
        )
    text += f"; its lead over {listed(never)} is significant on no pair"
    if partly:
        text += f", and over {listed(partly)} on some pairs only"
    return f"{text}."


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
    """Pairs the results with and without a change of the city.

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
    return tables.by_pair_and_method(
        [Survival(*key, *sides) for key, sides in found.items()]
    )


def percent(share: float) -> str:
    """Returns a share as text in per cent."""
    return tables.MISSING if math.isnan(share) else f"{100.0 * share:.0f} %"


def interval_text(kept: Row) -> str:
    """Returns the 95 % interval of a row's value in per cent, as `(81–90)`.

    The value must be a share. The text is empty if the interval is unknown.
    """
    if math.isnan(kept.low):
        return ""
    return f"({100.0 * kept.low:.0f}–{100.0 * kept.high:.0f})"


def survival_numbers(survivals: Sequence[Survival]) -> tables.Table:
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
    """Returns a table, for print, of how much of its AUC each method retains.

    The retained AUC is the AUC with change, divided by the AUC without change.
    """
    return tables.Table.of(
        survivals,
        {
            "map": lambda s: s.pair[0],
            "DB → query": lambda s: " → ".join(s.pair[1:]),
            "method": lambda s: tables.title(s.method),
            **_metric_columns("AUC", "auc", "kept"),
            **_metric_columns("AUC strict", "auc_strict"),
            **_metric_columns("R@1", "r1", "kept_r1"),
            ("recall at full precision", "with change"): lambda s: s.number(
                "after", "recall_at_full_precision"
            ),
        },
        tables.CAPTIONS["survival"],
    )


def _metric_columns(
    group: str, metric: str, kept: str | None = None
) -> tables.Columns[Survival]:
    """Returns columns: a metric without change, with change, and retained."""

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
    return columns if kept is None else columns | {(group, "retained"): share}


def survival_summary(survivals: Sequence[Survival]) -> str:
    """Returns sentences on how much methods retain, and on which survive."""
    groups = tables.by_pair(survivals)
    known = [one for one in survivals if one.before]
    without = len(groups) - len(tables.by_pair(known))
    text = survival([one.after[KEPT] for one in known if KEPT in one.after])
    parts = [text] if text else []
    if without:
        which = f"For {without} of {len(groups)} pairs" if known else "Here"
        parts.append(
            f"{which} no control was driven (both routes in one stage), so the"
            " cost of the change alone is not known."
        )
    return " ".join(parts)
