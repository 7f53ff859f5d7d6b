"""The numbers, the table, the figure and the words of a ladder."""

import csv
import io

import numpy as np
import pytest
from scipy.stats import binom

from evaluation.recognition.pose_errors import PoseErrors
from evaluation.recognition.protocol import PAPER_PROTOCOL
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.rung_outcome import FAULTS, RungOutcome
from evaluation.report.ladder import (
    LadderRung,
    MeasuredRung,
    draw_ladder,
    ladder_query_table,
    ladder_rows,
    ladder_table,
    ladder_text,
    pair_table,
    pair_text,
    strongest_causes,
)


def answered(method, gated, is_right, scores=None):
    """An outcome; all queries have a match."""
    right = np.array(is_right, dtype=bool)
    number = len(right)
    return RungOutcome(
        method,
        gated,
        QueryOutcomes(
            np.ones(number) if scores is None else scores,
            right,
            np.ones(number, bool),
            np.where(right, 1.0, np.inf),
            9,
        ),
        query_frames=np.arange(number),
        stamps_ns=np.arange(number) * 50,
        p_WQs=np.zeros((number, 3)),
        match_drives=["town_01"] * number,
        match_frames=np.arange(number),
        distances=np.ones(number),
        pose_errors=PoseErrors.unknown(number),
        overlaps=np.linspace(0.2, 0.8, number),
    )


def measured(cause, level, answers, seed=1):
    """A rung of the ladder of a town."""
    rung = LadderRung("town", "02", "02", cause, level, f"much {cause}", 7.5)
    return MeasuredRung(rung, seed, f"{cause} {seed}", answers)


def cells(rows):
    """Returns the rows of the table, each column -> value."""
    table = ladder_table(rows, PAPER_PROTOCOL, "near")
    return [dict(zip(table.header, row, strict=True)) for row in table.rows]


def part(number, kept):
    """Returns which queries are right: the first ones."""
    return np.arange(number) < kept


@pytest.fixture(scope="module")
def climbed():
    """Snow leaves 45 of 60 queries, and works leave 30, then 15."""
    return [
        measured(
            cause,
            level,
            [
                answered("solid", gated, part(60, kept + 6 * gated))
                for gated in (False, True)
            ],
            seed,
        )
        for cause, level, seed, kept in (
            ("none", 0, 1, 54),
            ("snow", 4, 1, 45),
            ("works", 2, 1, 30),
            ("works", 4, 1, 20),
            ("works", 4, 2, 10),
            ("all", 4, 1, 0),
        )
    ]


def test_the_share_of_auc_that_is_kept(climbed):
    # All scores are equal: the only threshold rejects nothing, and AUC is its
    # precision.
    found = {
        (row.rung.cause, row.rung.level): row
        for row in ladder_rows(climbed)
        if not row.is_gated
    }
    assert found["none", 0].kept.share == 1.0
    assert found["none", 0].kept.interval.low == 1.0
    snow = found["snow", 4]
    assert cells([snow])[0]["r1"] == 0.75
    assert snow.kept.changed == pytest.approx(0.75)
    assert snow.kept.share == pytest.approx(45 / 54)
    low, high = binom.ppf([0.025, 0.975], 54, 45 / 54) / 54
    assert snow.kept.interval.low == pytest.approx(low, abs=0.05)
    assert snow.kept.interval.high == pytest.approx(high, abs=0.05)


def test_draws_are_averaged(climbed):
    rows = [row for row in ladder_rows(climbed) if not row.is_gated]
    (works,) = (
        row for row in rows if (row.rung.cause, row.rung.level) == ("works", 4)
    )
    (shown,) = cells([works])
    assert shown["draws"] == 2
    assert shown["r1"] == pytest.approx(15 / 60)
    assert shown["auc"] == pytest.approx(15 / 60)


def test_every_number_follows_from_the_queries(climbed):
    """AUC is computed by hand: the precision at the only threshold."""
    rows = list(
        csv.DictReader(
            io.StringIO(
                ladder_table(
                    ladder_rows(climbed), PAPER_PROTOCOL, "lane"
                ).to_csv()
            )
        )
    )
    text = ladder_query_table(climbed, PAPER_PROTOCOL).to_csv()
    queries = list(csv.DictReader(io.StringIO(text)))
    keys = ("map", "db", "query", "cause", "level", "method", "gate")
    assert list(rows[0])[:12] == [
        *keys,
        "auc",
        "r1",
        "kept",
        "kept_low",
        "kept_high",
    ]
    assert len({tuple(row[key] for key in keys) for row in rows}) == len(rows)
    auc = {}
    for row in rows:
        key = tuple(row[name] for name in keys)
        mine = [q for q in queries if tuple(q[name] for name in keys) == key]
        draws = []
        for seed in {q["seed"] for q in mine}:
            right = [int(q["correct"]) for q in mine if q["seed"] == seed]
            draws.append(np.mean(right))
        auc[key] = np.mean(draws)
        assert float(row["auc"]) == pytest.approx(auc[key])
        plain = auc[(*key[:3], "none", "0", *key[5:])]
        assert float(row["kept"]) == pytest.approx(auc[key] / plain)


def test_what_is_wrong_with_each_answer():
    """Each kind of fault occurs once, and two best places are right."""
    one = answered("btc", False, [1, 1, 0, 0, 0, 0, 0])
    one.outcomes.has_match[2] = False
    one.match_frames[3] = -1
    one.distances[3:] = np.nan, np.nan, 15.0, 15.1
    assert one.faults(7.5) == [
        "",
        "",
        "no_place",
        "no_candidate",
        "other_city",
        "too_far",
        "elsewhere",
    ]
    before = answered("btc", False, [1, 0, 1, 1, 0, 0, 0])
    rungs = [measured("none", 0, [before]), measured("snow", 1, [one])]
    _, row = cells(ladder_rows(rungs))
    assert (row["lost"], row["found"]) == (2.0, 1.0)
    # Three of the seven shares of 0.2 to 0.8 are below a half; the third has a
    # wrong best place.
    assert (row["hidden"], row["overlap"]) == (1.0, pytest.approx(0.5))
    assert {row[name] for name in FAULTS} == {1.0}


def test_the_words_name_the_worst_cause(climbed):
    text = ladder_text(ladder_rows(climbed))
    heading, *lines = text.splitlines()
    assert heading.startswith("Town, 60 queries of drive 02. What each cause")
    assert heading.endswith("(without the gate, 95 % intervals):")
    # Each finding is a sentence of its own.
    assert [line[:2] for line in lines] == ["- "] * len(lines)
    assert [line.count(". ") for line in lines] == [0] * len(lines)
    assert "SOLiD loses most by works (much works), which leaves 28 %" in text
    assert "and keeps 0 % (0 to 0) under all causes together." in lines[0]
    # With the gate 6 of 60 are right instead of none.
    assert lines[-3:] == [
        "- Under each cause some method keeps less than 95 %.",
        "- With the gate, SOLiD under all causes keeps 10 % instead of 0 %.",
        "- The gate changes nothing else by 10 points or more.",
    ]
    text = ladder_text(ladder_rows([climbed[0], climbed[-1]]))
    assert "SOLiD keeps 0 % (0 to 0) under all causes together" in text
    mild = [climbed[0], measured("ride", 4, climbed[0].outcomes)]
    text = ladder_text(ladder_rows(mild))
    assert "SOLiD keeps 100 % (100 to 100) even under its worst cause" in text
    assert "\n- Every method keeps 95 % or more under ride.\n" in text
    assert text.endswith("\n- The gate changes nothing by 10 points or more.")


def test_without_anything_to_keep(climbed):
    nothing = [
        measured(cause, 0, [answered("btc", False, part(9, 0))])
        for cause in ("none", "snow")
    ]
    plain, row = ladder_rows(nothing)
    assert np.isnan(row.kept.share)
    assert np.isnan(row.kept.interval.low)
    assert "BTC" not in ladder_text([plain, row])


def test_the_figure_is_the_same_each_time(climbed, tmp_path):
    for name in ("one", "other"):
        draw_ladder(ladder_rows(climbed), tmp_path / name)
    for ending in ("png", "pdf", "svg"):
        one, other = (
            (tmp_path / f"{name}.{ending}").read_bytes()
            for name in ("one", "other")
        )
        assert one == other
        assert len(one) > 1000


def crossing():
    """60 queries: 48 and 45 are right under a cause, 12 under both."""
    rng = np.random.default_rng(3)
    right = {"none": np.ones(60, bool)}
    for cause, number in (("snow", 48), ("fog", 45), ("snow+fog", 12)):
        right[cause] = rng.permutation(np.arange(60) < number)
    return ladder_rows(
        [
            measured(
                cause,
                4 * (cause != "none"),
                [answered("solid", False, is_right)],
            )
            for cause, is_right in right.items()
        ]
    )


def test_pairs_that_do_more_than_both_alone():
    *rows, pair = crossing()
    assert strongest_causes(rows) == ["fog", "snow", "none"]
    table = pair_table(rows, [pair])
    (cell,) = (dict(zip(table.header, row, strict=True)) for row in table.rows)
    assert (cell["cause_a"], cell["cause_b"]) == ("snow", "fog")
    excess = rows[1].kept.share * rows[2].kept.share - pair.kept.share
    assert cell["excess"] == pytest.approx(excess)
    assert 0 < cell["excess_low"] < excess < cell["excess_high"]
    assert cell["more"]
    text = pair_text(rows, [pair])
    assert "Town, SOLiD: snow (" in text
    assert text.count("\n- ") == 1


def test_pairs_that_do_no_more():
    """Nothing is beyond doubt where the pair costs what one cause costs."""
    *rows, _ = crossing()
    (pair,) = ladder_rows(
        [
            measured("none", 0, rows[0].draws),
            measured("snow+fog", 4, rows[2].draws),
        ]
    )[1:]
    table = pair_table(rows, [pair])
    (cell,) = (dict(zip(table.header, row, strict=True)) for row in table.rows)
    # The product is less than what the worse of the two leaves.
    assert cell["excess"] < 0
    assert not cell["more"]
    assert pair_text(rows, [pair]).endswith("- None.")
