"""What a method makes of two drives, in numbers."""

import numpy as np
import pytest
from scipy.stats import binom

from evaluation.methods import make_method
from evaluation.recognition import (
    FAULTS,
    UNKNOWN,
    PlaceOutcome,
    PoseErrors,
    QueryDrive,
    QueryOutcomes,
    Retrieval,
    RetrievalProtocol,
    jackknife_interval,
    place_numbers,
    pose_numbers,
)
from evaluation.recognition.faults import faults


def answered(is_right, scores=None, blocks=None):
    """An outcome; all queries have a match."""
    right = np.array(is_right, dtype=bool)
    number = len(right)
    outcomes = QueryOutcomes(
        np.ones(number) if scores is None else scores,
        right,
        np.ones(number, bool),
        np.where(right, 1.0, np.inf),
        9,
        blocks,
    )
    columns = {
        "why": faults(outcomes, np.arange(number), np.ones(number), 7.5),
        "overlap": np.linspace(0.2, 0.8, number),
    }
    return outcome_of("solid", outcomes, columns, PoseErrors.unknown(number))


def outcome_of(method, outcomes, columns, errors):
    """An outcome whose best places are not known."""
    number = len(outcomes)
    poses = {
        "translation_error": errors.translation,
        "rotation_error_deg": errors.rotation_deg,
    }
    return PlaceOutcome(
        method=method,
        database="a",
        query="b",
        protocol=RetrievalProtocol(),
        protocol_name="recorded",
        outcomes=outcomes,
        columns={**columns, **poses},
        place_frames=np.arange(9),
        best_places=np.full((number, 5), -1),
        best_scores=np.full((number, 5), np.nan),
        matches=np.empty((0, 2), int),
        nearest=np.full(number, np.inf),
    )


def part(number, kept):
    """Returns which queries are right: the first ones."""
    return np.arange(number) < kept


def numbers(now, before=None):
    """Metric -> value, and metric -> interval."""
    found = list(place_numbers(now, before))
    assert len({one.metric for one in found}) == len(found)
    assert {(one.method, one.verified, one.n) for one in found} == {
        ("solid", False, len(now.outcomes))
    }
    return (
        {one.metric: one.value for one in found},
        {one.metric: one.interval for one in found},
    )


def test_the_share_of_auc_that_is_kept():
    # All scores are equal: the only threshold rejects nothing, and AUC is its
    # precision.
    before, now = (answered(part(60, kept)) for kept in (54, 45))
    values, intervals = numbers(before, before)
    assert values["relative_auc"] == values["relative_auc_strict"] == 1.0
    assert (
        0.9
        < intervals["relative_auc"].low
        < 1.0
        < intervals["relative_auc"].high
        < 1.1
    )
    assert (values["lost"], values["found"]) == (0.0, 0.0)
    values, intervals = numbers(now, before)
    assert values["r1"] == values["auc"] == 0.75
    assert values["relative_auc"] == pytest.approx(45 / 54)
    assert (values["lost"], values["found"]) == (9.0, 0.0)
    low, high = binom.ppf([0.025, 0.975], 54, 45 / 54) / 54
    assert intervals["relative_auc"].low == pytest.approx(low, abs=0.05)
    assert intervals["relative_auc"].high == pytest.approx(high, abs=0.05)
    low, high = binom.ppf([0.025, 0.975], 60, 0.75) / 60
    assert intervals["r1"].low == pytest.approx(low, abs=0.02)
    assert intervals["r1"].high == pytest.approx(high, abs=0.02)


@pytest.mark.parametrize("blocks_before", [None, np.arange(40) // 4])
def test_intervals_of_kept_are_of_the_blocks_of_now(blocks_before):
    after, before = part(40, 18), part(40, 32)
    counts = [one.reshape(10, 4).sum(axis=1) for one in (after, before)]
    share = 18 / 32
    # All scores are equal: AUC and R@1 are shares of right answers.
    less = (18 - counts[0]) / (32 - counts[1])
    expected = jackknife_interval(
        share, less, np.full(10, 4.0), (0.0, share + 40 / 32)
    )
    _, intervals = numbers(
        answered(after, blocks=np.arange(40) // 4),
        answered(before, blocks=blocks_before),
    )
    for name in ("relative_auc", "relative_r1"):
        assert intervals[name].low == pytest.approx(expected.low)
        assert intervals[name].high == pytest.approx(expected.high)
    assert 0.0 < expected.low < share < expected.high < 1.5


def test_right_answers_with_the_best_scores():
    """AUC is the share that is right."""
    scores = np.linspace(1.0, 0.5, 10)
    values, intervals = numbers(
        answered(part(10, 6), scores), answered(part(10, 10), scores)
    )
    assert values["auc_strict"] == pytest.approx(0.6)
    assert values["relative_auc_strict"] == pytest.approx(0.6)
    assert (
        intervals["relative_auc"].low
        <= values["relative_auc"]
        <= intervals["relative_auc"].high
    )


def test_without_a_baseline_nothing_is_kept():
    values, _ = numbers(answered(part(10, 6)))
    assert (
        not {"relative_auc", "relative_auc_strict", "lost", "found"}
        & values.keys()
    )
    assert values["with_match"] == 10.0
    assert values["places"] == 9.0


def test_median_errors_are_those_of_right_answers():
    """Thirty queries without a match, and one wrong place, do not count."""
    right = part(41, 10)
    outcomes = QueryOutcomes(
        np.linspace(1.0, 0.5, 41),
        right,
        part(41, 11),
        np.where(right, 1.0, np.inf),
        9,
    )
    far = np.where(right, 0.1, 50.0)
    far[0] = np.nan
    now = outcome_of("btc", outcomes, {}, PoseErrors(far, 2.0 * far))
    assert {n.metric: (n.value, n.n) for n in pose_numbers(now, None)} == {
        "pose_success": (9 / 11, 11),
        "translation_median": (0.1, 9),
        "rotation_median_deg": (0.2, 9),
    }


def test_without_anything_to_keep():
    nothing = answered(part(9, 0))
    values, intervals = numbers(nothing, nothing)
    assert np.isnan(values["relative_auc"])
    assert np.isnan(intervals["relative_auc"].low)


def test_other_queries_have_no_pairs():
    """The baseline asks as many queries, or no query has a partner."""
    values, intervals = numbers(answered(part(10, 6)), answered(part(9, 9)))
    assert values["relative_auc"] == pytest.approx(0.6)
    assert intervals["relative_auc"] is UNKNOWN
    assert not {"lost", "found"} & values.keys()


def test_intervals_are_by_blocks():
    """All queries of a block are right or wrong: their number is that of
    blocks."""
    right = np.repeat(part(12, 9), 5)
    blocks = np.repeat(np.arange(12), 5)
    _, single = numbers(answered(right))
    _, joint = numbers(answered(right, blocks=blocks))
    wide, narrow = (one["r1"].high - one["r1"].low for one in (joint, single))
    assert wide > 1.6 * narrow
    low, high = binom.ppf([0.025, 0.975], 12, 0.75) / 12
    assert joint["r1"].low <= low + 0.05
    assert joint["r1"].high >= high - 0.05


def test_what_is_wrong_with_each_answer():
    """Each kind of fault occurs once, and two best places are right."""
    one = answered([1, 1, 0, 0, 0, 0, 0])
    one.outcomes.has_match[2] = False
    frames = np.array([0, 1, 2, -1, 4, 5, 6])
    distances = np.array([1.0, 1.0, 1.0, np.nan, np.nan, 15.0, 15.1])
    one.columns["why"][:] = faults(one.outcomes, frames, distances, 7.5)
    assert one.columns["why"].tolist() == [
        "",
        "",
        "no_place",
        "no_candidate",
        "other_city",
        "near_miss",
        "elsewhere",
    ]
    values, _ = numbers(one, answered([1, 0, 1, 1, 0, 0, 0]))
    assert (values["lost"], values["found"]) == (2.0, 1.0)
    assert {values[name] for name in FAULTS} == {1.0}
    assert values["with_match"] == 6.0
    # Three of the seven shares of 0.2 to 0.8 are below a half; the third has a
    # wrong best place.
    assert values["hidden"] == 1.0
    assert values["visible_change"] == pytest.approx(0.5)


@pytest.mark.parametrize("radius", [5.0, 7.5])
def test_places_within_two_radii_are_near_miss(radius):
    outcomes = answered([0, 0]).outcomes
    distances = 2 * radius + np.array([-1e-9, 1e-9])
    found = faults(outcomes, np.arange(2), distances, radius)
    assert found.tolist() == ["near_miss", "elsewhere"]


def test_overlaps_that_are_not_known():
    one = answered([1, 1, 0])
    one.columns["overlap"][:] = np.nan, 0.6, 0.8
    assert numbers(one)[0]["visible_change"] == pytest.approx(0.3)
    one.columns["overlap"][:] = np.nan
    assert "visible_change" not in numbers(one)[0]


@pytest.mark.parametrize("blocks", [None, np.arange(8) // 2])
def test_columns_hold_all_that_numbers_follow_from(blocks):
    right = part(8, 5)
    # Query k finds place k; the last places are of another town.
    scores = np.where(np.eye(8, 9) > 0, np.linspace(1, 0.1, 8)[:, None], np.nan)
    retrieval = Retrieval(
        query_frames=np.arange(8) * 10,
        database_frames=np.arange(9) * 7,
        scores=scores,
        distances=np.ones((8, 9)),
        matches=np.eye(8, 9, dtype=bool) & right[:, None],
        pose_errors=PoseErrors.unknown(8),
        is_known=np.ones((8, 9), bool),
        query_blocks=blocks,
    )
    one = PlaceOutcome.of(
        "solid rings=8",
        make_method("solid", {}),
        RetrievalProtocol(verified=True),
        retrieval,
        QueryDrive("town_03", np.arange(8) * 50, np.arange(24.0).reshape(8, 3)),
        ["town_01"] * 6 + ["town_02"] * 3,
        np.linspace(0.2, 0.8, 8),
    )
    found = one.columns
    assert {len(column) for column in found.values()} == {8}
    assert found["query_y"].tolist() == [1 + 3 * k for k in range(8)]
    assert found["match_frame"].tolist() == [7 * k for k in range(8)]
    assert found["match_drive"].tolist() == ["town_01"] * 6 + ["town_02"] * 2
    assert np.isnan(found["distance"]).tolist() == [False] * 6 + [True] * 2
    assert np.sum(found["correct"]) == 5
    # Without blocks each query is one.
    np.testing.assert_array_equal(
        found["block"], np.arange(8) if blocks is None else blocks
    )
    np.testing.assert_allclose(found["overlap"] + found["visible_change"], 1.0)
    assert (one.method, one.database) == ("solid rings=8", "town_01")
    assert (one.query, one.is_verified, one.radius) == ("town_03", True, 7.5)
    assert one.protocol.scans_per_place == 1
    # Each query has one candidate.
    assert one.best_places.tolist() == [[k, -1, -1, -1, -1] for k in range(8)]
    np.testing.assert_array_equal(one.best_scores[:, 0], np.diag(scores))
    assert np.isnan(one.best_scores[:, 1:]).all()
    assert one.matches.tolist() == [[k, k] for k in range(5)]
    assert one.nearest.tolist() == [1.0] * 8
    assert [bool(why) for why in found["why"]] == [*~right]
