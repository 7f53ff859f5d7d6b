"""Summaries of tables whose numbers are known in closed form."""

import csv
import math
from types import SimpleNamespace

from helpers.result_keys import place_key
import numpy as np
import pytest
from scipy.stats import spearmanr

from evaluation.recognition import Interval, city_interval
from evaluation.results import (
    Answers,
    QueryRows,
    Results,
    Row,
    excesses,
    means,
    rank_methods,
    write_page,
)

YEARS = "database.years"
SNOW = "query.transient.snow"
BLOCKS = np.repeat(np.arange(10), 2)


def row(value, factors, metric="auc", **names):
    return Row(
        **place_key(factors=factors, **names), metric=metric, value=value, n=20
    )


def answers(right, factors, **names):
    """Answers with equal scores to queries that all have a match.

    AUC is the part that is right: precision at recall 1.
    """
    right = np.asarray(right, dtype=bool)
    number = len(right)
    return Answers(
        **place_key(factors=factors, **names),
        columns={
            "query_frame": np.arange(number),
            "block": BLOCKS[:number],
            "correct": right,
            "has_match": np.ones(number, dtype=bool),
            "score": np.full(number, 0.5),
        },
    )


def summarised(folder, rows, charts, queries=None):
    """The summaries beside a page."""
    write_page(Results.of(rows), queries, folder, title="town", charts=charts)
    file = folder / "summaries.csv"
    if not file.exists():
        return []

    def number(text):
        return float(text or "nan")

    with file.open(newline="") as lines:
        return [
            SimpleNamespace(
                what=line["what"],
                method=line["method"],
                verified=line["verified"] == "1",
                n=line["n"],
                **{k: number(line[k]) for k in ("value", "low", "high")},
            )
            for line in csv.DictReader(lines)
        ]


def lines_over(factor, metric):
    return [{"kind": "lines", "over": factor, "metric": metric}]


def firsts(number):
    return np.arange(20) < number


def test_means_stand_between_the_least_and_the_greatest():
    rows = [
        row(0.1 * seed + year / 100.0, {YEARS: year}, seed=seed)
        for seed in (1, 2, 4)
        for year in (0, 5)
    ]
    rows.append(row(math.nan, {YEARS: 5}, seed=5))
    rows.append(row(math.nan, {YEARS: 9}))
    first, second, third = means(rows, YEARS, "method")
    assert first.key == (0, "btc")
    assert first[1:] == pytest.approx((0.7 / 3.0, 0.1, 0.4, 3))
    assert second[1:] == pytest.approx((0.7 / 3.0 + 0.05, 0.15, 0.45, 3))
    assert math.isnan(third.value)
    assert third.number == 0


def test_two_causes_cost_more_than_the_product():
    cause = "cause"
    level = {"level": 1}
    queries = QueryRows.of(
        [
            answers(firsts(20), {cause: "none", "level": 0}),
            answers(firsts(2), {cause: "snow", "level": 1}),
            answers(firsts(10), {cause: "snow", "level": 2}),
            answers(firsts(16), {cause: "leaves", **level}),
            answers(firsts(4), {cause: "snow+leaves", "level": 2}),
            answers(firsts(4), {cause: "snow+rain", "level": 2}),
        ]
    )
    (one,) = excesses(queries)
    assert one.what == "excess of snow and leaves"
    # 50 % and 80 % are left of it alone, and 20 % of both.
    assert one.value == pytest.approx(0.5 * 0.8 - 0.2)
    assert one.low < 0.2 < one.high


def test_lifetimes_of_seeds_surround_that_of_the_mean(tmp_path):
    kept = {0: {0: 1.0}, 10: {1: 0.8, 2: 0.6}, 20: {1: 0.4, 2: 0.2}}
    rows = [
        row(value, {YEARS: year}, metric="relative_auc", seed=seed)
        for year, some in kept.items()
        for seed, value in some.items()
    ]
    tenth, half = summarised(tmp_path, rows, lines_over(YEARS, "relative_auc"))
    assert tenth.what == f"{YEARS} until 90 % is left (of 20)"
    assert half.what == f"{YEARS} until 50 % is left (of 20)"
    # Means are 1, 0.7 and 0.3.
    assert tenth.value == pytest.approx(10.0 / 3.0)
    assert (tenth.low, tenth.high) == pytest.approx((2.5, 5.0))
    assert half.value == pytest.approx(15.0)
    assert (half.low, half.high) == pytest.approx((12.5, 17.5))


def test_a_lifetime_needs_all_shares(tmp_path):
    kept = {
        "a": (1.0, 0.5, 0.2),
        "b": (1.0, 0.5001, 0.2),
        "c": (1, math.nan, 0.2),
    }
    rows = [
        row(value, {YEARS: year}, metric="relative_auc", method=method)
        for method, values in kept.items()
        for year, value in enumerate(values)
    ]
    found = summarised(tmp_path, rows, lines_over(YEARS, "relative_auc"))
    half = {one.method: one.value for one in found if "50 %" in one.what}
    assert half["a"] == 1.0
    assert half["b"] > 1.0
    assert math.isnan(half["c"])


def test_growth_of_a_power_law(tmp_path):
    rows = []
    for number in (50, 100, 200, 800):
        at = {"database.distractors": number - 50}
        rows += [
            row(float(number), at, metric="places"),
            row(float(number), at, metric="places", verified=True),
            # A time that is rounded to 0 grows by no power.
            row(
                3.0 * number**1.5 * (number > 50),
                at,
                metric="query_time",
                task="cost",
            ),
        ]
    found = summarised(
        tmp_path, rows, lines_over("database.distractors", "query_time")
    )
    what = "exponent of query_time over places, at"
    assert [one.what for one in found] == [f"{what} 200", f"{what} 800"]
    assert [one.value for one in found] == pytest.approx([1.5, 1.5])


def test_rank_correlations_are_those_of_scipy(tmp_path):
    rng = np.random.default_rng(3)
    rows, drawn = [], []
    for k in range(25):
        stage = {"both.stage": f"s{k}"}
        tcr = rng.random()
        seen = rng.random()
        auc = np.round(rng.random(), 1)
        drawn.append((tcr, seen, 1.0 - auc))
        rows += [
            row(tcr, stage, metric="tcr_sym", task="change", method=""),
            row(seen, stage, metric="visible_change"),
            row(auc, stage),
        ]
    # A condition without one of them does not count.
    rows.append(row(0.5, {"both.stage": "alone"}))
    tcr, seen, failure = np.transpose(drawn)
    for name, x in (("tcr_sym", tcr), ("visible_change", seen)):
        chart = {"kind": "scatter", "x": name, "y": "auc"}
        (one,) = summarised(tmp_path, rows, [chart])
        expected = spearmanr(failure, x).statistic
        assert one.value == pytest.approx(expected)
        assert math.isnan(one.low)
        assert one.n == "25"


@pytest.mark.parametrize(("number", "is_shown"), [(4, False), (5, True)])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_trend_needs_five_points(tmp_path, number, is_shown, sign):
    rows = [row(0.5 + 0.1 * sign * k, {YEARS: k}) for k in range(number)]
    chart = {"kind": "scatter", "x": YEARS, "y": "auc"}
    found = summarised(tmp_path, rows, [chart])
    assert bool(found) == is_shown
    for one in found:
        # Not 1.0000000000000002, which rounding would make of it.
        assert one.value == -sign


def test_controls_are_not_pooled(tmp_path):
    """A chart of three pairs has no correlation; its controls add none."""
    rows = [
        one
        for k in range(3)
        for stage in ("last", "own")
        for one in (
            row(0.5 + 0.1 * k, {"both.stage": stage, "k": k}),
            row(
                0.1 * k,
                {"both.stage": stage, "k": k},
                method="",
                metric="tcr_sym",
                task="change",
            ),
        )
    ]
    chart = {"kind": "scatter", "x": "tcr_sym", "y": "auc"}
    (pooled,) = summarised(tmp_path / "all", rows, [chart])
    assert pooled.n == "6"
    assert not summarised(
        tmp_path / "own", rows, [{**chart, "both.stage": "own"}]
    )


@pytest.mark.slow
def test_summaries_of_charts(tmp_path):
    rows = [
        *(
            row(value, {YEARS: year}, metric="relative_auc")
            for year, value in ((0, 1.0), (10, 0.6))
        ),
        *(
            row(
                10.0 ** (k * 2),
                {YEARS: 10**k},
                metric="query_time",
                task="cost",
            )
            for k in (0, 1)
        ),
        *(row(0.9 - 0.1 * k, {YEARS: k, "query.nth": k}) for k in range(5)),
    ]
    causes = {"none": (20, 0), "a": (10, 1), "b": (16, 1), "a+b": (4, 1)}
    queries = QueryRows.of(
        answers(firsts(number), {"cause": cause, "level": level})
        for cause, (number, level) in causes.items()
    )
    lines = {"kind": "lines", "over": YEARS}
    charts = [
        {**lines, "metric": "relative_auc"},
        {**lines, "metric": "query_time"},
        {"kind": "scatter", "x": "query.nth", "y": "auc"},
        {"kind": "matrix", "over": "method", "metric": "auc"},
    ]
    found = summarised(tmp_path, rows, charts, queries)
    numbers = {one.what: one.value for one in found}
    assert numbers == pytest.approx(
        {
            f"{YEARS} until 90 % is left (of 10)": 2.5,
            f"{YEARS} until 50 % is left (of 10)": math.inf,
            f"exponent of query_time over {YEARS}, at 10": 2.0,
            "rank correlation of 1 - auc with query.nth": 1.0,
            "excess of a and b": 0.2,
        }
    )
    assert {one.method for one in found} == {"btc"}


def test_a_ranking_counts_what_all_methods_have():
    rows = [
        row(value, {SNOW: snow}, method=method, town=town)
        for method, town, snow, value in (
            ("a", "x", 0, 0.9),
            ("a", "x", 1, 0.7),
            ("a", "y", 0, 0.2),
            ("b", "x", 0, 0.5),
            ("b", "x", 1, 0.5),
            ("b", "y", 0, 0.5),
            ("a", "y", 1, 0.9),
            ("b", "y", 1, math.nan),
        )
    ]
    found = rank_methods(rows)
    assert [one.method for one in found] == ["a", "b"]
    assert [one.value for one in found] == pytest.approx([0.6, 0.5])
    # Two maps say next to nothing.
    assert np.isnan([one.interval.low for one in found]).all()
    assert np.isnan([one.interval.high for one in found]).all()


@pytest.mark.parametrize("metric", ["auc", "query_time"])
def test_the_interval_of_a_mean_over_maps(metric):
    """Maps are the units, and not their conditions."""
    means = np.array([0.5, 0.7, 0.8, 0.6, 0.9, 0.7, 0.8, 0.75])
    rows = [
        Row(
            **place_key(f"town {k}", factors={SNOW: snow}),
            metric=metric,
            value=value + more,
        )
        for snow, more in ((0, -0.1), (1, 0.1))
        for k, value in enumerate(means)
    ]
    (found,) = rank_methods(rows)
    ends = (0.0, 1.0) if metric == "auc" else (0.0, math.inf)
    expected = city_interval(means, np.ones(8), ends)
    assert found.interval.low == pytest.approx(expected.low)
    assert found.interval.high == pytest.approx(expected.high)
    # Seven maps cannot show anything, and conditions of one map neither.
    for some in (
        [row for row in rows if row.map != "town 3"],
        [row for row in rows if row.map == "town 3"],
    ):
        (found,) = rank_methods(some)
        assert math.isnan(found.interval.high)


def test_a_ranking_of_one_condition_has_its_intervals():
    one = Row(**place_key(), metric="auc", value=0.5, low=0.4, high=0.7)
    found = rank_methods([one])
    assert found[0].interval == Interval(0.4, 0.7)
    assert rank_methods([one, row(0.1, {SNOW: 1}, method="b")]) == []


MAINTAIN = "database.maintain"


def maintained(values, year=5, **names):
    return [
        row(value, {MAINTAIN: how, YEARS: year}, metric="r1", **names)
        for how, value in values.items()
    ]


def test_a_detector_is_worth_its_share_of_the_way_to_the_truth(tmp_path):
    """Two conditions: (0.1 + 0.2) of (0.2 + 0.4); harm is negative."""
    rows = [
        *maintained({"none": 0.5, "truth": 0.7, "distance": 0.6}),
        *maintained({"none": 0.4, "truth": 0.8, "distance": 0.6}, seed=2),
        *maintained({"none": 0.5, "truth": 0.6, "m3c2": 0.4}, method="solid"),
        # Nothing to gain; and no exact updates, or others are unknown.
        *maintained({"none": 0.5, "truth": 0.5, "m3c2": 0.5}, verified=True),
        *maintained({"none": 0.5, "distance": 0.9}, year=9),
        *maintained({"none": 0.5, "truth": 0.9, "m3c2": math.nan}, year=7),
    ]
    charts = [{"kind": "matrix", "over": MAINTAIN, "metric": "r1"}]
    found = summarised(tmp_path, rows, charts)
    assert [(one.method, one.verified, one.n) for one in found] == [
        ("btc", False, "2"),
        ("solid", False, "1"),
    ]
    assert [one.value for one in found] == pytest.approx([0.5, -1.0])
    assert found[0].what == "worth of distance, of the way to truth: r1"
