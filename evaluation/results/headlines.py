"""Sentences on what a chart shows, and on what it does not show.

Two methods differ significantly if the difference of their AUC has a corrected
p-value below 0.05, see `evaluation.recognition.significance`.
"""

from collections.abc import Iterable, Mapping, Sequence
import math

from evaluation.results.compared_answers import compared_answers
from evaluation.results.method_names import title
from evaluation.results.ranking import Ranked
from evaluation.results.table import Answers, QueryRows, Row

# Methods differ significantly if the p-value is below this value.
SIGNIFICANT = 0.05
# The metric by which a method survives a change: the share of its AUC strict
# that it retains.
KEPT = "kept_strict"
# A method survives if the lower limit of this share is at least that.
SURVIVES = 0.9


def listed(names: Iterable[str]) -> str:
    """Returns names as text, such as `a, b and c`."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def from_least_to_greatest(
    found: Mapping[str, float], form: str = "{:.2f}"
) -> str:
    """Returns the least and the greatest of some methods' values, as text.

    Args:
        found: method -> its value; NaN if it is unknown.
        form: format of a value.
    """
    known = {n: value for n, value in found.items() if not math.isnan(value)}
    if not known:
        return "unknown"
    lowest = min(known, key=known.__getitem__)
    highest = max(known, key=known.__getitem__)
    least, greatest = form.format(known[lowest]), form.format(known[highest])
    if least == greatest:
        return least
    return f"from {least} ({lowest}) to {greatest} ({highest})"


def by_significance(
    best: str, p_values: Mapping[tuple[str, str], float]
) -> tuple[list[str], list[str]]:
    """Divides methods by whether they differ significantly from the best.

    Args:
        best: label of the best method.
        p_values: (one method, another) -> corrected p-value of their
            difference; NaN if it is unknown.

    Returns:
        The methods that differ significantly, and all other methods.
    """
    apart: list[str] = []
    rest: list[str] = []
    for (one, another), p in p_values.items():
        if best not in (one, another):
            continue
        other = title(another if one == best else one)
        # The difference may be unknown: NaN is not below the limit.
        if p < SIGNIFICANT:
            apart.append(other)
        else:
            rest.append(other)
    return apart, rest


def survivors(ranked: Iterable[Ranked]) -> list[str]:
    """Returns the labels of the methods that survive.

    A method survives if it retains at least 90 % of its AUC strict, by the
    lower limit of the 95 % interval.

    Args:
        ranked: the methods, with their means of `kept_strict`.
    """
    return [mean.method for mean in ranked if mean.interval.low >= SURVIVES]


def lead_by_auc(rows: Sequence[Row], queries: QueryRows | None) -> str:
    """Says from which methods the best method differs significantly, by AUC.

    Args:
        rows: rows of the metric `auc`.
        queries: the answers from which the rows were computed.

    Returns:
        A clause; empty if there is one method, or the answers are unknown.
    """
    # Each label once, in the order of the rows.
    labels = list(dict.fromkeys(row.label for row in rows))
    common = _common_conditions(rows, labels, queries)
    if len(labels) < 2 or not common:
        return ""
    compared = compared_answers(
        {n: [by_label[n][1] for by_label in common] for n in labels}
    )
    best = max(labels, key=lambda n: sum(by_label[n][0] for by_label in common))
    p_values = {pair: p for pair, (_, p) in compared.items()}
    return _lead(best, *by_significance(best, p_values))


def _common_conditions(
    rows: Sequence[Row], labels: Sequence[str], queries: QueryRows | None
) -> list[dict[str, tuple[float, Answers]]]:
    """Returns the conditions in which the answers of all methods are known.

    Args:
        rows: rows of the metric `auc`.
        labels: labels of all methods.
        queries: the answers from which the rows were computed.

    Returns:
        For each condition: label -> AUC, and the answers.
    """
    if queries is None:
        return []
    asked = {answers.identity: answers for answers in queries.answers}
    table: dict[tuple, dict[str, tuple[float, Answers]]] = {}
    for row in rows:
        if row.identity in asked:
            by_label = table.setdefault(row.without("method"), {})
            by_label[row.label] = row.value, asked[row.identity]
    return [
        by_label for by_label in table.values() if len(by_label) == len(labels)
    ]


def _lead(best: str, apart: Sequence[str], rest: Sequence[str]) -> str:
    """Returns the clause of `lead_by_auc`.

    Args:
        best: label of the method with the greatest AUC.
        apart: titles of the methods that differ significantly from it.
        rest: titles of all other methods.
    """
    text = f"the greatest AUC, of {title(best)}, "
    if not rest:
        return f"{text}differs significantly from all others"
    text += "does not differ significantly from "
    if not apart and len(rest) > 2:
        return f"{text}any other"
    return f"{text}{listed(rest)}"
