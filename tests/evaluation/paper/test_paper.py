"""The values that the paper prints."""

import math

import numpy as np
import pytest

from evaluation.paper import paper, paper_section
from evaluation.results import OWN, STAGE, Answers, QueryRows, Results, Row


def test_paper_values():
    change = paper().changes
    assert len(change) == 9
    # The first misprint: Table I prints 0.1120 here.
    assert change["downtown", "01", "04"] == 0.1674
    recognition = paper().recognitions
    assert len(recognition) == 40
    # The second: R@1 is printed as 0.9626.
    value = recognition["riverside", "02", "01", "ring++"]
    assert value.recall_at_1 == 0.7626
    # All of RING++ then obeys F1 = 2 R / (1 + R), to the printed digits.
    assert paper().modes["ring++"] == "filtered"
    for key, value in recognition.items():
        if key[3] == "ring++":
            r = value.recall_at_1
            assert value.f1_max == pytest.approx(2 * r / (1 + r), abs=1.1e-4)


@pytest.mark.parametrize(
    ("method", "changes", "is_shown"),
    [
        ("solid", {}, True),
        ("solid", {"protocol": "random-yaw"}, False),
        ("solid", {"verified": True}, False),
        ("solid", {"factors": {STAGE: "last"}}, False),
        ("solid", {"map": "town"}, False),
        ("layered-overlap", {}, False),
    ],
)
def test_what_the_paper_measured_is_shown_beside_it(method, changes, is_shown):
    key = {
        "experiment": "stages",
        "map": "riverside",
        "database": "a",
        "query": "b",
        "seed": 1,
        "factors": {STAGE: OWN},
        "verified": False,
        "protocol": "paper",
    }
    change = key | {"task": "change", "method": "", "metric": "tcr_sym"}
    columns = {
        "query_frame": np.arange(4),
        "score": np.array([0.9, 0.8, 0.7, 0.6]),
        "correct": np.array([True, True, False, True]),
        "has_match": np.ones(4, bool),
    }
    answers = Answers(
        **(key | {"task": "place", "method": method} | changes), columns=columns
    )
    section = paper_section(
        Results.of([Row(**change, value=0.125)]),
        QueryRows.of([answers]),
        {"a": "01", "b": "02"},
    )
    assert "0.1250<small>0.0986 / 0.092</small>" in section.body
    # The AUC of SOLiD in the paper and in the shipped city, and our R@1.
    for number in ("0.0703 / 0.341", "0.7500"):
        assert (number in section.body) == is_shown


@pytest.mark.parametrize(
    ("city", "value"), [("town", 0.125), ("riverside", math.nan)]
)
def test_no_section_of_other_cities_or_unknown_changes(city, value):
    change = Row(
        experiment="stages",
        map=city,
        database="a",
        query="b",
        seed=1,
        factors={STAGE: OWN},
        verified=False,
        protocol="paper",
        task="change",
        method="",
        metric="tcr_sym",
        value=value,
    )
    stages = {"a": "01", "b": "02"}
    for rows in ([], [change]):
        results = Results.of(rows)
        assert paper_section(results, QueryRows.of([]), stages) is None
