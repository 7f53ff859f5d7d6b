"""What a method makes of two drives, in numbers."""

from dataclasses import replace
import math

import numpy as np
import pytest
from scipy.stats import binom

from evaluation.recognition import (
    FAULTS,
    QueryOutcomes,
    jackknife_interval,
    numbers_of,
)
from evaluation.recognition.query_outcomes import faults


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
    return replace(outcomes, columns=columns)


def part(number, kept):
    """Returns which queries are right: the first ones."""
    return np.arange(number) < kept


def numbers(now, before=None):
    """Metric -> value, and metric -> interval."""
    found = list(numbers_of("place", now, before, method="solid"))
    assert len({one.metric for one in found}) == len(found)
    assert {(one.method, one.verified, one.n) for one in found} == {
        ("solid", False, len(now))
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
    # What is compared with itself has no interval.
    assert math.isnan(intervals["relative_auc"].low)
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


def test_what_is_wrong_with_each_answer():
    """Each kind of fault occurs once, and two best places are right."""
    one = answered([1, 1, 0, 0, 0, 0, 0])
    one.has_match[2] = False
    frames = np.array([0, 1, 2, -1, 4, 5, 6])
    distances = np.array([1.0, 1.0, 1.0, np.nan, np.nan, 15.0, 15.1])
    one.columns["why"][:] = faults(one, frames, distances, 7.5)
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
    outcomes = answered([0, 0])
    distances = 2 * radius + np.array([-1e-9, 1e-9])
    found = faults(outcomes, np.arange(2), distances, radius)
    assert found.tolist() == ["near_miss", "elsewhere"]
