"""Sentences on what a chart shows, and on what it does not show.

Two methods differ significantly if the difference of their R@1 has a corrected
p-value below 0.05, see `evaluation.recognition.sign_flips`.
"""

from collections.abc import Iterable, Mapping, Sequence
import math

from evaluation.recognition import SIGNIFICANT, Difference
from evaluation.results.compared_answers import compared_answers
from evaluation.results.method_names import title
from evaluation.results.table import Answers, QueryRows, Row


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


def lead_by_right_answers(
    rows: Sequence[Row], queries: QueryRows | None
) -> str:
    """Says from which methods the method with the greatest R@1 differs.

    Args:
        rows: rows of a metric of place recognition.
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
        {n: [by_label[n] for by_label in common] for n in labels}
    )
    best = max(
        labels,
        key=lambda n: sum(
            by_label[n].outcomes.recall_at(1) for by_label in common
        ),
    )
    return _lead(best, *by_significance(best, compared))


def by_significance(
    best: str, differences: Mapping[tuple[str, str], Difference]
) -> tuple[list[str], list[str]]:
    """Divides methods by whether they differ significantly from the best.

    Args:
        best: label of the best method.
        differences: (one method, another) -> their difference.

    Returns:
        The methods that differ significantly, and all other methods.
    """
    apart: list[str] = []
    rest: list[str] = []
    for (one, another), difference in differences.items():
        if best not in (one, another):
            continue
        other = title(another if one == best else one)
        is_apart = difference.p_value < SIGNIFICANT
        (apart if is_apart else rest).append(other)
    return apart, rest


def _common_conditions(
    rows: Sequence[Row], labels: Sequence[str], queries: QueryRows | None
) -> list[dict[str, Answers]]:
    """Returns the conditions in which the answers of all methods are known.

    Args:
        rows: rows of a metric.
        labels: labels of all methods.
        queries: the answers from which the rows were computed.

    Returns:
        For each condition: label -> the answers.
    """
    if queries is None:
        return []
    asked = {answers.identity: answers for answers in queries.answers}
    table: dict[tuple, dict[str, Answers]] = {}
    for row in rows:
        if row.identity in asked:
            by_label = table.setdefault(row.without("method"), {})
            by_label[row.label] = asked[row.identity]
    return [
        by_label for by_label in table.values() if len(by_label) == len(labels)
    ]


def _lead(best: str, apart: Sequence[str], rest: Sequence[str]) -> str:
    """Returns the clause of `lead_by_right_answers`.

    Args:
        best: label of the method with the greatest R@1.
        apart: titles of the methods that differ significantly from it.
        rest: titles of all other methods.
    """
    text = f"the greatest R@1, of {title(best)}, "
    if not rest:
        return f"{text}differs significantly from all others"
    text += "does not differ significantly from "
    if not apart and len(rest) > 2:
        return f"{text}any other"
    return f"{text}{listed(rest)}"
