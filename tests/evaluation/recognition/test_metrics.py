import math

import numpy as np
import pytest

from evaluation.recognition import METRICS, judge, numbers_of, weighted_metrics

NAN = np.nan


def outcomes_of(rows):
    """Makes outcomes of (best score, is right, has a match) for each query.

    The database has three places. The first gets the best score. The match is
    the first one, or else the third, whose score is the least.
    """
    scores, matches = [], []
    for best, is_right, has_match in rows:
        scores.append([best, best - 0.1, best - 0.2])
        matches.append([is_right, False, has_match and not is_right])
    return judge(np.array(scores), np.array(matches))


def counted(outcomes, mode):
    """Returns the outcomes that the curve counts in a mode."""
    if mode == "filtered":
        return outcomes.subset(outcomes.has_match)
    return outcomes


def value(name, outcomes):
    return METRICS[name].of(outcomes)


# Score, right, has a match; worked out on paper:
#   t = .9: TP 1 FP 0 FN 3          P 1    R 1/4  F1 2/5
#   t = .8: TP 1 FP 1 FN 3          P 1/2  R 1/4  F1 2/6
#   t = .7: TP 2 FP 1 FN 2          P 2/3  R 1/2  F1 4/7
#   t = .6: TP 2 FP 2 FN 1          P 1/2  R 2/3  F1 4/7
#   t = .5: TP 3 FP 2 FN 0          P 3/5  R 1    F1 6/8
HAND = [
    (0.9, True, True),
    (0.8, False, False),
    (0.7, True, True),
    (0.6, False, True),
    (0.5, True, True),
]


def test_curve_by_hand():
    outcomes = outcomes_of(HAND)
    curve = outcomes.curve
    np.testing.assert_allclose(curve.thresholds, [0.9, 0.8, 0.7, 0.6, 0.5])
    assert curve.true_positives.tolist() == [1, 1, 2, 2, 3]
    assert curve.false_positives.tolist() == [0, 1, 1, 2, 2]
    assert curve.false_negatives.tolist() == [3, 3, 2, 1, 0]
    np.testing.assert_allclose(curve.precision, [1, 1 / 2, 2 / 3, 1 / 2, 3 / 5])
    np.testing.assert_allclose(curve.recall, [1 / 4, 1 / 4, 1 / 2, 2 / 3, 1])
    np.testing.assert_allclose(curve.f1, [2 / 5, 1 / 3, 4 / 7, 4 / 7, 3 / 4])
    # 1/4 at precision 1, then trapezoids.
    area = 1 / 4
    area += (1 / 4) * (1 / 2 + 2 / 3) / 2
    area += (1 / 6) * (2 / 3 + 1 / 2) / 2
    area += (1 / 3) * (1 / 2 + 3 / 5) / 2
    assert value("auc", outcomes) == pytest.approx(area, abs=1e-15)
    # With recall TP / N, of N = 4: 1/4, 1/4, 2/4, 2/4, 3/4.
    strict = 1 / 4
    strict += (1 / 4) * (1 / 2 + 2 / 3) / 2
    strict += (1 / 4) * (1 / 2 + 3 / 5) / 2
    assert value("auc_strict", outcomes) == pytest.approx(strict, abs=1e-15)
    assert value("f1_max", outcomes) == pytest.approx(3 / 4)
    assert curve.f1_max_index == 4
    assert (len(outcomes), outcomes.num_matched) == (5, 4)
    assert outcomes.true_positives == 3
    assert value("r1", outcomes) == pytest.approx(3 / 4)


def test_filtered_leaves_out_queries_without_a_match():
    outcomes = outcomes_of(HAND)
    curve = counted(outcomes, "filtered").curve
    np.testing.assert_allclose(curve.thresholds, [0.9, 0.7, 0.6, 0.5])
    assert curve.true_positives.tolist() == [1, 2, 2, 3]
    assert curve.false_positives.tolist() == [0, 0, 1, 1]
    assert curve.false_negatives.tolist() == [3, 2, 1, 0]
    # The queries are the same; only the curve counts fewer of them.
    numbers = numbers_of("place", outcomes, mode="filtered")
    found = {number.metric: number.value for number in numbers}
    assert found["f1_max"] == curve.f1_max
    assert found["queries"] == 5
    assert found["with_match"] == 4
    assert found["r1"] == pytest.approx(3 / 4)


@pytest.mark.parametrize("seed", range(5))
def test_filtered_f1_is_a_function_of_recall_at_1(seed):
    rng = np.random.default_rng(seed)
    rows = [
        (rng.uniform(), has and rng.uniform() < 0.6, has)
        for has in rng.uniform(size=80) < 0.8
    ]
    outcomes = counted(outcomes_of(rows), "filtered")
    r = outcomes.recall_at(1)
    assert outcomes.curve.f1_max == pytest.approx(
        2.0 * r / (1.0 + r), abs=1e-12
    )


@pytest.mark.parametrize("mode", ["all", "filtered"])
@pytest.mark.parametrize("seed", range(3))
def test_curve_agrees_with_counting(seed, mode):
    rng = np.random.default_rng([seed, 9])
    # Few different scores, so that there are ties; some queries without a
    # candidate.
    rows = []
    for has in rng.uniform(size=60) < 0.7:
        score = rng.integers(8) / 8.0
        rows.append((score, bool(has and rng.uniform() < 0.5), bool(has)))
    rows += [(NAN, False, True), (NAN, False, False)]
    curve = counted(outcomes_of(rows), mode).curve
    if mode == "filtered":
        rows = [row for row in rows if row[2]]
    distinct = sorted({s for s, _, _ in rows if not math.isnan(s)})[::-1]
    assert curve.thresholds.tolist() == distinct
    for k, t in enumerate(distinct):
        tp = sum(s >= t and right for s, right, _ in rows)
        fp = sum(s >= t and not right for s, right, _ in rows)
        fn = sum(not s >= t and has for s, _, has in rows)
        assert curve.true_positives[k] == tp
        assert curve.false_positives[k] == fp
        assert curve.false_negatives[k] == fn


def test_tied_queries_are_accepted_together():
    rows = [(0.5, True, True), (0.5, False, True), (0.5, False, False)]
    curve = outcomes_of(rows).curve
    assert curve.thresholds.tolist() == [0.5]
    assert curve.precision.tolist() == [1 / 3]
    assert curve.recall.tolist() == [1.0]
    # The order of tied queries cannot matter.
    assert (
        outcomes_of(rows[::-1]).curve.auc == curve.auc == pytest.approx(1 / 3)
    )


def test_tied_places_rank_in_the_order_of_the_database():
    scores = np.array([[0.5, 0.7, 0.7]])
    first = judge(scores, np.array([[False, True, False]]))
    second = judge(scores, np.array([[False, False, True]]))
    assert first.first_right_ranks.tolist() == [1.0]
    assert second.first_right_ranks.tolist() == [2.0]


def test_no_candidate_is_never_accepted_and_a_miss():
    rows = [(0.9, True, True), (NAN, False, True), (NAN, False, False)]
    outcomes = outcomes_of(rows)
    assert outcomes.curve.recall.tolist() == [0.5]
    assert outcomes.curve.precision.tolist() == [1.0]
    assert outcomes.curve.auc == pytest.approx(0.5)
    assert value("r1", outcomes) == pytest.approx(0.5)
    assert value("r25", outcomes) == pytest.approx(0.5)


def test_a_place_that_is_no_candidate_is_not_found():
    scores = np.array([[0.3, NAN, 0.2]])
    outcomes = judge(scores, np.array([[False, True, False]]))
    assert outcomes.has_match.tolist() == [True]
    assert outcomes.is_right.tolist() == [False]
    assert outcomes.first_right_ranks.tolist() == [math.inf]


def test_no_query_has_a_match():
    rows = [(0.9, False, False), (0.3, False, False)]
    for mode in ("all", "filtered"):
        outcomes = counted(outcomes_of(rows), mode)
        for name in ("r1", "auc", "auc_strict", "f1_max"):
            assert math.isnan(value(name, outcomes))
        assert (outcomes.num_matched, outcomes.true_positives) == (0, 0)


def test_every_accepted_query_is_wrong():
    outcomes = outcomes_of([(0.9, False, True), (0.3, False, True)])
    assert outcomes.curve.recall.tolist() == [0.0, 0.0]
    assert value("auc", outcomes) == 0.0
    assert value("r1", outcomes) == 0.0


@pytest.mark.parametrize("shape", [(0, 0), (0, 4), (3, 0)])
def test_empty_sets(shape):
    scores, matches = np.zeros(shape), np.zeros(shape, dtype=bool)
    for mode in ("all", "filtered"):
        outcomes = judge(scores, matches)
        assert len(outcomes) == shape[0]
        outcomes = counted(outcomes, mode)
        assert len(outcomes.curve.thresholds) == 0
        assert outcomes.curve.auc == outcomes.curve.f1_max == 0.0
        assert outcomes.curve.f1_max_index is None
        for name in ("auc", "f1_max", "recall_at_full_precision", "r1"):
            assert math.isnan(value(name, outcomes))


def test_perfect():
    outcomes = outcomes_of([(0.9, True, True), (0.4, True, True)])
    for name in ("auc", "f1_max", "r1"):
        assert value(name, outcomes) == 1.0


def test_recall_at_n():
    # 200 places with falling scores; the match of query i is place i.
    scores = np.tile(np.linspace(1.0, 0.0, 200), (30, 1))
    matches = np.zeros((30, 200), dtype=bool)
    matches[np.arange(30), np.arange(30)] = True
    outcomes = judge(scores, matches)
    recalls = [outcomes.recall_at(rank) for rank in range(1, 26)]
    np.testing.assert_allclose(recalls, np.arange(1, 26) / 30)
    assert value("r1", outcomes) == pytest.approx(1 / 30)
    # A hundredth of 200 is 2.
    assert value("r1_percent", outcomes) == pytest.approx(2 / 30)
    few = judge(scores[:, :40], matches[:, :40])
    assert few.recall_at_1_percent == few.recall_at(1)


def test_mean_reciprocal_rank():
    matches = np.zeros((4, 5), dtype=bool)
    matches[0, 1] = matches[1, 3] = matches[2, 4] = True
    scores = np.array(
        [
            [0.1, 0.9, 0.2, 0.3, 0.4],
            [0.9, 0.1, 0.2, 0.8, 0.4],
            [0.9, 0.8, 0.7, 0.6, np.nan],
            [0.9, 0.8, 0.7, 0.6, 0.5],
        ]
    )
    outcomes = judge(scores, matches)
    # Ranks 1 and 2, one that is no candidate; the last has no match.
    assert outcomes.mean_reciprocal_rank == pytest.approx(1.5 / 3)
    assert np.isnan(judge(scores, matches & False).mean_reciprocal_rank)


@pytest.mark.parametrize("seed", range(4))
def test_auroc_counts_pairs(seed):
    rng = np.random.default_rng([seed, 2])
    matches = rng.random((30, 4)) < 0.15
    scores = rng.integers(0, 6, (30, 4)) / 6.0
    scores[rng.random(30) < 0.2] = np.nan
    outcomes = judge(scores, matches)
    best = np.where(np.isnan(scores).all(axis=1), -1.0, scores.max(axis=1))
    yes, no = best[matches.any(axis=1)], best[~matches.any(axis=1)]
    wins = [(a > b) + 0.5 * (a == b) for a in yes for b in no]
    assert outcomes.match_auroc == pytest.approx(np.mean(wins))
    # One query with a match, or one without, is between two others.
    between = np.array([[False], [False], [True]])
    for matches_of_three in (between, ~between):
        three = judge(np.array([[5], [3], [4]]), matches_of_three)
        assert three.match_auroc == 0.5
    assert np.isnan(judge(scores, matches | True).match_auroc)
    assert np.isnan(judge(scores, matches & False).match_auroc)


def test_intervals_of_single_queries():
    rng = np.random.default_rng(8)
    rows = [(rng.uniform(), rng.uniform() < 0.7, True) for _ in range(200)]
    outcomes = outcomes_of(rows)
    auc, r1 = METRICS["auc"], METRICS["r1"]
    # For a part r of n: 1.96 standard deviations; two imaginary queries and the
    # noise of 9,999 patterns of signs make it a little wider.
    r = r1.of(outcomes)
    half = 1.96 * math.sqrt(r * (1.0 - r) / 200)
    interval = r1.interval(outcomes)
    assert interval.low == pytest.approx(r - half, abs=0.2 * half)
    assert interval.high == pytest.approx(r + half, abs=0.2 * half)
    interval = auc.interval(outcomes)
    assert interval.low < auc.of(outcomes) < interval.high
    perfect = outcomes_of([(u, True, True) for u, *_ in rows])
    for known in (auc.interval(perfect), r1.interval(perfect)):
        # With no error in n queries, 3 / n is the limit of the share of errors
        # (rule of three, one-sided).
        assert 1.0 - 6.0 / 200 < known.low < 1.0 - 1.5 / 200
        assert known.high == 1.0
    assert math.isnan(auc.interval(outcomes_of(rows[:5])).low)


def test_weighted_metrics_are_those_of_repeated_queries():
    rows = [*HAND, (0.7, False, True), (NAN, False, True), (0.2, True, True)]
    rng = np.random.default_rng(3)
    weights = rng.integers(4, size=(20, len(rows))).astype(float)
    weights[0] = 1.0
    found = np.stack(weighted_metrics(outcomes_of(rows), weights), axis=1)
    for weight, values in zip(weights.astype(int), found, strict=True):
        queries = np.repeat(np.arange(len(rows)), weight)
        one = outcomes_of([rows[query] for query in queries])
        expected = [one.curve.auc, one.recall_at(1), one.auc_strict]
        np.testing.assert_allclose(values, expected, atol=1e-12)


def test_scores_must_not_be_compared_by_value():
    # Any increasing function of the scores gives the same numbers.
    rng = np.random.default_rng(1)
    scores = rng.normal(size=(50, 20))
    matches = rng.uniform(size=(50, 20)) < 0.1
    plain = judge(scores, matches)
    bent = judge(np.exp(3.0 * scores), matches)
    assert plain.curve.auc == bent.curve.auc
    assert plain.curve.f1_max == bent.curve.f1_max
    for rank in range(1, 26):
        assert plain.recall_at(rank) == bent.recall_at(rank)


@pytest.mark.parametrize(
    "scores",
    [
        np.array([[0.5 + 1j, 0.2]]),
        np.ma.masked_array([[0.5, 0.2]], [[True, False]]),
        np.array([["0.5", "0.2"]]),
        np.array([0.5, 0.2]),
        np.array([[0.5]]),
    ],
)
def test_scores_that_are_none_are_refused(scores):
    with pytest.raises(ValueError, match="scores"):
        judge(scores, np.array([[True, False]]))


def test_scores_of_unsigned_integers_keep_their_order():
    found = judge(np.array([[0, 3]], np.uint8), np.array([[False, True]]))
    assert found.is_right.all()


@pytest.mark.parametrize("mode", ["all", "filtered"])
def test_strict_recall_counts_every_query_with_a_match(mode):
    right = [(1.0 - 0.1 * k, True, True) for k in range(3)]
    perfect = counted(outcomes_of(right), mode)
    assert (perfect.curve.auc, perfect.auc_strict) == (1.0, 1.0)
    # Two wrong answers come last: by the paper's counts recall still gets to 1.
    wrong = [(0.1, False, True), (0.05, False, True)]
    outcomes = counted(outcomes_of(right + wrong), mode)
    assert outcomes.curve.recall[-1] == 1.0
    assert outcomes.auc_strict == pytest.approx(3 / 5)
    nobody = counted(outcomes_of([(0.5, False, False)]), mode)
    assert math.isnan(nobody.auc_strict)
