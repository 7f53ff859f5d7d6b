"""Differences between methods, by paired bootstrap over blocks."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from evaluation.recognition import (
    compared_by_auc,
    judge,
    resampled_weights,
    route_blocks,
    weights_by_drive,
)
from evaluation.recognition.bootstrap import bootstrap_intervals
from evaluation.recognition.significance import holm


def auc_difference(first, second, times=1, drives=None):
    answers = {"first": [first] * times, "second": [second] * times}
    ((difference, _),) = compared_by_auc(answers, drives).values()
    return difference


def outcomes_of(scores, is_right, blocks=None):
    matches = np.stack([is_right, ~is_right], axis=1)
    places = np.stack([scores, scores - 10.0], axis=1)
    return judge(places, matches, blocks)


def equal_methods(rng, num_blocks, size=5):
    """Returns two methods that are equally good, and wrong in stretches."""
    number = num_blocks * size
    blocks = np.repeat(np.arange(num_blocks), size)
    return [
        outcomes_of(
            rng.normal(size=number),
            rng.normal(size=number)
            + np.repeat(rng.normal(size=num_blocks), size)
            > 0.0,
            blocks,
        )
        for _ in range(2)
    ]


def test_blocks_of_one_query_are_the_plain_bootstrap():
    for blocks in (np.arange(30), np.arange(30)[::-1] * 7):
        weights = resampled_weights(30, 3, blocks)
        if blocks[0] == 0:
            np.testing.assert_array_equal(weights, resampled_weights(30, 3))
        assert (weights.sum(axis=1) == 30).all()


def test_blocks_are_drawn_whole():
    blocks = np.repeat([4, 1, 9], [2, 3, 1])
    weights = resampled_weights(6, 0, blocks)
    for block in (4, 1, 9):
        of_block = weights[:, blocks == block]
        assert (of_block == of_block[:, :1]).all()
    assert (weights[:, [0, 2, 5]].sum(axis=1) == 3).all()


def test_blocks_follow_the_route():
    # There and back: the way counts, not where the sensor is.
    xs = np.concatenate([np.arange(0.0, 151.0), np.arange(149.0, 79.0, -1.0)])
    positions = np.stack([xs, 0.0 * xs, 0.0 * xs], axis=1)
    frames = np.array([0, 99, 100, 199, 200, 220])
    assert route_blocks(positions, frames).tolist() == [0, 0, 1, 1, 2, 2]


@pytest.mark.slow
@pytest.mark.night
def test_equal_methods_differ_at_the_nominal_level():
    rng = np.random.default_rng(8)
    runs = 200
    wrong = sum(
        auc_difference(*equal_methods(rng, 20)).p_value < 0.05
        for _ in range(runs)
    )
    # Within 2.6 deviations of the binomial distribution.
    assert abs(wrong - 0.05 * runs) < 2.6 * np.sqrt(runs * 0.05 * 0.95)


def test_a_difference_has_a_sign_and_an_interval():
    rng = np.random.default_rng(2)
    scores = rng.normal(size=100)
    blocks = np.repeat(np.arange(20), 5)
    good, poor = (
        outcomes_of(scores, rng.random(100) < share, blocks)
        for share in (0.9, 0.2)
    )
    one, other = (
        auc_difference(*both) for both in ((good, poor), (poor, good))
    )
    assert one.value == -other.value > 0.3
    assert 0.0 < one.interval.low < one.value < one.interval.high
    assert one.p_value == pytest.approx(other.p_value)
    # The least p-value of an exact test over 20 blocks.
    assert one.p_value == 2.0**-19
    same = auc_difference(good, good)
    assert (same.value, same.p_value) == (0.0, 1.0)
    alone = [replace(one, blocks=0 * blocks) for one in (good, poor)]
    assert np.isnan(auc_difference(*alone).p_value)


def test_answers_that_are_repeated_say_nothing_new():
    """Conditions of one drive are not independent; those of others are."""
    rng = np.random.default_rng(2)
    pair = equal_methods(rng, 15)
    once = auc_difference(*pair)
    again = auc_difference(*pair, 12, [0] * 12)
    assert again.value == pytest.approx(once.value)
    assert again.p_value == pytest.approx(once.p_value)
    assert again.interval.low == pytest.approx(once.interval.low)
    # The standard error of a mean over independent drives.
    apart = auc_difference(*pair, 12)
    margins = [one.interval.high - one.value for one in (apart, once)]
    quantiles = [scipy.stats.t.ppf(0.975, n) for n in (12 * 14, 14)]
    expected = quantiles[0] / quantiles[1] / np.sqrt(12)
    # Each drive has its own samples.
    assert margins[0] / margins[1] == pytest.approx(expected, rel=0.03)


def test_conditions_of_a_drive_draw_the_same_blocks():
    blocks = [np.repeat(np.arange(n), 3) for n in (9, 10, 9, 1, 1)]
    drawn = list(weights_by_drive(blocks, [5, 5, 6, 7, 7]))
    assert [number for number, _ in drawn] == [10, 10, 9, 1, 1]
    weights = [some for _, some in drawn]
    np.testing.assert_array_equal(weights[0], weights[1][:, :27])
    assert (weights[1].sum(axis=1) == 30).all()
    assert (weights[2] != weights[0]).any()
    # A single block is drawn query by query.
    assert weights[3].std(axis=1).any()
    np.testing.assert_array_equal(weights[3], weights[4])


def test_intervals_by_blocks():
    """Where whole blocks are right or wrong, only their number counts."""
    rng = np.random.default_rng(5)
    scores = rng.normal(size=100)
    blocks = np.repeat(np.arange(20), 5)
    is_right = np.repeat(rng.random(20) < 0.6, 5)
    in_blocks = outcomes_of(scores, is_right, blocks)
    plain = outcomes_of(scores, is_right)
    each = outcomes_of(scores, is_right, np.arange(100))
    assert bootstrap_intervals(each, 0) == bootstrap_intervals(plain, 0)
    wide, narrow = (
        recall.high - recall.low
        for _, recall in (
            bootstrap_intervals(one, 0) for one in (in_blocks, plain)
        )
    )
    # Standard errors of a share are as the roots of the numbers.
    assert wide / narrow == pytest.approx(np.sqrt(5.0), rel=0.15)
    # A short route is resampled query by query.
    short = replace(plain, blocks=np.zeros(100))
    assert bootstrap_intervals(short, 0) == bootstrap_intervals(plain, 0)


def test_holm_by_hand():
    found = holm(np.array([0.03, np.nan, 0.01, 0.02, 0.6]))
    np.testing.assert_allclose(found, [0.06, np.nan, 0.04, 0.06, 0.6])
    assert holm(np.array([0.5, 0.9])).tolist() == [1.0, 1.0]
    assert len(holm(np.array([]))) == 0


def test_all_differences_are_one_family():
    rng = np.random.default_rng(2)
    answers = {
        method: [equal_methods(rng, 12)[0]]
        for method in ("btc", "ring++", "solid")
    }
    compared = compared_by_auc(answers).values()
    raw = [difference.p_value for difference, _ in compared]
    # Holm's method by hand, for three tests.
    low, middle, high = sorted(raw)
    expected = {low: min(3 * low, 1.0)}
    expected[middle] = min(max(2 * middle, expected[low]), 1.0)
    expected[high] = max(high, expected[middle])
    found = [p_value for _, p_value in compared]
    assert found == pytest.approx([expected[one] for one in raw])
    assert compared_by_auc({"btc": answers["btc"]}) == {}


def p_values_on_the_way(rng, number, num_blocks):
    """Returns p-values while one method loses its answers, one by one."""
    scores = rng.random(number)
    blocks = np.sort(rng.integers(num_blocks, size=number))
    perfect = outcomes_of(scores, np.ones(number, dtype=bool), blocks)
    right = np.ones(number, dtype=bool)
    found = []
    for query in [None, *rng.permutation(number)]:
        if query is not None:
            right[query] = False
        other = outcomes_of(scores, right, blocks)
        found.append(auc_difference(perfect, other).p_value)
    return found, len(np.unique(blocks))


@pytest.mark.parametrize("seed", range(3))
def test_a_lead_without_spread_is_the_strongest_evidence(seed):
    """Not "no difference": no p-value on the way there is less."""
    rng = np.random.default_rng(seed)
    found, blocks = p_values_on_the_way(rng, 24, int(rng.integers(3, 9)))
    assert found[0] == 1.0
    assert found[-1] == min(found) == 2.0 ** (1 - blocks)


def test_equal_answers_give_no_evidence():
    rng = np.random.default_rng(4)
    for _ in range(20):
        right = rng.random(30) < rng.random()
        blocks = np.sort(rng.integers(6, size=30))
        # Areas do not depend on the scale of scores.
        one, other = (
            outcomes_of(scale * np.linspace(0.1, 0.9, 30), right, blocks)
            for scale in (1.0, 70.0)
        )
        assert auc_difference(one, other).p_value == 1.0


def test_the_order_of_methods_does_not_matter():
    """Also where only one of them knows the blocks of the route."""
    rng = np.random.default_rng(6)
    one, other = equal_methods(rng, 8)
    for first, second in (
        (one, other),
        (replace(one, blocks=None), other),
        (one, replace(other, blocks=None)),
    ):
        found, back = (
            auc_difference(*pair) for pair in ((first, second), (second, first))
        )
        assert found.value == -back.value
        assert found.p_value == back.p_value
        assert found.p_value == auc_difference(one, other).p_value
    with pytest.raises(ValueError, match="other blocks"):
        auc_difference(one, replace(other, blocks=other.blocks[::-1]))
