"""Matching of sequences against sums by hand, and what it is for."""

import numpy as np
import pytest

from cns_drake.base import InputError
from evaluation import make_method, open_drive, retrieve
from evaluation.recognition.retrieval import sequence_scores


def on_a_line(*places):
    return np.array([[x, 0.0, 0.0] for x in places])


def test_the_votes_of_a_way_are_averaged():
    # Queries each 10 m, places each 5 m; the third query with the one before.
    p_WQs, p_WPs = on_a_line(0, 10, 20), on_a_line(0, 5, 10, 15, 20)
    scores = np.array(
        [[9.0, 1, 1, 1, 1], [1.0, 2, 3, 4, 5], [10.0, 20, 30, 40, 50]]
    )
    found = sequence_scores(scores, scores > 0, p_WQs, p_WPs, 10.0)
    # Forwards, place k has the vote of place k - 2; backwards, of k + 2.
    forth = [10.0, 20.0, (30 + 1) / 2, (40 + 2) / 2, (50 + 3) / 2]
    back = [(10 + 3) / 2, (20 + 4) / 2, (30 + 5) / 2, 40.0, 50.0]
    np.testing.assert_allclose(found[2], np.maximum(forth, back))
    np.testing.assert_array_equal(found[0], scores[0])


@pytest.mark.parametrize(
    ("length", "voting"), [(9.999, 1), (10.0, 2), (19.999, 2), (20.0, 3)]
)
def test_the_length_counts_up_to_itself(length, voting):
    way = on_a_line(0, 10, 20, 30)
    scores = np.diag([8.0, 4.0, 2.0, 1.0])
    found = sequence_scores(scores, scores >= 0, way, way, length)
    diagonal = np.diag(scores)
    assert found[3, 3] == diagonal[4 - voting :].mean()


def test_missing_scores_count_as_the_least_and_empty_queries_not_at_all():
    way = on_a_line(0, 5)
    nan = np.nan
    known = np.ones((2, 2), bool)
    partly = sequence_scores(
        np.array([[nan, 3.0], [1.0, 7.0]]), known, way, way, 5
    )
    # Place 1 by the first query's place 0, which is missing: the least is 3.
    assert partly[1, 1] == max((7.0 + 3.0) / 2, 7.0)
    empty = sequence_scores(
        np.array([[nan, nan], [1.0, 2.0]]), known, way, way, 5
    )
    np.testing.assert_array_equal(empty, [[nan, nan], [1.0, 2.0]])
    known[1, 1] = False
    hidden = sequence_scores(
        np.array([[0.0, 0.0], [1.0, nan]]), known, way, way, 5
    )
    assert np.isnan(hidden[1, 1])


@pytest.mark.parametrize("turn", [1, -1])
def test_a_way_tells_twins_apart(turn):
    """Two places look alike; only the ways to them differ."""
    looks = np.array([1, 2, 3, 4, 5, 9, 8, 7, 6, 4, 10, 11])
    way = on_a_line(*range(0, 60, 5))
    places = way[::turn]
    scores = -np.abs(looks[:, None] - looks[::turn][None, :]).astype(float)
    known = np.ones(scores.shape, bool)
    right = np.arange(len(looks))[::turn]
    alone = scores.argmax(axis=1)
    assert (alone != right).any()
    found = sequence_scores(scores, known, way, places, 10.0)
    np.testing.assert_array_equal(found.argmax(axis=1)[2:], right[2:])


def test_a_setting_of_every_method_asks_for_it(towns):
    drives = [open_drive(towns / f"town_0{k}") for k in (1, 2)]
    alone = retrieve(*drives, make_method("solid", {}))
    found = retrieve(*drives, make_method("solid", {"sequence": 20.0}))
    p_WQs, p_WPs = (
        drive.X_WS[frames, :3, 3]
        for drive, frames in (
            (drives[1], alone.query_frames),
            (drives[0], alone.database_frames),
        )
    )
    expected = sequence_scores(alone.scores, alone.is_known, p_WQs, p_WPs, 20.0)
    np.testing.assert_array_equal(found.scores, expected)
    assert (found.scores != alone.scores).any()
    np.testing.assert_array_equal(found.distances, alone.distances)


@pytest.mark.parametrize("gap", [0.0, 5.0, 1e5])
def test_votes_stay_within_a_drive(gap):
    """Wherever the second drive begins: also where the first one ends."""
    rng = np.random.default_rng(1)
    scores = rng.random((6, 9))
    known = np.ones_like(scores, bool)
    queries = on_a_line(*range(0, 30, 5))
    first = on_a_line(*range(0, 25, 5))
    second = on_a_line(*(20 + gap + np.arange(0, 20, 5)))
    found = sequence_scores(
        scores,
        known,
        queries,
        np.concatenate([first, second]),
        20.0,
        np.repeat([0, 1], [5, 4]),
    )
    for columns, way in ((slice(0, 5), first), (slice(5, 9), second)):
        alone = sequence_scores(
            scores[:, columns], known[:, columns], queries, way, 20.0
        )
        np.testing.assert_array_equal(found[:, columns], alone)


@pytest.mark.parametrize(
    "name", ["solid", pytest.param("btc", marks=pytest.mark.slow)]
)
def test_each_place_has_the_mean_score_zero_if_scores_are_centred(towns, name):
    drives = [open_drive(towns / f"town_0{k}") for k in (1, 2)]
    alone = retrieve(*drives, make_method(name, {}))
    found = retrieve(*drives, make_method(name, {"center_scores": True}))
    np.testing.assert_array_equal(
        np.isnan(found.scores), np.isnan(alone.scores)
    )
    for of_place, before in zip(found.scores.T, alone.scores.T, strict=True):
        is_scored = ~np.isnan(of_place)
        if is_scored.any():
            shift = (before - of_place)[is_scored]
            np.testing.assert_allclose(shift, before[is_scored].mean())


def test_a_method_with_a_second_stage_cannot_centre_its_scores():
    class TwoStages(type(make_method("solid", {}))):
        rerank_best = 5

    with pytest.raises(InputError, match="solid: center_scores: its second"):
        TwoStages(TwoStages.Config(center_scores=True))
