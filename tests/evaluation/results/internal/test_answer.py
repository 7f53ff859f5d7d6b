"""The headline of a page: what a change costs, from rows by hand."""

import numpy as np
import pytest

from evaluation.results import Answers, QueryRows, Results, Row
from evaluation.results.answer import page_answer
from evaluation.results.charts.words import change_words

STAGE = "both.stage"
DUMBBELL = {"kind": "dumbbell", "over": STAGE, "metric": "auc"}


def key(method, factors, verified=False, town="town"):
    return {
        "experiment": "e",
        "map": town,
        "database": f"{town}_01",
        "query": f"{town}_02",
        "seed": 1,
        "factors": factors,
        "task": "place",
        "method": method,
        "verified": verified,
        "protocol": "random-yaw",
    }


def table(values, over=STAGE, ends=("last", "own")):
    """Returns rows: (method, verified, map) -> AUC before and after."""
    return Results.of(
        Row(
            **key(method, {over: at}, verified, town), metric="auc", value=value
        )
        for (method, verified, town), both in values.items()
        for at, value in zip(ends, both, strict=True)
    )


def headline(results, chart=DUMBBELL):
    answer = page_answer(results, None, chart)
    return answer.headline.replace("\N{NO-BREAK SPACE}", " ")


def test_a_headline_tells_costs_without_and_with_verification():
    results = table(
        {
            ("btc", False, "a"): (0.8, 0.4),
            ("btc", True, "a"): (0.8, 0.6),
            ("layered-overlap", False, "a"): (1.0, 0.9),
            ("layered-overlap", True, "a"): (1.0, 1.0),
            ("solid", False, "a"): (0.5, 0.1),
            ("solid", True, "a"): (0.5, 0.1),
            ("ring++", False, "a"): (0.8, 0.2),
            ("ring++", True, "a"): (0.8, 0.4),
        }
    )
    wanted = (
        "A rebuilt city costs 10 % (Layered overlap) to 80 % (SOLiD) of the"
        " AUC; with geometric verification, Layered overlap keeps 100 %, BTC"
        " 75 % and RING++ 50 %"
    )
    assert headline(results) == wanted
    # A page without a chart has the same answer.
    assert headline(results, {}) == wanted
    assert len(wanted.replace(" %", "%").split()) <= 30


def test_of_several_maps_the_median_share_counts():
    shares = {"a": 0.9, "b": 0.5, "c": 0.8}
    results = table(
        {("btc", False, town): (0.5, 0.5 * s) for town, s in shares.items()}
    )
    assert headline(results) == "A rebuilt city costs BTC 20 % of the AUC"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        (
            {("ring++", False, "a"): (1.0, 0.999)},
            "costs RING++ nothing that this study can show: 1.00 before and"
            " after",
        ),
        (
            {("ring++", False, "a"): (1.0, 1.0), ("ring++", True, "a"): (1, 1)},
            "costs RING++ nothing that this study can show: 1.00 before and"
            " after, also with geometric verification",
        ),
        (
            {("ring++", False, "a"): (1.0, 1.0), ("btc", False, "a"): (1, 0.9)},
            "costs BTC 10 % of the AUC, and RING++ nothing that this study can"
            " show: 1.00 before and after",
        ),
        # 1.00 before and less after is a loss.
        (
            {("ring++", False, "a"): (1.0, 0.99)},
            "costs RING++ 1 % of the AUC",
        ),
        (
            {("btc", False, "a"): (0.8, 0.4), ("btc", True, "a"): (1, 0.5)},
            "costs BTC 50 % of the AUC; the same with geometric"
            " verification",
        ),
        # A gain is not a negative cost.
        (
            {("ring++", False, "a"): (0.5, 0.6), ("btc", False, "a"): (1, 0.9)},
            "changes the AUC of RING++ by +20 % and of BTC by -10 %",
        ),
        (
            {("ring++", False, "a"): (0.0, 0.4)},
            "has an unknown cost: without it, no AUC is above 0",
        ),
    ],
)  # fmt: skip
def test_a_headline_of_an_own_experiment(values, text):
    over = "query.lidars.lidar.xyz"
    results = table(values, over, ("[0, 0, 1.6]", "[0, 0, 1.2]"))
    wanted = f"A LiDAR mounted at z 1.2 instead of 1.6 m {text}"
    assert headline(results, {**DUMBBELL, "over": over}) == wanted


def test_lines_go_from_the_least_to_the_greatest_number():
    results = table({("btc", False, "a"): (0.4, 0.8)}, "query.years", (20, 0))
    chart = {"kind": "lines", "over": "query.years", "metric": "relative_auc"}
    assert headline(results, chart) == (
        "A query of age 20 instead of 0 years costs BTC 50 % of the AUC"
    )


def test_a_scatter_of_one_factor_tells_its_cost():
    results = table(
        {("ring++", False, "a"): (0.8, 0.2)}, "database.missing", (0, 0.6)
    )
    chart = {"kind": "scatter", "x": "tcr_sym", "y": "auc"}
    assert headline(results, chart) == (
        "A map without 60 % of the buildings and plants costs RING++ 75 % of"
        " the AUC"
    )


def test_without_a_baseline_no_cost_is_told():
    results = table(
        {
            (name, verified, "a"): (auc,)
            for name, verified, auc in (
                ("btc", False, 0.4),
                ("btc", True, 0.6),
                ("solid", False, 0.2),
                ("solid", True, 0.2),
            )
        },
        ends=("own",),
    )
    assert headline(results) == (
        "Without a baseline, this study cannot show what the change costs; AUC"
        " from 0.20 (SOLiD) to 0.40 (BTC); with geometric verification, from"
        " 0.20 (SOLiD) to 0.60 (BTC)"
    )


@pytest.mark.parametrize(
    "chart",
    [
        {"kind": "matrix", "over": STAGE, "metric": "auc"},
        {"kind": "dumbbell", "over": STAGE, "metric": "r1"},
        {"kind": "scatter", "x": "tcr_sym", "y": "r1"},
        {"kind": "dumbbell", "over": "methods.btc.crop", "metric": "auc"},
        # No row is selected.
        {**DUMBBELL, "map": "elsewhere"},
        {"kind": "lines"},
    ],
)
def test_other_questions_have_no_answer(chart):
    results = table({("btc", False, "a"): (0.8, 0.4)})
    assert page_answer(results, None, chart) is None


def asked(number, after):
    """Returns tables: all answers are right before, and `after` after."""
    rows, answers = [], []
    for stage, is_right in (("last", np.ones(number, bool)), ("own", after)):
        of_stage = key("btc", {STAGE: stage})
        rows.append(Row(**of_stage, metric="auc", value=is_right.mean()))
        columns = {
            "query_frame": np.arange(number),
            "block": np.arange(number) // 4,
            "score": np.linspace(0.9, 0.1, number),
            "correct": is_right,
            "has_match": np.ones(number, bool),
        }
        answers.append(Answers(**of_stage, columns=columns))
    return Results.of(rows), QueryRows.of(answers)


@pytest.mark.parametrize(
    ("number", "after", "text"),
    [
        (
            80,
            np.zeros(80, bool),
            "The change of R@1 is significant for every method.",
        ),
        # One wrong answer of many.
        (
            40,
            np.arange(40) != 20,
            "With 40 queries, this study cannot show that any difference of R@1"
            " is more than chance.",
        ),
        # One block of queries cannot show anything.
        (
            4,
            np.zeros(4, bool),
            "With 4 queries, this study cannot show that any difference of R@1"
            " is more than chance.",
        ),
    ],
)
def test_the_evidence_says_what_is_significant(number, after, text):
    results, queries = asked(number, after)
    answer = page_answer(results, queries, DUMBBELL)
    assert answer.evidence == text


@pytest.mark.parametrize(
    ("factor", "before", "after", "text"),
    [
        (STAGE, "last", "own", "a rebuilt city"),
        (
            "database.missing",
            0,
            0.6,
            "a map without 60\N{NO-BREAK SPACE}% of the buildings and plants",
        ),
        ("level", 0, 4.0, "level 4 instead of 0"),
        ("years", 0, 40, "a city of age 40 instead of 0 years"),
        ("database.years", 0, 40.0, "a map of age 40 instead of 0 years"),
        (
            "query.transient.snow",
            0,
            0.5,
            "snow 0.5 instead of 0 in the query",
        ),
        ("database.lateral", 0, 4, "lateral 4 instead of 0 m in the database"),
        (
            "query.lidar",
            "vlp-16",
            "os1-64",
            "a LiDAR os1-64 instead of vlp-16 in the query",
        ),
        (
            "both.lidars.lidar.rpy_deg",
            "[0, 0, 0]",
            "[0, 5, 0]",
            "a LiDAR mounted at pitch 5 instead of 0°",
        ),
        (
            "both.lidars.lidar.xyz",
            "[0, 0, 1]",
            "[0, 1, 2]",
            "a LiDAR mounted at xyz 0, 1, 2 instead of 0, 0, 1 m",
        ),
        (
            "database.distractors",
            0,
            1000,
            "a database with 1000 instead of 0 distractors",
        ),
    ],
)
def test_changes_have_words_and_units(factor, before, after, text):
    assert change_words(factor, before, after) == text
