"""Matching of sequences against sums by hand, and what it is for."""

import numpy as np
import pytest

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
