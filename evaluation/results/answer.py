"""The answer of a page to its question: what a change costs each method.

A change is a factor that goes from a first value, the baseline, to a last one.
Its cost is the share of a metric that is lost, for each pair of drives; of
several pairs, the median counts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any, NamedTuple, TypeAlias

from cns_drake.base import InputError
from evaluation.recognition import SIGNIFICANT, kept_share, metric_named
from evaluation.results.charts.words import change_words, in_words
from evaluation.results.compared_answers import compared_answers
from evaluation.results.headlines import (
    from_least_to_greatest,
    lead_by_right_answers,
    listed,
)
from evaluation.results.keys import CAUSE, PROTOCOL_BASE, SETTINGS
from evaluation.results.method_names import in_table_order, title
from evaluation.results.summaries import means, median_kept
from evaluation.results.table import QueryRows, Results, Row

DrivePair: TypeAlias = tuple[str, str, str]
# Columns that say which drives are compared.
_PAIR = ("map", "database", "query")
# The sign of per cent never begins a line.
_PERCENT = "{:.0f}\N{NO-BREAK SPACE}%"
# From this value on, a share is 1.00 as texts show it.
_CEILING = 0.995
# Greatest number of words of a headline.
_MOST_WORDS = 25
# Greatest number of methods of which a sentence names each.
_FEW = 2
# Greatest number of methods that a sentence names with geometric verification.
_MOST_NAMED = 3
# Metrics of which a page tells the cost, as a loss of AUC.
_OF_AUC = ("auc", "relative_auc")
_VERIFIED = "with geometric verification"


class Answer(NamedTuple):
    """The answer of a page.

    Attributes:
        headline: a sentence on what the change costs, without a full stop.
        evidence: sentences on which differences are significant; empty if that
            is unknown.
    """

    headline: str
    evidence: str


@dataclass(frozen=True)
class Change:
    """A metric of methods at the first and the last value of a factor.

    Attributes:
        over: name of the factor.
        before, after: its first and its last value.
        metric: name of the metric.
        methods: names of the methods, as in legends.
        pairs: pairs of drives that have both ends: map, database and query.
        ends: (method, whether with geometric verification, pair) -> the metric
            at both ends, NaN where it is unknown.
    """

    over: str
    before: object
    after: object
    metric: str
    methods: Sequence[str]
    pairs: Sequence[DrivePair]
    ends: Mapping[tuple[str, bool, DrivePair], tuple[float, float]]

    @property
    def verifications(self) -> list[bool]:
        """Whether there are rows without, and with geometric verification."""
        return sorted({verified for _, verified, _ in self.ends})

    def share(self, method: str, verified: bool) -> float:
        """Returns the retained share, the median of all pairs."""
        ends = [self.ends[method, verified, pair] for pair in self.pairs]
        return median_kept(
            float(kept_share(after, before)) for before, after in ends
        )

    def shares(self, verified: bool) -> dict[str, float]:
        """Returns method -> its retained share, if that is known."""
        found = {name: self.share(name, verified) for name in self.methods}
        return {n: one for n, one in found.items() if not math.isnan(one)}

    def is_at_ceiling(self, method: str, verified: bool) -> bool:
        """Whether all values are 1.00, the most, so that no loss is seen."""
        return metric_named(self.metric).greatest == 1.0 and all(
            end >= _CEILING
            for pair in self.pairs
            for end in self.ends[method, verified, pair]
        )


def change_of(
    rows: Sequence[Row], over: str, before: object, after: object
) -> Change:
    """Returns a metric of methods at both ends of a factor.

    Args:
        rows: rows of one metric; of several rows of the same method, pair and
            value of the factor, such as those of several seeds, the mean
            counts.
        over: name of the factor.
        before, after: its first and its last value.

    Raises:
        InputError: no pair of drives was measured at both ends.
    """
    value_at = {
        (title(mean.key[0]), bool(mean.key[1]), mean.key[2:5], mean.key[5]): (
            mean.value
        )
        for mean in means(rows, "label", "verified", *_PAIR, over)
    }
    at_start, at_end = (
        dict.fromkeys(pair for _, _, pair, v in value_at if v == value)
        for value in (before, after)
    )
    pairs = [pair for pair in at_start if pair in at_end]
    if not pairs:
        raise InputError(f"{over}: no pair of drives has both ends")
    methods = [title(n) for n in in_table_order(row.label for row in rows)]
    ends = {
        (name, verified, pair): (
            value_at.get((name, verified, pair, before), math.nan),
            value_at.get((name, verified, pair, after), math.nan),
        )
        for name in methods
        for verified in sorted({bool(row.verified) for row in rows})
        for pair in pairs
    }
    return Change(over, before, after, rows[0].metric, methods, pairs, ends)


def cost_sentence(change: Change) -> str:
    """Returns what a change costs the methods, as a sentence.

    Without geometric verification, the sentence names the methods with the
    least and the greatest cost, or all if there are one or two. With it, the
    sentence names the methods that keep most: up to three, as long as the
    sentence has at most 25 words.
    """
    subject = change_words(change.over, change.before, change.after)
    subject = subject[:1].upper() + subject[1:]
    first, *others = change.verifications
    start = f"{subject} {_cost_clause(change, first)}"
    if first:
        start = f"{_VERIFIED.capitalize()}, {start[:1].lower()}{start[1:]}"
    if not others:
        return start
    for number in range(_MOST_NAMED, 0, -1):
        text = start + _verified_clause(change, number)
        if len(text.split(" ")) <= _MOST_WORDS:
            break
    return text


def _cost_clause(change: Change, verified: bool) -> str:
    """Returns the verb and the costs, without or with verification."""
    metric = in_words(change.metric)
    shares = change.shares(verified)
    if not shares:
        return f"has an unknown cost: without it, no {metric} is above 0"
    full = [name for name in shares if change.is_at_ceiling(name, verified)]
    open_ = {n: one for n, one in shares.items() if n not in full}
    has_gain = max(open_.values(), default=0.0) > 2.0 - _CEILING
    if has_gain:
        text = f"changes the {metric} {_differences(open_)}"
    else:
        text = f"costs {_losses(open_, metric)}" if open_ else "costs"
    if not full:
        return text
    if open_:
        text += ", and costs" if has_gain else ", and"
    names = f"{len(full)} methods" if open_ else "the methods"
    if len(full) <= _FEW:
        names = listed(full)
    return (
        f"{text} {names} nothing that this study can show: 1.00 before and"
        " after"
    )


def _losses(shares: Mapping[str, float], metric: str) -> str:
    """Returns the costs of few methods, or the least and the greatest."""
    lost = {n: max(0.0, 100.0 * (1.0 - one)) for n, one in shares.items()}
    if len(lost) > _FEW:
        return f"{_range(lost, _PERCENT)} of the {metric}"
    each = listed(f"{n} {_PERCENT.format(c)}" for n, c in lost.items())
    return f"{each} of the {metric}"


def _differences(shares: Mapping[str, float]) -> str:
    """Returns changes, of which some are gains, as `_losses` returns costs."""
    form = "{:+d}\N{NO-BREAK SPACE}%"
    found = {n: round(100.0 * (one - 1.0)) for n, one in shares.items()}
    if len(found) > _FEW:
        return f"by {_range(found, form)}"
    return listed(f"of {n} by {form.format(one)}" for n, one in found.items())


def _range(found: Mapping[str, float], form: str) -> str:
    return from_least_to_greatest(found, form).removeprefix("from ")


def _verified_clause(change: Change, number: int) -> str:
    """Returns what is left with geometric verification, as a clause."""
    without, shares = change.shares(False), change.shares(True)
    if not shares:
        return ""
    if all(
        change.is_at_ceiling(n, verified)
        for n in shares
        for verified in (False, True)
    ):
        return f", also {_VERIFIED}"
    if without.keys() == shares.keys() and all(
        abs(one - without[name]) < 1.0 - _CEILING
        for name, one in shares.items()
    ):
        return f"; the same {_VERIFIED}"
    most = sorted(shares, key=lambda name: -shares[name])[:number]
    first, *rest = (
        (name, _PERCENT.format(100.0 * shares[name])) for name in most
    )
    kept = [f"{first[0]} keeps {first[1]}", *map(" ".join, rest)]
    return f"; {_VERIFIED}, {listed(kept)}"


def page_answer(
    results: Results,
    queries: QueryRows | None,
    chart: Mapping[str, Any],
) -> Answer | None:
    """Returns the answer to the question of a page.

    Args:
        results: the table of results, with rows of one protocol.
        queries: the answers from which the table was made; None if unknown.
        chart: description of the first chart, which names the factor and
            selects rows; empty if there is none. If the chart names no factor,
            the answer is on the only factor of the experiment.

    Returns:
        The answer; None if the question is not what a change costs of AUC.
    """
    over = _asked_factor(results, chart)
    if over is None:
        return None
    fields = {"kind", "over", "metric", "x", "y", "verified"}
    chosen = {n: v for n, v in chart.items() if n not in fields and n != over}
    rows = results.where({"task": "place", **chosen}, metric="auc")
    rows, _ = rows.defined()
    values = rows.distinct(over)
    if chart.get("kind") in ("lines", "scatter") and not any(
        isinstance(value, str) for value in values
    ):
        values = sorted(values)
    if not values:
        return None
    if len(values) < 2:
        return Answer(_without_baseline(rows.rows), "")
    try:
        change = change_of(rows.rows, over, values[0], values[-1])
    except InputError:
        return None
    return Answer(cost_sentence(change), _evidence(change, rows, queries))


def _asked_factor(results: Results, chart: Mapping[str, Any]) -> str | None:
    """Returns the factor whose cost in AUC a page tells; None if it does not.

    A page whose first chart compares causes tells of these.
    """
    kind = chart.get("kind")
    if kind == "matrix" or chart.get("metric", "auc") not in _OF_AUC:
        return None
    if kind in ("dumbbell", "lines"):
        over = str(chart.get("over"))
        return None if over.startswith(SETTINGS) or over == "map" else over
    if chart.get("y", "auc") not in _OF_AUC or CAUSE in results.factors:
        return None
    varied = [
        name
        for name in results.factors
        if not name.startswith((SETTINGS, PROTOCOL_BASE))
        and len(results.where(metric="auc").distinct(name)) > 1
    ]
    return varied[0] if len(varied) == 1 else None


def _without_baseline(rows: Iterable[Row]) -> str:
    """Returns the AUC of the methods, of a study without a baseline."""
    by_verification: dict[bool, dict[str, float]] = {}
    for mean in means(rows, "label", "verified"):
        of_verification = by_verification.setdefault(bool(mean.key[1]), {})
        of_verification[title(mean.key[0])] = mean.value
    told = [
        (f"{_VERIFIED}, " if verified else "") + from_least_to_greatest(found)
        for verified, found in sorted(by_verification.items())
    ]
    text = "Without a baseline, this study cannot show what the change costs"
    return f"{text}; AUC {'; '.join(told)}"


def _evidence(change: Change, rows: Results, queries: QueryRows | None) -> str:
    """Returns sentences on which differences of R@1 are significant."""
    number = len(change.pairs)
    found = [f"Medians of {number} pairs of drives."] if number > 1 else []
    if queries is None:
        return " ".join(found)
    told = []
    for verified in change.verifications:
        apart, rest = _significant_losses(change, verified, queries)
        if apart or rest:
            told.append((verified, apart, rest))
    if told and not any(apart for _, apart, _ in told):
        asked = _number_of_queries(change, queries)
        found.append(
            f"With {asked} queries, this study cannot show that any difference"
            " of R@1 is more than chance."
        )
    elif told:
        clauses = [
            f"{f'{_VERIFIED}, ' if verified else ''}for {_which(apart, rest)}"
            for verified, apart, rest in told
        ]
        found.append(f"The change of R@1 is significant {'; '.join(clauses)}.")
    verified = change.verifications[-1]
    at_end = rows.where({change.over: change.after}, verified=verified)
    lead = lead_by_right_answers(at_end.rows, queries)
    if lead:
        where = f", {_VERIFIED}" if verified else ""
        found.append(f"After it{where}, {lead}.")
    return " ".join(found)


def _which(apart: Sequence[str], rest: Sequence[str]) -> str:
    """Returns for which methods a difference is significant, in words."""
    if not rest:
        return "every method"
    if not apart:
        return "no method"
    if len(rest) < len(apart):
        return f"all methods but {listed(rest)}"
    return f"{listed(apart)} only"


def _significant_losses(
    change: Change, verified: bool, queries: QueryRows
) -> tuple[list[str], list[str]]:
    """Divides methods by whether the change makes a significant difference.

    Returns:
        The methods whose R@1 changes with a p-value below 0.05, corrected
        (Bonferroni) for the number of methods, and all other methods.
    """
    ends: dict[str, dict[tuple, dict[object, Any]]] = {}
    for answers in queries.answers:
        if answers.task == "place" and bool(answers.verified) == verified:
            of_method = ends.setdefault(title(answers.label), {})
            condition = of_method.setdefault(answers.without(change.over), {})
            condition[answers[change.over]] = answers
    p_values = {}
    for name in change.methods:
        both = [
            (found[change.before], found[change.after])
            for found in ends.get(name, {}).values()
            if change.before in found and change.after in found
        ]
        if not both:
            continue
        before, after = zip(*both, strict=True)
        try:
            compared = compared_answers({"before": before, "after": after})
        except InputError:
            continue  # The change has other queries.
        (difference,) = compared.values()
        p_values[name] = difference.p_value
    limit = SIGNIFICANT / max(1, len(p_values))
    return (
        [name for name, p in p_values.items() if p < limit],
        [name for name, p in p_values.items() if p >= limit],
    )


def _number_of_queries(change: Change, queries: QueryRows) -> int:
    """Returns the number of different queries at the last value."""
    return sum(
        {
            (a.map, a.query): len(a.columns["query_frame"])
            for a in queries.answers
            if a.task == "place" and a[change.over] == change.after
        }.values()
    )
