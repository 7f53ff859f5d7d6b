"""Tests and intervals by sign flips over blocks: how sure a result is.

Neighbouring queries along a street tend to be right or wrong together.
Therefore whole blocks of street are the units, and not queries. All tests and
all confidence intervals of results come from the function `sign_flip_test`.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
import itertools
import math
from typing import Any

import numpy as np

from evaluation.base import json_values
from evaluation.recognition.query_outcomes import QueryOutcomes, common_blocks

# A difference is significant if its p-value is below this value; intervals
# contain their value with a probability of 1 minus this.
SIGNIFICANT = 0.05
# Least number of blocks that can show anything: with fewer, no p-value of a
# sign-flip test is below 0.05, so there are no intervals.
LEAST_BLOCKS = 6
# Least number of cities that give a mean over cities an interval.
LEAST_CITIES = 8
# Distances between the centres of neighbouring blocks of street [m]. Queries on
# both sides of a border are alike, so that the units are independent only if
# blocks are long; see docs/verification.md.
_BLOCK_LENGTHS = range(320, 79, -20)
# Least number of blocks of a drive whose blocks are longer than 80 m: two
# drives of eight can show a difference of two of six methods.
_ENOUGH_BLOCKS = 8
# How far imaginary cities lie beyond all others, see `city_interval`.
_BEYOND = 2.0
# Up to this number of units, all splits of the units are counted: 14 cities or
# blocks, and two imaginary ones.
_MOST_ENUMERATED = 16
# Number of random splits of more units.
_SPLITS = 9999
# A right answer in all conditions is this number, so that sums are exact.
_UNIT = 2.0**40


@dataclass(frozen=True)
class Interval:
    """A 95 % confidence interval; its limits are NaN if it is unknown."""

    low: float = math.nan
    high: float = math.nan

    def to_json(self) -> list[float | None]:
        """Returns the lower and upper limit; NaN becomes None."""
        return [json_values(self.low), json_values(self.high)]


UNKNOWN = Interval()


@dataclass(frozen=True)
class Difference:
    """A difference of two results, with an interval and a p-value.

    Attributes:
        value: the first result minus the second.
        interval: 95 % interval; unknown if too few blocks show a difference.
        p_value: two-sided p-value under the hypothesis that there is no
            difference. It is below 0.05 if and only if 0 is outside of the
            interval.
    """

    value: float
    interval: Interval
    p_value: float


def sign_flip_test(
    sums: np.ndarray, weights: np.ndarray, num_tests: float = 1.0
) -> tuple[Interval, float]:
    """Returns the 95 % interval of a mean, and the p-value of a mean of 0.

    The mean of N blocks is the sum of `sums` over the sum of `weights`. To test
    the hypothesis that the mean is m, each block's deviation, its sum minus m
    times its weight, gets a random sign (Fisher, The Design of Experiments,
    1935). The p-value is the share of sign patterns whose sum of deviations is,
    in magnitude, at least as great as the measured one. The interval contains
    each m whose p-value is at least 0.05. Thus interval and p-value never
    contradict each other. The test is exact if the deviations of a block are
    distributed symmetrically about 0, as they are if two methods are equal.

    A pattern of signs splits the blocks into two halves. A pattern counts for m
    if and only if m lies between the means of the two halves. This gives the
    limits of the interval without a search.

    All patterns are counted up to 16 blocks. For more blocks, 9,999 random
    patterns and the measured one are counted. The patterns depend only on the
    number of blocks. Therefore more evidence in a block never raises the
    p-value of a difference, also for random patterns.

    Args:
        sums: (N,) sum of each block.
        weights: (N,) weight of each block, such as its number of queries.
            Blocks without weight do not count.
        num_tests: number of intervals that are shown together. The p-value is
            multiplied by it, up to 1, and the interval becomes wider
            accordingly (Bonferroni): all intervals together contain their means
            with a probability of 95 %.

    Returns:
        The interval, unknown if the blocks are too few to show anything; and
        the p-value.
    """
    counts = weights > 0.0
    sums, weights = sums[counts], weights[counts]
    halves = _halves(len(sums))
    first = halves @ sums
    second = sums.sum() - first
    scale = num_tests / (1.0 + len(halves))
    p_value = min(1.0, scale * (1.0 + int((first * second <= 0.0).sum())))
    weight = halves @ weights
    rest = weights.sum() - weight
    is_split = (weight > 0.0) & (rest > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        means = np.stack([first / weight, second / rest])
    lows = np.sort(np.where(is_split, means.min(axis=0), -np.inf))
    highs = np.sort(np.where(is_split, means.max(axis=0), np.inf))
    # Number of patterns beside the measured one that a value needs.
    needed = math.ceil(SIGNIFICANT / scale) - 1
    if scale * (needed + 1.0) < SIGNIFICANT:
        needed += 1
    if needed < 1 or not math.isfinite(lows[needed - 1] - highs[-needed]):
        return UNKNOWN, p_value
    return Interval(float(lows[needed - 1]), float(highs[-needed])), p_value


def route_blocks(positions: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Returns the block (Q,) of street in which each query lies.

    Neighbouring queries tend to be right or wrong together, also if they lie
    on different passes of one street. Therefore a block is a piece of the world
    and not of the route: each position belongs to the nearest of some centres.
    The first position of the drive is a centre, and so is each further one that
    is at least a length from all earlier centres: the greatest of 320, 300,
    ..., 80 m that gives at least eight blocks, or 80 m. Few long blocks are
    less alike than many short ones (Canay, Romano and Shaikh, Econometrica 85,
    2017). On a straight street, blocks are as long, except for the first and
    the last.

    Args:
        positions: (N, 3) positions of the sensor along the drive [m].
        frames: (Q,) frame numbers of the queries.

    Example:
        from evaluation import METRICS, judge, route_blocks

        blocks = route_blocks(query.X_WS[:, :3, 3], queries)
        print(METRICS["auc"].interval(judge(scores, matches, blocks)))
    """
    block = np.zeros(len(positions), dtype=np.int64)
    for length in _BLOCK_LENGTHS:
        block = _nearest_centres(positions, length)
        if block.max(initial=0) + 1 >= _ENOUGH_BLOCKS:
            break
    return block[frames]


def _nearest_centres(positions: np.ndarray, length: float) -> np.ndarray:
    """Returns the block (N,) of each position, see `route_blocks`."""
    block = np.zeros(len(positions), dtype=np.int64)
    distance = np.full(len(positions), np.inf)
    centre, number = 0, 0
    while len(positions):
        found = np.linalg.norm(positions - positions[centre], axis=1)
        block[found < distance] = number
        distance = np.minimum(found, distance)
        is_far = distance >= length
        if not is_far.any():
            break
        centre, number = int(is_far.argmax()), number + 1
    return block


@lru_cache(maxsize=8)
def _halves(number: int) -> np.ndarray:
    """Returns splits (S, number) of blocks: 1 in one half, 0 in the other."""
    if number <= 1:
        return np.empty((0, number))
    if number <= _MOST_ENUMERATED:
        # The last block is always in the second half: signs that are all
        # flipped give the same magnitude.
        codes = np.arange(1, 2 ** (number - 1))
        bits = codes[:, None] >> np.arange(number) & 1
        return bits.astype(np.float64)
    rng = np.random.default_rng(number)
    return rng.integers(2, size=(_SPLITS, number)).astype(np.float64)


def leave_one_out(outcomes: QueryOutcomes) -> np.ndarray:
    """Returns which queries (N, Q) are left without each block, 0 or 1."""
    known, of_query = np.unique(outcomes.own_blocks, return_inverse=True)
    return (of_query != np.arange(len(known))[:, None]).astype(np.float64)


def jackknife_interval(
    value: float,
    without: np.ndarray,
    weights: np.ndarray,
    ends: tuple[float, float] = (-math.inf, math.inf),
) -> Interval:
    """Returns the 95 % interval of a result, by `sign_flip_test` over blocks.

    What a block contributes to the result follows from the result without this
    block (jackknife; for blocks of different sizes: Busing, Meijer and Van der
    Leeden, Statistics and Computing 9, 1999). For a mean over queries, this is
    the block's sum. Two imaginary blocks of mean weight are added, one at each
    end of the result's range: otherwise a result at an end, such as a method
    without an error, would seem to be known exactly.

    Args:
        value: the result of all blocks.
        without: (N,) the result without each block; NaN if undefined.
        weights: (N,) weight of each block, such as its number of queries.
        ends: the result in a block in which it is least, and greatest. An
            infinite end adds no imaginary block.

    Returns:
        The interval, within the ends; unknown for fewer than 6 blocks, if a
        result is undefined, or if all blocks have the same result and an end is
        infinite.
    """
    counts = weights > 0.0
    without, weights = without[counts], weights[counts]
    if len(weights) < LEAST_BLOCKS or np.isnan([value, *without]).any():
        return UNKNOWN
    total = weights.sum()
    sums = total * value - (total - weights) * without
    known = [end for end in ends if math.isfinite(end)]
    if len(known) < len(ends) and np.ptp(without) == 0.0:
        return UNKNOWN
    mean = weights.mean()
    sums = np.append(sums, np.array(known) * mean)
    weights = np.append(weights, [mean] * len(known))
    interval, _ = sign_flip_test(sums, weights)
    # The imaginary blocks may move a limit past the result.
    low = min(max(interval.low, ends[0]), value)
    return Interval(low, max(min(interval.high, ends[1]), value))


def city_interval(
    sums: np.ndarray,
    weights: np.ndarray,
    ends: tuple[float, float] = (-math.inf, math.inf),
) -> Interval:
    """Returns the 95 % interval of a mean over cities, by `sign_flip_test`.

    Cities are few, and most of them tend to be similar while a few are much
    worse, in particular if many results are perfect. Therefore two imaginary
    cities of mean weight are added. They lie as far beyond the least and the
    greatest result of a city as twice the distance between these two results,
    but not beyond the ends of the range. An imaginary city at each end of the
    range, as for blocks, would hide what ten cities show. The order of the
    cities does not matter.

    Args:
        sums: (N,) sum of the results in each city.
        weights: (N,) number of results in each city.
        ends: least and greatest value that a result can have.

    Returns:
        The interval, within the ends; unknown for fewer than 8 cities.
    """
    if len(sums) < LEAST_CITIES:
        return UNKNOWN
    # Random patterns of signs depend on the order.
    order = np.lexsort((sums, weights))
    sums, weights = sums[order], weights[order]
    value = sums.sum() / weights.sum()
    means = sums / weights
    beyond = _BEYOND * np.ptp(means)
    imaginary = np.array([means.min() - beyond, means.max() + beyond])
    imaginary = imaginary.clip(*ends)
    mean = weights.mean()
    interval, _ = sign_flip_test(
        np.append(sums, imaginary * mean), np.append(weights, [mean, mean])
    )
    # The imaginary cities may move a limit past the mean.
    low = min(max(interval.low, ends[0]), value)
    return Interval(float(low), float(max(min(interval.high, ends[1]), value)))


def compared_by_right_answers(
    answers: Mapping[Hashable, Sequence[QueryOutcomes]],
    drives: Sequence[int] | None = None,
) -> dict[tuple[Any, Any], Difference]:
    """Returns the difference of the mean R@1 between any two methods.

    Evidence comes from right answers, and not from the AUC: one more right
    answer of the better method never raises the p-value, equal answers have a
    p-value of 1, and a lead without spread has the least p-value of all. A test
    of AUC, in which an answer changes what all other answers count, could not
    promise this.

    The units are blocks of street, see `sign_flip_test`. All conditions of a
    query drive share its blocks, since a method that suits the streets of a
    drive tends to be right under all of its conditions. Blocks of different
    drives are taken for independent.

    The interval comes from two imaginary blocks more, of mean weight: in one,
    the first method is always right and the second never, in the other it is
    the other way round. Without them, a difference that hardly any block shows
    would seem to be known exactly. Only if the p-value is below 0.05, the limit
    near 0 comes from the test that gives the p-value, so that interval and
    p-value agree. With fewer than six blocks, the interval is unknown.

    Intervals and p-values are corrected (Bonferroni) for the number of
    differences, and for what neighbouring blocks have in common, as if there
    were half as many differences more.

    Args:
        answers: method -> its outcomes on each set of queries. The queries must
            be the same for all methods, and so must their blocks, see
            `QueryOutcomes.blocks`. Outcomes without blocks take the blocks of
            the other methods.
        drives: for each set of queries, a number that identifies the drive. By
            default, each set belongs to a different drive.

    Returns:
        (first method, second method) -> R@1 of the first minus R@1 of the
        second, as means over the sets. A set in which a method has no query
        with a match counts as 0.

    Raises:
        ValueError: two methods have other blocks for the same queries.
    """
    sets = list(zip(*answers.values(), strict=True))
    drives = range(len(sets)) if drives is None else drives
    places = [
        [(drive, block) for block in common_blocks(outcomes).tolist()]
        for drive, outcomes in zip(drives, sets, strict=True)
    ]
    number_of = {
        place: k
        for k, place in enumerate(dict.fromkeys(itertools.chain(*places)))
    }
    right = np.zeros((len(answers), len(number_of)))
    asked = np.zeros_like(right)
    shares = np.zeros((len(answers), len(sets)))
    for n, (of_set, outcomes) in enumerate(zip(places, sets, strict=True)):
        block = np.array([number_of[place] for place in of_set], dtype=int)
        for k, one in enumerate(outcomes):
            with_match = int(one.has_match.sum())
            unit = np.rint(_UNIT / (max(1, with_match) * len(sets)))
            np.add.at(asked[k], block[one.has_match], unit)
            is_right = one.has_match & one.is_right
            np.add.at(right[k], block[is_right], unit)
            shares[k, n] = is_right.sum() / max(1, with_match)
    pairs = list(itertools.combinations(range(len(answers)), 2))
    found = [
        _difference(
            float(np.mean(shares[first] - shares[second])),
            right[first] - right[second],
            np.maximum(asked[first], asked[second]),
            float(len(pairs)),
        )
        for first, second in pairs
    ]
    return dict(zip(itertools.combinations(answers, 2), found, strict=True))


def _difference(
    value: float, leads: np.ndarray, weights: np.ndarray, num_tests: float
) -> Difference:
    """Returns a difference with its test, from the lead (N,) in each block."""
    counts = weights > 0.0
    leads, weights = leads[counts], weights[counts]
    mean = weights.sum() / max(1, len(weights))
    # Without a difference, an imaginary block affects no p-value.
    tested, p_value = sign_flip_test(
        np.append(leads, 0.0), np.append(weights, mean), num_tests
    )
    wide, _ = sign_flip_test(
        np.append(leads, [-mean, mean]),
        np.append(weights, [mean, mean]),
        num_tests,
    )
    if len(leads) < LEAST_BLOCKS or math.isnan(tested.low + wide.low):
        return Difference(value, UNKNOWN, p_value)
    low, high = max(wide.low, -1.0), min(wide.high, 1.0)
    if p_value >= SIGNIFICANT:
        low, high = min(low, 0.0), max(high, 0.0)
    elif value > 0.0:
        low = tested.low
    else:
        high = tested.high
    # The imaginary blocks may move a limit past the difference.
    interval = Interval(min(low, value), max(high, value))
    return Difference(value, interval, p_value)
