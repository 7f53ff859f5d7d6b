"""Tests and intervals by sign flips over blocks of street."""

from dataclasses import replace
import itertools

import numpy as np
import pytest

from evaluation.recognition import (
    METRICS,
    SIGNIFICANT,
    city_interval,
    compared_by_right_answers,
    jackknife_interval,
    judge,
    route_blocks,
    sign_flip_test,
)


def difference(first, second, times=1, drives=None):
    answers = {"first": [first] * times, "second": [second] * times}
    (found,) = compared_by_right_answers(answers, drives).values()
    return found


def outcomes_of(scores, is_right, blocks=None):
    matches = np.stack([is_right, ~is_right], axis=1)
    places = np.stack([scores, scores - 10.0], axis=1)
    return judge(places, matches, blocks)


def right_answers(is_right, blocks):
    return outcomes_of(np.linspace(1.0, 0.0, len(is_right)), is_right, blocks)


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


def p_by_hand(sums, weights, mean):
    """The share of all sign patterns whose sum is at least as great."""
    deviations = sums - mean * weights
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(sums))))
    measured = abs(deviations.sum())
    return np.mean(np.abs(signs @ deviations) >= measured - 1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_interval_and_p_value_are_those_of_all_sign_patterns(seed):
    rng = np.random.default_rng(seed)
    number = int(rng.integers(6, 11))
    weights = rng.integers(1, 9, size=number).astype(float)
    sums = np.rint(rng.normal(0.5, 2.0, size=number) * weights)
    interval, p_value = sign_flip_test(sums, weights)
    assert p_value == pytest.approx(p_by_hand(sums, weights, 0.0))
    assert interval.low <= sums.sum() / weights.sum() <= interval.high
    for limit, outwards in ((interval.low, -1.0), (interval.high, 1.0)):
        inside, outside = (
            p_by_hand(sums, weights, limit + shift * outwards)
            for shift in (-1e-6, 1e-6)
        )
        assert outside < SIGNIFICANT <= inside
    assert (p_value < SIGNIFICANT) == (not interval.low <= 0 <= interval.high)


def test_few_blocks_cannot_show_anything():
    for number in range(6):
        interval, p_value = sign_flip_test(np.ones(number), np.ones(number))
        assert np.isnan(interval.low)
        assert p_value == min(1.0, 2.0 ** (1 - number))
    interval, p_value = sign_flip_test(np.ones(6), np.ones(6))
    assert (interval.low, interval.high, p_value) == (1.0, 1.0, 2.0**-5)
    # Two tests at once need one block more.
    assert np.isnan(sign_flip_test(np.ones(6), np.ones(6), 2)[0].low)
    assert sign_flip_test(np.ones(7), np.ones(7), 2)[1] == 2.0**-5


def steps(rng, num_sets):
    """Yields answers of two methods, and the same with one more right answer.

    The drives, the numbers of queries and of blocks are random. Queries without
    a match have no right answer.
    """
    sets, drives = [], rng.integers(2, size=num_sets)
    for _ in range(num_sets):
        number = int(rng.integers(12, 40))
        blocks = np.sort(rng.integers(rng.integers(1, 30), size=number))
        has_match = rng.random(number) < rng.choice([0.6, 1.0])
        right = [
            has_match & (rng.random(number) < rng.choice([0.0, 0.5, 0.9, 1.0]))
            for _ in range(2)
        ]
        sets.append((blocks, has_match, right))

    def answers():
        return {
            name: [
                replace(right_answers(of[k], blocks), has_match=has_match)
                for blocks, has_match, of in sets
            ]
            for k, name in enumerate(("first", "second"))
        }

    before = answers()
    for _, has_match, (right, _) in sets:
        for query in np.flatnonzero(has_match & ~right):
            right[query] = True
            yield before, answers(), drives
            right[query] = False


@pytest.mark.parametrize("seed", range(24))
def test_one_more_right_answer_never_weakens_the_evidence(seed):
    """Exactly, also with random patterns: of all single steps of a table."""
    rng = np.random.default_rng(seed)
    for before, after, drives in steps(rng, int(rng.integers(1, 4))):
        (one,) = compared_by_right_answers(before, drives).values()
        (other,) = compared_by_right_answers(after, drives).values()
        assert other.value > one.value
        if one.value >= 0.0:
            assert other.p_value <= one.p_value
        elif other.value <= 0.0:
            assert other.p_value >= one.p_value
        for found in (one, other):
            low, high = found.interval.low, found.interval.high
            if np.isnan(low):
                assert found.p_value >= SIGNIFICANT
            else:
                is_outside = not low <= 0.0 <= high
                assert is_outside == (found.p_value < SIGNIFICANT)
                assert low <= found.value <= high


@pytest.mark.parametrize("num_blocks", [6, 9, 40])
def test_a_lead_without_spread_is_the_strongest_evidence(num_blocks):
    blocks = np.repeat(np.arange(num_blocks), 4)
    perfect, empty = (
        right_answers(np.full(len(blocks), is_right), blocks)
        for is_right in (True, False)
    )
    found = difference(perfect, empty)
    assert (found.value, found.interval.high) == (1.0, 1.0)
    assert 0.0 < found.interval.low < 1.0
    # All patterns, or 9,999 random ones.
    least = 2.0 ** (1 - num_blocks) if num_blocks < 16 else 1e-4
    assert found.p_value == pytest.approx(least)


def test_equal_answers_give_no_evidence():
    rng = np.random.default_rng(4)
    for _ in range(20):
        right = rng.random(30) < rng.random()
        blocks = np.sort(rng.integers(6, size=30))
        one, other = (
            outcomes_of(scale * np.linspace(0.1, 0.9, 30), right, blocks)
            for scale in (1.0, -70.0)
        )
        found = difference(one, other)
        assert (found.value, found.p_value) == (0.0, 1.0)
    # Two perfect methods are not known to be equal.
    perfect = right_answers(np.ones(60, bool), np.arange(60) // 4)
    found = difference(perfect, perfect)
    assert found.p_value == 1.0
    assert -0.3 < found.interval.low < 0.0 < found.interval.high < 0.3


def nearest_centres(xs, length):
    """Returns the blocks along a straight street, with a centre each `length`.

    A place in the middle of two centres belongs to the first.
    """
    return np.ceil(xs / length - 0.5).clip(0, xs.max() // length)


def test_blocks_follow_the_street():
    """There and back in the other lane: both passes lie in one block."""
    xs = np.arange(0.0, 351.0)
    there, back = (
        np.stack([some, np.full_like(some, y), 0.0 * some], axis=1)
        for some, y in ((xs, 0.0), (xs[::-1], 7.0))
    )
    positions = np.concatenate([there, back])
    every = np.arange(len(positions))
    blocks = route_blocks(positions, every)
    # Too few for more than 80 m.
    np.testing.assert_array_equal(blocks[:351], nearest_centres(xs, 80.0))
    np.testing.assert_array_equal(blocks[:351], blocks[351:][::-1])
    # Centres are 80 m apart; ends are halfway between them.
    edges = np.flatnonzero(np.diff(blocks[:351]))
    assert edges.tolist() == [40, 120, 200, 280]
    assert blocks.max() == 4
    np.testing.assert_array_equal(
        route_blocks(positions, every[5::40]), blocks[5::40]
    )


@pytest.mark.parametrize(
    ("route", "length", "number"),
    [(500, 80, 7), (1000, 140, 8), (1700, 240, 8), (7000, 320, 22)],
)
def test_blocks_are_long_where_at_least_eight_remain(route, length, number):
    xs = np.arange(route + 1.0)
    blocks = route_blocks(xs[:, None] * [1.0, 0.0, 0.0], np.arange(len(xs)))
    np.testing.assert_array_equal(blocks, nearest_centres(xs, length))
    assert blocks.max() + 1 == number


def test_a_street_that_is_driven_twice_says_nothing_twice():
    rng = np.random.default_rng(3)
    one, other = (
        right_answers(rng.random(60) < share, np.arange(60) // 5)
        for share in (0.9, 0.5)
    )
    once = difference(one, other)
    twice = difference(
        *(type(one).joined([some, some]) for some in (one, other))
    )
    assert twice == once


def test_answers_that_are_repeated_say_nothing_new():
    """Conditions of one drive are not independent."""
    pair = equal_methods(np.random.default_rng(2), 15)
    once = difference(*pair)
    again = difference(*pair, 12, [0] * 12)
    assert again.value == pytest.approx(once.value)
    assert again.p_value == pytest.approx(once.p_value)
    assert again.interval.low == pytest.approx(once.interval.low)
    apart = difference(*pair, 12)
    assert apart.interval.low > once.interval.low
    assert apart.interval.high < once.interval.high


def test_all_differences_are_one_family():
    """Bonferroni's correction, of p-values and of intervals."""
    rng = np.random.default_rng(2)
    answers = {
        method: [equal_methods(rng, 12)[0]]
        for method in ("btc", "ring++", "solid")
    }
    compared = compared_by_right_answers(answers)
    for (first, second), found in compared.items():
        alone = difference(*answers[first], *answers[second])
        assert found.p_value == pytest.approx(min(1.0, 3 * alone.p_value))
        assert found.interval.low < alone.interval.low
        assert found.interval.high > alone.interval.high
    assert compared_by_right_answers({"btc": answers["btc"]}) == {}


def test_the_order_of_methods_does_not_matter():
    """Also where only one of them knows the blocks."""
    one, other = equal_methods(np.random.default_rng(6), 8)
    for first, second in (
        (one, other),
        (replace(one, blocks=None), other),
        (one, replace(other, blocks=None)),
    ):
        found, back = (
            difference(*pair) for pair in ((first, second), (second, first))
        )
        assert found.value == -back.value
        assert found.p_value == back.p_value
        assert found.interval.low == pytest.approx(-back.interval.high)
        assert found.p_value == difference(one, other).p_value
    with pytest.raises(ValueError, match="other blocks"):
        difference(one, replace(other, blocks=other.blocks[::-1]))


def test_what_a_block_contributes_to_a_mean_is_its_sum():
    """Then the interval is that of the sums, with one block at each end."""
    rng = np.random.default_rng(5)
    weights = rng.integers(1, 9, size=15).astype(float)
    sums = rng.binomial(weights.astype(int), 0.6).astype(float)
    value = sums.sum() / weights.sum()
    without = (sums.sum() - sums) / (weights.sum() - weights)
    found = jackknife_interval(value, without, weights, (0.0, 1.0))
    mean = weights.mean()
    expected, _ = sign_flip_test(
        np.append(sums, [0.0, mean]), np.append(weights, [mean, mean])
    )
    assert found.low == pytest.approx(expected.low)
    assert found.high == pytest.approx(expected.high)
    few = weights < np.sort(weights)[5]
    assert np.isnan(
        jackknife_interval(value, without[few], weights[few], (0.0, 1.0)).low
    )


def test_the_interval_of_recall_counts_blocks_with_a_match():
    rng = np.random.default_rng(7)
    blocks = np.arange(80) // 5
    has_match = blocks < 8
    some = replace(
        right_answers((rng.random(80) < 0.7) & has_match, blocks),
        has_match=has_match,
    )
    of_some, of_matched = (
        METRICS["r1"].interval(one) for one in (some, some.subset(has_match))
    )
    assert of_some == of_matched
    # Five blocks are too few.
    assert np.isnan(METRICS["r1"].interval(some.subset(blocks < 5)).low)


def test_the_interval_over_cities():
    values = np.array([0.8, 0.9, 0.85, 0.95, 0.7, 0.9, 0.8, 0.9])
    found = city_interval(values, np.ones(8), (0.0, 1.0))
    # Twice the range, 0.5, below the least; and the end of the range.
    padded = np.append(values, [0.2, 1.0])
    expected, _ = sign_flip_test(padded, np.ones(10))
    assert found.low == pytest.approx(expected.low)
    assert found.high == pytest.approx(max(expected.high, values.mean()))
    assert np.isnan(city_interval(values[:7], np.ones(7)).low)


@pytest.mark.parametrize("number", [12, 13, 14])
def test_intervals_over_cities_count_all_patterns(number):
    """Of the cities and two imaginary ones, by hand."""
    rng = np.random.default_rng(number)
    values = rng.beta(2.0, 1.0, size=number)
    found = city_interval(values, np.ones(number), (0.0, 1.0))
    beyond = 2.0 * np.ptp(values)
    padded = np.append(
        values, np.clip([values.min() - beyond, values.max() + beyond], 0, 1)
    )
    ones = np.ones(number + 2)
    for limit, outwards in ((found.low, -1.0), (found.high, 1.0)):
        inside, outside = (
            p_by_hand(padded, ones, limit + shift * outwards)
            for shift in (-1e-6, 1e-6)
        )
        assert outside < SIGNIFICANT <= inside


@pytest.mark.parametrize("number", [12, 30])
def test_the_order_of_cities_does_not_matter(number):
    rng = np.random.default_rng(number)
    sums, weights = rng.random(number), rng.integers(1, 4, number) + 0.0
    order = rng.permutation(number)
    assert city_interval(sums, weights) == city_interval(
        sums[order], weights[order]
    )
