import math

import numpy as np
import pytest
from scipy.stats import binom

from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.survival import Kept, paired_intervals


def outcomes(is_right, has_match=None):
    """Outcomes with equal best scores, whose AUC is R@1."""
    right = np.array(is_right, dtype=bool)
    match = np.ones(len(right), bool) if has_match is None else has_match
    return QueryOutcomes(
        np.ones(len(right)),
        right,
        np.array(match),
        np.where(right, 1.0, np.inf),
        5,
    )


def test_the_same_queries_are_drawn_with_and_without_the_change():
    # Half of the queries are right and the change has no effect: every sample
    # keeps all.
    right = np.arange(40) % 2 == 0
    for interval in paired_intervals(outcomes(right), outcomes(right)):
        assert (interval.low, interval.high) == (1.0, 1.0)


def test_intervals_of_a_binomial():
    # All are right without the change: a sample keeps the part of its queries
    # that are still right.
    number, kept = 60, 45
    changed = outcomes(np.arange(number) < kept)
    low, high = binom.ppf([0.025, 0.975], number, kept / number) / number
    before = outcomes(np.ones(number))
    for interval in paired_intervals(before, changed):
        assert interval.low == pytest.approx(low, abs=1.1 / number)
        assert interval.high == pytest.approx(high, abs=1.1 / number)


def test_pairs_are_closer_than_their_parts():
    # Each query that is still right was right before: 36 of 40, of 80 in all.
    before = outcomes(np.arange(80) < 40)
    after = outcomes(np.arange(80) < 36)
    for interval in paired_intervals(before, after):
        # A sample with 40 right ones keeps 36 of them on average.
        low, high = binom.ppf([0.025, 0.975], 40, 0.9) / 40
        assert interval.low == pytest.approx(low, abs=0.05)
        assert interval.high == pytest.approx(high, abs=0.05)


def test_equal_seeds_draw_equal_queries():
    before, after = outcomes(np.ones(30)), outcomes(np.arange(30) < 20)
    first, again, other = (
        paired_intervals(before, after, seed) for seed in (0, 0, 1)
    )
    assert first == again != other


def test_what_has_no_partner_has_no_interval():
    for before, after in (([1, 1], [1, 0, 1]), ([], [])):
        for interval in paired_intervals(outcomes(before), outcomes(after)):
            assert math.isnan(interval.low)
            assert math.isnan(interval.high)


def test_share():
    (interval, _) = paired_intervals(outcomes([0, 0]), outcomes([1, 0]))
    assert math.isnan(interval.low)
    assert math.isnan(Kept(0.0, 0.5, interval).share)
    assert Kept(0.8, 0.2, interval).share == pytest.approx(0.25)
    assert Kept(0.8, 0.0, interval).share == 0.0
