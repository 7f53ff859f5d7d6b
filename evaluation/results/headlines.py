"""Sentences on what a chart or a report shows, and on what it does not show.

A method is *told apart* from another if the difference of their AUC has a
corrected p-value below 0.05, see `evaluation.recognition.metrics`.
"""

from collections.abc import Iterable, Mapping, Sequence
import math

from evaluation.recognition.metrics import compared_by_auc
from evaluation.results.summaries import check_same_queries, drive_number
from evaluation.results.table import Answers, QueryRows, Row
from evaluation.results.table_forms import title

SIGNIFICANT = 0.05


def listed(names: Iterable[str]) -> str:
    """Returns names as text, such as `a, b and c`."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def from_least_to_greatest(
    found: Mapping[str, float], form: str = "{:.2f}"
) -> str:
    """Returns the least and the greatest number of some methods as text.

    Args:
        found: method -> its number; NaN if it is unknown.
        form: format of a number.
    """
    known = {n: value for n, value in found.items() if not math.isnan(value)}
    if not known:
        return "unknown"
    ends = [f(known, key=known.__getitem__) for f in (min, max)]
    least, greatest = (form.format(known[name]) for name in ends)
    if least == greatest:
        return least
    return f"from {least} ({ends[0]}) to {greatest} ({ends[1]})"


def told_apart(
    best: str, p_values: Mapping[tuple[str, str], float]
) -> tuple[list[str], list[str]]:
    """Returns the methods that the best is told apart from, and the others.

    Args:
        best: label of the best method.
        p_values: (one method, another) -> corrected p-value of their
            difference; NaN if it is unknown.
    """
    found: tuple[list[str], list[str]] = ([], [])
    for pair, p in p_values.items():
        if best in pair:
            other = pair[1 - pair.index(best)]
            found[not p < SIGNIFICANT].append(title(other))
    return found


def greatest_auc(rows: Sequence[Row], queries: QueryRows | None) -> str:
    """Returns from which methods that with the greatest AUC is told apart.

    Args:
        rows: rows of the metric `auc`.
        queries: the answers behind them.

    Returns:
        A clause; empty if there is one method, or the answers are unknown.
    """
    asked = {one.but(): one for one in queries.answers} if queries else {}
    table: dict[tuple, dict[str, tuple[float, Answers]]] = {}
    for row in rows:
        if row.but() in asked:
            some = table.setdefault(row.but("method"), {})
            some[row.label] = row.value, asked[row.but()]
    labels = {row.label: None for row in rows}
    common = [some for some in table.values() if len(some) == len(labels)]
    if len(labels) < 2 or not common:
        return ""
    for some in common:
        (_, first), *others = some.values()
        for _, other in others:
            check_same_queries(first, other)
    compared = compared_by_auc(
        {n: [some[n][1].outcomes for some in common] for n in labels},
        [drive_number(next(iter(some.values()))[1]) for some in common],
    )
    best = max(labels, key=lambda n: sum(some[n][0] for some in common))
    p_values = {pair: p for pair, (_, p) in compared.items()}
    apart, rest = told_apart(best, p_values)
    text = f"the greatest AUC, of {title(best)}, is "
    if not rest:
        return f"{text}told apart from all others"
    if not apart and len(rest) > 2:
        return f"{text}not told apart from any other"
    if not apart:
        return f"{text}not told apart from {listed(rest)}"
    return f"{text}told apart from {listed(apart)}, not from {listed(rest)}"
