"""Lifetimes, and what is left after years."""

import csv
import io
import math

import numpy as np
import pytest

from evaluation.recognition.pose_errors import PoseErrors
from evaluation.recognition.query_outcomes import judge
from evaluation.recognition.rung_outcome import RungOutcome
from evaluation.report.years import (
    BACKWARD,
    FORWARD,
    AgedPair,
    draw_years,
    lifetime,
    lifetime_table,
    year_rows,
    year_table,
    year_text,
)


def _outcome(right, overlap):
    """Q queries of which the first ones are right; all scores differ."""
    number = 10
    scores = np.zeros((number, 2))
    scores[:, 0] = np.linspace(1.0, 0.5, number)
    matches = np.zeros((number, 2), bool)
    matches[np.arange(number), (np.arange(number) >= right).astype(int)] = True
    errors = np.where(np.arange(number) < right, 0.1, 50.0)
    return RungOutcome(
        "solid",
        False,
        judge(scores, matches),
        np.arange(number),
        np.arange(number),
        np.zeros((number, 3)),
        [""] * number,
        np.arange(number),
        np.zeros(number),
        PoseErrors(errors, np.zeros(number)),
        np.full(number, overlap),
    )


@pytest.fixture
def rows():
    pairs = [AgedPair("town", 0, 0, FORWARD, 0.0, [_outcome(10, 0.8)])]
    for seed, right in ((1, (9, 6)), (2, (8, 4))):
        for year, number, seen in zip((5, 20), right, (0.7, 0.5), strict=True):
            pairs += [
                AgedPair("town", year, seed, way, 0.1, [_outcome(number, seen)])
                for way in (FORWARD, BACKWARD)
            ]
    return year_rows(pairs)


def test_lifetimes_of_straight_lines():
    assert lifetime([0, 10], [1.0, 0.5], 0.9) == pytest.approx(2.0)
    assert lifetime([0, 10], [1.0, 0.5], 0.5) == pytest.approx(10.0)
    assert lifetime([0, 10, 20], [1.0, 1.0, 0.8], 0.9) == pytest.approx(15.0)
    assert math.isinf(lifetime([0, 10], [1.0, 0.901], 0.9))
    assert lifetime([0, 1, 5], [1.0, 0.4, 1.0], 0.5) == pytest.approx(5 / 6)


def test_shares_that_are_left(rows):
    """The right ones have the best scores: AUC is the share that is right."""
    found = {
        (row.year, row.seed, row.task): row
        for row in rows
        if row.direction == FORWARD
    }
    assert found[0, 0, "place"].kept == 1.0
    assert found[5, 1, "pose"].kept == pytest.approx(0.9)
    assert found[20, 2, "pose"].value == pytest.approx(0.4)
    assert found[5, 1, "place"].r1 == pytest.approx(0.9)
    assert found[20, 1, "place"].visible_change == pytest.approx(0.3)
    before = found[5, 2, "place"]
    assert before.kept_low <= before.kept <= before.kept_high


def test_tables(rows):
    table = list(csv.DictReader(io.StringIO(year_table(rows).to_csv())))
    first = ["map", "year", "seed", "task", "method", "gate", "value", "kept"]
    assert list(table[0])[:8] == first
    assert len(table) == 2 * (1 + 2 * 2 * 2)
    lives = list(csv.DictReader(io.StringIO(lifetime_table(rows).to_csv())))
    pose = next(row for row in lives if row["task"] == "pose")
    # The mean falls from 1 to 0.85 in 5 years, then to 0.5 in 20.
    assert float(pose["tenth"]) == pytest.approx(0.1 / 0.15 * 5, abs=0.06)
    assert float(pose["half"]) == pytest.approx(20.0, abs=0.06)
    assert pose["half_high"] == "over 20"
    # Seed 2 falls from 0.8 to 0.4.
    assert float(pose["half_low"]) == pytest.approx(16.25, abs=0.06)
    assert {row["direction"] for row in lives} == {FORWARD, BACKWARD}


def test_words_and_chart(rows, tmp_path):
    text = year_text(rows)
    assert "town, 20 years: TCR_sym 0.100, visible change 30.0%" in text
    draw_years(rows, tmp_path / "years")
    assert (tmp_path / "years.png").stat().st_size > 1000


def test_other_tasks_have_rows_of_their_own():
    pairs = [
        AgedPair(
            "town",
            year,
            seed,
            FORWARD,
            0.0,
            [],
            {("localise", "gicp"): (value, 10), ("map", "distance"): (0.5, 7)},
        )
        for year, seed, value in ((0, 0, 0.8), (5, 1, 0.6), (5, 2, 0.2))
    ]
    found = year_rows(pairs)
    assert [row.task for row in found] == ["localise", "map"] * 3
    assert [row.value for row in found] == [0.8, 0.5, 0.6, 0.5, 0.2, 0.5]
    assert [row.queries for row in found] == [10, 7] * 3
    kept = [row.kept for row in found if row.task == "localise"]
    assert kept == pytest.approx([1.0, 0.75, 0.25])
    # In the mean half is left after five years; labels have no lifetime.
    table = lifetime_table(found)
    (line,) = table.rows
    assert line[table.header.index("half")] == "5.0"
    assert all(math.isnan(row.kept) for row in found if row.task == "map")
