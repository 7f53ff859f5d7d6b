"""Computes numbers from a table of results or of queries.

Intervals of interaction effects of two causes (`excesses`) come from sign flips
over blocks of street, see `evaluation.recognition.sign_flips`. Rank
correlations have no interval, because conditions of one map are not
independent.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
import itertools
import math
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from evaluation.recognition import (
    UNKNOWN,
    jackknife_interval,
    kept_share,
    leave_one_out,
    metric_named,
    weighted_metrics,
)
from evaluation.results.keys import CAUSE, LEVEL, NO_CAUSE, Key, check_columns
from evaluation.results.table import Answers, QueryRows, Results, Row

# Factor: what updates the map of several drives.
MAINTAIN = "database.maintain"
# Its value without updates.
_NOT_MAINTAINED = "none"
# Its value with exact updates.
_EXACTLY = "truth"
# Joins the names of causes that come together.
_AND = "+"
# Shares of a result until which `lifetimes` counts.
_LEFT = (0.9, 0.5)
# Least number of points that show a trend.
LEAST_POINTS = 5


class Mean(NamedTuple):
    """A mean over rows that have the same values in some columns.

    Attributes:
        key: the values in these columns.
        value: the mean.
        least, greatest: least and greatest of the averaged values.
        number: number of averaged values. Rows without a known value are left
            out.
    """

    key: tuple
    value: float
    least: float
    greatest: float
    number: int


def means(rows: Iterable[Row], *columns: str) -> list[Mean]:
    """Returns a mean for each combination of values in given columns.

    Each mean also has the least and the greatest of its values, for example
    over the seeds.

    Raises:
        InputError: there is no such column.

    Example:
        from evaluation import Results, means

        rows = Results.read("study/results.csv").where(metric="auc").rows
        for mean in means(rows, "method", "verified"):
            print(mean.key, mean.value)
    """
    rows = list(rows)
    check_columns(columns, rows)
    groups: dict[tuple, list[float]] = {}
    for row in rows:
        group = groups.setdefault(tuple(row[name] for name in columns), [])
        if not math.isnan(row.value):
            group.append(row.value)
    nothing = [math.nan]
    return [
        Mean(
            key,
            float(np.mean(values or nothing)),
            min(values or nothing),
            max(values or nothing),
            len(values),
        )
        for key, values in groups.items()
    ]


class Summary(NamedTuple):
    """A number computed from a table, with its 95 % interval or range.

    Attributes:
        what: name of the number.
        map: name of the map.
        task: the task from whose results the number is computed.
        method: name of the method, with its settings.
        verified: whether geometric verification was used, which rejects places
            by the method's own pose estimate.
        value: the number.
        low, high: limits of the number's interval or range; NaN if unknown.
        n: number of conditions from which the number is computed; None if
            unknown.
    """

    what: str
    map: str
    task: str
    method: str
    verified: bool
    value: float
    low: float = math.nan
    high: float = math.nan
    n: int | None = None

    @classmethod
    def of(
        cls,
        what: str,
        key: Key,
        value: float,
        low: float = math.nan,
        high: float = math.nan,
    ) -> Summary:
        """Returns a number of one method on one map, with its interval.

        Args:
            what: name of the number.
            key: names the map, the task and the method, and says whether
                geometric verification was used.
            value: the number itself.
            low, high: its interval or range.
        """
        of_method = key.map, key.task, key.label, key.verified
        return cls(what, *of_method, value, low, high)


def excesses(queries: QueryRows) -> list[Summary]:
    """Returns how much more AUC two causes cost together than expected.

    A cause is a kind of change, such as snow or traffic.

    Let a and b be the shares of the baseline's AUC that are left under each
    cause by itself, and ab the share that is left under both causes together.
    The excess is the product a * b minus ab. The excess is 0 if the causes do
    not interact, because the shares then multiply.

    The result has a summary for each pair of causes that were measured both
    together and each by itself. The two causes together are a cause whose name
    joins both names by "+". By itself, each cause is taken at its strongest
    level. AUCs are means over the seeds.
    """
    conditions: dict[tuple, list[Answers]] = {}
    levels: dict[object, Any] = {}
    for answers in queries.answers:
        conditions.setdefault(answers.without("seed"), []).append(answers)
        case = answers.map, answers[CAUSE]
        levels[case] = max(answers[LEVEL] or 0, levels.get(case, 0))
    found = []
    for both in conditions.values():
        key = both[0]
        names = str(key[CAUSE]).split(_AND)
        alone = [(NO_CAUSE, 0), *((n, levels.get((key.map, n))) for n in names)]
        moved = (
            {**key.factors, CAUSE: cause, LEVEL: level}
            for cause, level in alone
        )
        groups = [
            conditions.get(replace(key, factors=factors).without("seed"), [])
            for factors in moved
        ]
        if len(names) != 2 or not all(groups):
            continue
        baseline, *kept = (
            float(np.mean([answers.outcomes.curve.auc for answers in group]))
            for group in (*groups, both)
        )
        first, second, together = (float(kept_share(k, baseline)) for k in kept)
        excess = first * second - together
        interval = UNKNOWN
        if (
            baseline > 0.0
            and len({len(g[0].outcomes) for g in (*groups, both)}) == 1
        ):
            base, *without = (
                np.mean([_auc_without_blocks(a, key) for a in group], axis=0)
                for group in (*groups, both)
            )
            a, b, ab = (kept_share(one, base) for one in without)
            _, sizes = np.unique(key.outcomes.own_blocks, return_counts=True)
            reach = 1.0 / baseline
            interval = jackknife_interval(
                excess,
                a * b - ab,
                sizes.astype(float),
                (excess - reach, excess + reach),
            )
        found.append(
            Summary.of(
                f"excess of {' and '.join(names)}",
                key,
                excess,
                interval.low,
                interval.high,
            )
        )
    return found


def _auc_without_blocks(answers: Answers, key: Answers) -> np.ndarray:
    """Returns the AUC (N,) without each of the blocks of other answers."""
    left = leave_one_out(key.outcomes)
    return weighted_metrics(answers.outcomes, left).auc


def lifetime(
    times: Sequence[float], kept: Sequence[float], left: float
) -> float:
    """Returns the time at which only a given share is left.

    Args:
        times: (N,) ascending times.
        kept: (N,) shares at these times, the first of which is 1. The share
            changes linearly between two times.
        left: the given share.

    Returns:
        The time; infinite if more than `left` remains at the last time, and NaN
        if a share is unknown.
    """
    if any(math.isnan(share) for share in kept):
        return math.nan
    for k in range(1, len(times)):
        if kept[k] <= left:
            fall = kept[k - 1] - kept[k]
            part = (kept[k - 1] - left) / fall if fall > 0.0 else 0.0
            return times[k - 1] + part * (times[k] - times[k - 1])
    return math.inf


def lifetimes(results: Results, factor: str, metric: str) -> list[Summary]:
    """Returns at which values of a factor 90 % and 50 % of a result are left.

    For example, if the factor is the age of a map, this is the age at which a
    method still has 90 % of the AUC that it has in a new map.

    Args:
        results: table of results. The rows of the metric contain the share that
            is left at each value of the factor; the least value of the factor
            is its value in the baseline. A row that was measured with a single
            seed, such as a row of the baseline, counts for all seeds.
        factor: name of the factor, whose values are numbers.
        metric: name of a retained share.

    Returns:
        For each share and each condition (such as map and method): the value of
        the factor, computed from the means of all seeds; and as range, the
        least and the greatest value that a single seed gives. A value is
        infinite if more than the share is left at the greatest value of the
        factor in the table.
    """
    groups: dict[tuple, list[Row]] = {}
    for row in results.where(metric=metric).rows:
        if row[factor] is not None:
            groups.setdefault(row.without("seed", factor), []).append(row)
    found = []
    for rows in groups.values():
        curves: dict[float, dict[int, float]] = {}
        for row in rows:
            at = float(row[factor])  # type: ignore[arg-type]  # A number.
            curves.setdefault(at, {})[row.seed] = row.value
        times = sorted(curves)
        seeds = sorted({seed for at in times[1:] for seed in curves[at]})
        for share in _LEFT:
            mean = [float(np.mean(list(curves[at].values()))) for at in times]
            single = [
                lifetime(*_curve_of(curves, seed), share) for seed in seeds
            ] or [lifetime(times, mean, share)]
            found.append(
                Summary.of(
                    f"{factor} until {100.0 * share:g} % is left (of"
                    f" {times[-1]:g})",
                    rows[0],
                    lifetime(times, mean, share),
                    min(single),
                    max(single),
                )
            )
    return found


def _curve_of(
    curves: Mapping[float, Mapping[int, float]], seed: int
) -> tuple[list[float], list[float]]:
    """Returns the times and shares of a seed.

    A time that was measured with a single seed counts for every seed.
    """
    points = [
        (at, shares.get(seed, next(iter(shares.values()))))
        for at, shares in sorted(curves.items())
        if seed in shares or len(shares) == 1
    ]
    return [at for at, _ in points], [share for _, share in points]


def paired_values(results: Results, x: str, y: str) -> list[tuple[Row, float]]:
    """Returns the rows of the metric `y`, each with a value of `x`.

    `x` is a factor or another metric. The value of a metric comes from a row
    with the same condition and, in this order of preference: the same method
    and `verified`; the same method without geometric verification; no method at
    all, as in a row of `tcr_sym`. Rows for which there is no value of `x` are
    left out.
    """
    wider: tuple[tuple[str, ...], ...] = (
        ("task", "protocol"),
        ("task", "protocol", "verified"),
        ("task", "protocol", "verified", "method"),
    )
    values: dict[tuple, float] = {}
    for row in results.where(metric=x).rows:
        values[row.without(*wider[0])] = row.value
        if not row.verified:
            values[row.without(*wider[1])] = row.value
        if not row.method:
            values[row.without(*wider[2])] = row.value
    found = []
    for row in results.where(metric=y).rows:
        at: object = row[x]
        if x not in results.factors:
            keys = (row.without(*names) for names in wider)
            at = next((values[key] for key in keys if key in values), None)
        if isinstance(at, int | float) and not math.isnan(at + row.value):
            found.append((row, float(at)))
    return found


def growths(results: Results, over: str, metric: str) -> list[Summary]:
    """Returns how fast a metric grows with a factor or another metric.

    Rows of the same experiment, map and method, all with or all without
    geometric verification, form a curve of the metric. For each two
    neighbouring points of a curve, the value of a summary is an exponent: 1 if
    the metric grows in proportion to `over` between these points, 2 if the
    metric grows with the square of `over`. Points with a value of 0 have none.

    Args:
        results: the table of results.
        over: name of the factor or metric on the x axis of the curve.
        metric: name of the metric on the y axis of the curve.
    """
    groups: dict[tuple, list[tuple[float, Row]]] = {}
    for row, at in paired_values(results, over, metric):
        key = row.experiment, row.map, row.label, row.verified
        groups.setdefault(key, []).append((at, row))
    found = []
    for curve in groups.values():
        curve.sort(key=itemgetter(0))
        for (less, before), (at, row) in itertools.pairwise(curve):
            if 0.0 < less < at and before.value > 0.0 < row.value:
                grown = math.log(row.value / before.value)
                what = f"exponent of {metric} over {over}, at {at:g}"
                exponent = grown / math.log(at / less)
                found.append(Summary.of(what, row, exponent))
    return found


def correlations(
    results: Results,
    x: str,
    metric: str,
    selection: Mapping[str, object],
) -> list[Summary]:
    """Returns how well a factor or metric predicts where each method fails.

    For each method, the value is Spearman's rank correlation of `x` with 1 -
    `metric`, over the conditions in which `x` and `metric` are known. It
    describes these conditions and has no interval: conditions of one map share
    its streets. Methods with fewer than five such conditions are left out,
    since so few points show no trend.

    Args:
        results: the table of results. All rows must have been measured with
            geometric verification, or all rows without.
        x: name of the factor or metric.
        metric: name of a metric of place recognition.
        selection: name of a column -> value in the rows of `metric` that count,
            so that no control is pooled with what it controls.
    """
    shown = {row.identity for row in results.where(selection).rows}
    points: dict[str, list[tuple[float, float]]] = {}
    for row, at in paired_values(results, x, metric):
        if row.identity not in shown:
            continue
        points.setdefault(row.label, []).append((1.0 - row.value, at))
    found = []
    for method, rows in points.items():
        if len(rows) < LEAST_POINTS:
            continue
        known = np.array(rows)
        found.append(
            Summary(
                f"rank correlation of 1 - {metric} with {x}",
                "",
                "place",
                method,
                False,
                float(_spearman(known)),
                n=len(known),
            )
        )
    return found


def _spearman(values: np.ndarray) -> np.ndarray:
    """Returns Spearman's correlation (...) of two columns, (..., N, 2).

    NaN where a column is constant.
    """
    # Slow to import, and needed by few tables.
    from scipy.stats import rankdata

    ranks = rankdata(values, axis=-2)
    ranks -= ranks.mean(axis=-2, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        ranks /= np.linalg.norm(ranks, axis=-2, keepdims=True)
    # Without the error of the sums, by which the result may leave its range.
    return np.round(ranks.prod(axis=-1).sum(axis=-1), 12)


def worths(results: Results, metric: str) -> list[Summary]:
    """Returns the worth of each change detector that updates a map.

    The worth is 0 if the metric is the same as in a map that is never updated,
    1 if the metric is the same as in a map that is updated by exact labels, and
    negative if the detector does harm. The worth is the quotient of two sums of
    differences, over all conditions that were measured with the detector,
    without updates and with exact updates. If exact updates change nothing,
    there is no worth.
    """
    groups: dict[tuple, dict[str, tuple[Row, float]]] = {}
    for row in results.where(metric=metric).rows:
        factors = dict(row.factors)
        maintain = str(factors.pop(MAINTAIN, ""))
        of_method = row.map, row.task, row.label, row.verified
        condition = row.database, row.query, row.seed, *factors.items()
        group = groups.setdefault((*of_method, *condition), {})
        group[maintain] = row, row.value
    ways: dict[tuple, list[tuple[Row, float, float]]] = {}
    for group in groups.values():
        if not {_NOT_MAINTAINED, _EXACTLY} <= group.keys():
            continue
        (_, start), (_, end) = group[_NOT_MAINTAINED], group[_EXACTLY]
        for maintain, (row, value) in group.items():
            way = value - start, end - start
            if maintain in (_NOT_MAINTAINED, _EXACTLY) or any(
                map(math.isnan, way)
            ):
                continue
            name = maintain, row.map, row.task, row.label, row.verified
            ways.setdefault(name, []).append((row, *way))
    found = []
    for (maintain, *_), measured in ways.items():
        row = measured[0][0]
        whole = sum(end for _, _, end in measured)
        if whole == 0.0:
            continue
        share = sum(way for _, way, _ in measured) / whole
        what = f"worth of {maintain}, of the way to {_EXACTLY}: {metric}"
        summary = Summary.of(what, row, share)
        found.append(summary._replace(n=len(measured)))
    return found


def summarised(
    results: Results,
    queries: QueryRows | None,
    charts: Iterable[Mapping[str, Any]],
) -> list[Summary]:
    """Returns numbers that sum up an experiment's charts.

    A scatter plot is summed up by the function `correlations` of this module. A
    chart of the kind `lines` is summed up by `lifetimes` if its metric is a
    retained share, and by `growths` if its metric grows with a database. A
    chart over the ways of updating a map is summed up by `worths`. Other charts
    give no numbers. For an experiment with the factor `cause`, the result also
    contains the numbers of `excesses`.

    Args:
        results: all results of the experiment.
        queries: answers to single queries, for `excesses`; None to leave out
            `excesses`.
        charts: the charts as in the file of the experiment.
    """
    found = []
    for chart in charts:
        over, metric = str(chart.get("over")), str(chart.get("metric"))
        if chart.get("kind") == "scatter":
            x, y = str(chart.get("x")), str(chart.get("y"))
            chosen = {
                name: value
                for name, value in chart.items()
                if name not in ("kind", "x", "y")
            }
            found += correlations(results.where(verified=False), x, y, chosen)
        elif over == MAINTAIN:
            found += worths(results, metric)
        elif chart.get("kind") == "lines" and metric_named(metric).share_of:
            found += lifetimes(results, over, metric)
        elif chart.get("kind") == "lines" and metric_named(metric).grows:
            x = "places" if "places" in results.distinct("metric") else over
            found += growths(results, x, metric)
    if queries is not None and CAUSE in queries.factors:
        found += excesses(queries)
    return found
