"""Ranking of the methods in a report: a sentence, and further columns."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
import math

from evaluation.report.tables.differences import MethodDifference
from evaluation.results.headlines import by_significance, listed
from evaluation.results.keys import OWN, STAGE
from evaluation.results.ranking import Ranked, rank_methods
from evaluation.results.table import Results
from evaluation.results.table_forms import title


def ranked_methods(
    results: Results, differences: Iterable[MethodDifference] = ()
) -> tuple[list[Ranked], str]:
    """Returns the methods ranked by mean AUC, and a sentence on the ranking.

    The means are over the pairs of drives with results of all methods.
    Controls, in which the city does not change, do not count. If there is no
    such pair, no method is returned, and the sentence says so. The sentence
    also says which methods differ significantly from the first method, by the
    tests of `differences`.
    """
    rows = results.where({STAGE: OWN}, task="place", metric="auc").rows
    ranked, _ = rank_methods(rows)
    measured = Counter(
        row.without("method") for row in rows if not math.isnan(row.value)
    )
    num_pairs = sum(n == len(ranked) for n in measured.values())
    of_pair: dict[object, dict[tuple[str, str], float]] = {}
    for difference in differences:
        key = difference.result.method, difference.other.method
        of_pair.setdefault(difference.result.pair, {})[key] = difference.p_value
    return ranked, _ranking_sentence(ranked, num_pairs, of_pair.values())


def further_columns(results: Results) -> dict[str, dict[str, Ranked]]:
    """Returns further columns of the ranking, each with a mean per method.

    The columns are shares of the queries with a match: R@1; near misses, which
    are wrong top-ranked places within twice the radius of a match; and the pose
    success. The means are over the pairs of drives with results of all methods.
    """
    rows = results.where({STAGE: OWN})
    matched = {
        row.identity: row.value for row in rows.where(metric="with_match").rows
    }
    columns = {
        "R@1": rows.where(metric="r1").rows,
        "near miss": [
            replace(
                row,
                metric="near_miss",
                value=row.value / max(matched[row.identity], 1.0),
                low=math.nan,
                high=math.nan,
            )
            for row in rows.where(metric="too_far").rows
        ],
        "pose success": rows.where(metric="pose_success").rows,
    }
    return {
        name: {mean.method: mean for mean in rank_methods(of_metric)[0]}
        for name, of_metric in columns.items()
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
        (title(mean.method), f"{mean.value:.3f}") for mean in ranked
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
