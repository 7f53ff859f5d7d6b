"""Coverage of every printed interval, and size of every printed test.

python tests/benchmarks/interval_coverage.py [PART...] [--runs N]

Answers to queries and results of cities are made up at random; answers along a
street are as alike as `street_blocks.py` measures. The table on stdout says for
each quantity: in which share of the runs its interval is shown; in which share
of these it contains the true value; and, where there is no difference, how
often a test finds one nevertheless. Redirect it to `docs/notes/coverage.csv`.
On one core, this takes five minutes.
"""

import argparse
from collections.abc import Iterator, Sequence
import csv
from dataclasses import replace
import itertools
from pathlib import Path
import sys
import tempfile

import numpy as np
from scipy.signal import lfilter
from scipy.stats import norm

from evaluation.recognition import (
    METRICS,
    SIGNIFICANT,
    Interval,
    QueryOutcomes,
    compared_by_right_answers,
    numbers_of,
    route_blocks,
)
from evaluation.results import (
    Answers,
    QueryRows,
    Results,
    Row,
    Survival,
    compare_tables,
    excesses,
    judge_survival,
    rank_methods,
)

COLUMNS = (
    "part", "units", "conditions", "scenario", "quantity", "runs", "shown",
    "coverage", "size",
)  # fmt: skip
# Shares of right answers before and after a change.
CHANGES = ((0.9, 0.5), (1.0, 1.0), (1.0, 0.97), (0.5, 0.0))
# Shares of right answers without a cause, with each of two, and with both.
CAUSES = (
    (1.0, 1.0, 1.0, 1.0),
    (0.95, 0.8, 0.8, 0.65),
    (0.95, 0.7, 0.9, 0.3),
    (0.6, 0.5, 0.3, 0.3),
)
# Shares of right answers of methods.
METHODS = (
    (0.7, 0.7),
    (0.95, 0.95),
    (1.0, 1.0),
    (1.0, 0.9),
    (0.9, 0.6),
    (0.0, 0.05),
    (0.8, 0.8, 0.8, 0.8),
)
# Mean retained shares of cities, and how unlike each other the cities are.
CITIES = (
    (0.5, 0.1),
    (0.9, 0.02),
    (0.9, 0.1),
    (0.97, 0.02),
    (0.97, 0.1),
    (1.0, 0.1),
    (0.05, 0.1),
)
# Steps between the mean results of methods.
STEPS = (0.01, 0.05, 0.15)
# Lengths of straight routes [m].
ROUTES = (400, 1000, 1700, 3000, 7000)
# Distance between queries [m].
SPACING = 10
# Correlation of the normal variables behind two answers of a method: this times
# exp(-d / SCALE), at a distance of d [m]. By the arcsine law, it gives what
# `street_blocks.py` measures in the shipped cities: .36, .26, .17 and .10 at 7,
# 22, 40 and 60 m, and of the difference of two methods .25, .15, .09 and .05.
CLOSE = {"answers": 0.65, "differences": 0.43}
SCALE = {"answers": 45.0, "differences": 40.0}
# Share of the queries that have a match.
WITH_MATCH = 0.9
# Length of the route from which true values are computed [m].
MANY = 1_000_000
# Probabilities with which a city loses half of what it had; in all others
# nothing is lost.
RARE = (0.2, 0.25, 0.3)


class Count:
    """How often an interval is shown, and how often it contains the truth."""

    def __init__(self, truth: float) -> None:
        self.truth = truth
        self.runs = self.shown = self.hits = self.found = 0

    def add(self, interval: Interval, is_found: bool = False) -> None:
        self.runs += 1
        self.found += is_found
        if not np.isnan(interval.low):
            self.shown += 1
            low, high = interval.low - 1e-9, interval.high + 1e-9
            self.hits += low <= self.truth <= high

    def columns(self, has_size: bool = False) -> dict[str, object]:
        coverage = f"{self.hits / self.shown:.3f}" if self.shown else ""
        return {
            "runs": self.runs,
            "shown": f"{self.shown / self.runs:.3f}",
            "coverage": coverage,
            "size": f"{self.found / self.runs:.3f}" if has_size else "",
        }


def beta(
    rng: np.random.Generator, mean: float, correlation: float, size: int
) -> np.ndarray:
    """Returns shares (size,) with a mean; equal shares at 0 and 1."""
    if mean in (0.0, 1.0):
        return np.full(size, mean)
    total = 1.0 / correlation - 1.0
    return rng.beta(mean * total, (1.0 - mean) * total, size=size)


def luck(
    rng: np.random.Generator, number: int, what: str = "answers"
) -> np.ndarray:
    """Returns the part (number,) of normal variables that is alike nearby."""
    kept = np.exp(-SPACING / SCALE[what])
    noise = rng.normal(size=number)
    # The first one has the variance of all others.
    noise[1:] *= np.sqrt(1.0 - kept**2)
    return np.sqrt(CLOSE[what]) * lfilter([1.0], [1.0, -kept], noise)


def right_answers(
    rng: np.random.Generator,
    along: np.ndarray,
    share: float,
    what: str = "answers",
) -> np.ndarray:
    """Returns which queries (Q,) are right, from the `luck` along a street."""
    noise = rng.normal(size=len(along))
    return along + np.sqrt(1.0 - CLOSE[what]) * noise < norm.ppf(share)


def blocks_of(length: int) -> np.ndarray:
    """Returns the block (Q,) of each query along a straight route."""
    positions = np.arange(length)[:, None] * [1.0, 0.0, 0.0]
    return route_blocks(positions, np.arange(0, length, SPACING))


def answers(
    rng: np.random.Generator, shares: Sequence[float], blocks: np.ndarray
) -> list[QueryOutcomes]:
    """Returns answers to the same queries with several shares of right ones.

    Right answers tend to have better scores.
    """
    has_match = rng.random(len(blocks)) < WITH_MATCH
    found = []
    for share in shares:
        along = luck(rng, len(blocks))
        right = right_answers(rng, along, share) & has_match
        scores = right + rng.normal(size=len(blocks))
        ranks = np.where(right, 1.0, 2.0)
        found.append(
            QueryOutcomes(scores, right, has_match, ranks, 100, blocks)
        )
    return found


def drives(
    runs: int, scenarios: Sequence[Sequence[float]] = CHANGES
) -> Iterator[dict[str, object]]:
    """Metrics of one method on one drive, with and without a change."""
    names = ("auc", "auc_strict", "r1")
    kept = ("relative_auc", "relative_auc_strict", "relative_r1")
    for before, after in scenarios:
        rng = np.random.default_rng(0)
        many = np.zeros(MANY // SPACING, dtype=int)
        control, changed = answers(rng, (before, after), many)
        truth = {n: METRICS[n].of(changed) for n in names}
        for name, of in zip(kept, names, strict=True):
            truth[name] = truth[of] / METRICS[of].of(control)
        for length in ROUTES:
            counts = {name: Count(truth[name]) for name in (*names, *kept)}
            blocks = blocks_of(length)
            for _ in range(runs):
                then, now = answers(rng, (before, after), blocks)
                for one in numbers_of("place", now, then):
                    if one.metric in counts:
                        counts[one.metric].add(one.interval)
            for name, count in counts.items():
                yield {
                    "part": "drives",
                    "units": blocks[-1] + 1,
                    "conditions": 1,
                    "scenario": f"{length} m, {before:g} right, then {after:g}",
                    "quantity": name,
                    **count.columns(),
                }


def two_causes(
    runs: int, scenarios: Sequence[Sequence[float]] = CAUSES
) -> Iterator[dict[str, object]]:
    """How much more two causes cost together than each by itself."""
    for shares in scenarios:
        whole, *kept = (
            METRICS["auc"].of(one)
            for one in answers(
                np.random.default_rng(0),
                shares,
                np.zeros(MANY // SPACING, dtype=int),
            )
        )
        first, second, both = np.array(kept) / whole
        truth = first * second - both
        for length in ROUTES[1::2]:
            rng = np.random.default_rng(length)
            count = Count(truth)
            blocks = blocks_of(length)
            for _ in range(runs):
                count.add(_interval(answers(rng, shares, blocks)))
            yield {
                "part": "excesses",
                "units": blocks[-1] + 1,
                "conditions": 4,
                "scenario": f"{length} m, {_of_all(shares)}",
                "quantity": "excess of two causes",
                **count.columns(),
            }


def _interval(some: Sequence[QueryOutcomes]) -> Interval:
    """Returns that of answers without, with either and with both causes."""
    rows = [
        Answers(
            experiment="e",
            map="city",
            database="a",
            query="b",
            seed=1,
            factors={"cause": cause, "level": int(cause != "none")},
            task="place",
            method="solid",
            verified=False,
            protocol="own",
            columns={
                "correct": outcomes.is_right,
                "score": outcomes.best_scores,
                "has_match": outcomes.has_match,
                "block": outcomes.blocks,
            },
        )
        for cause, outcomes in zip(
            ("none", "snow", "leaves", "snow+leaves"), some, strict=True
        )
    ]
    (found,) = excesses(QueryRows.of(rows))
    return Interval(found.low, found.high)


def _of_all(shares: Sequence[float]) -> str:
    return " and ".join(f"{share:g}" for share in shares) + " right"


def differences(
    runs: int, scenarios: Sequence[Sequence[float]] = METHODS
) -> Iterator[dict[str, object]]:
    """Differences of R@1 between methods, on several drives or conditions."""
    for shares in scenarios:
        for conditions in (2, 4, 12):
            yield _differences(shares, 1000, [0] * conditions, runs)
        if len(shares) == 2:
            for length in ROUTES[1:]:
                yield _differences(shares, length, [0], runs)
                yield _differences(shares, length, [0, 1], runs)


def _differences(
    shares: Sequence[float], length: int, drives: Sequence[int], runs: int
) -> dict[str, object]:
    """Returns the row of a scenario. All differences count together.

    Conditions of one drive share the luck along its streets.
    """
    what = "differences"
    rng = np.random.default_rng(len(drives))
    count = Count(0.0)
    blocks = blocks_of(length)
    for _ in range(runs):
        asked: dict[int, list[QueryOutcomes]] = {}
        for drive in sorted(set(drives)):
            along = [luck(rng, len(blocks), what) for _ in shares]
            for _ in range(drives.count(drive)):
                has_match = rng.random(len(blocks)) < WITH_MATCH
                for k, share in enumerate(shares):
                    right = right_answers(rng, along[k], share, what)
                    right &= has_match
                    some = QueryOutcomes(
                        np.zeros(len(blocks)),
                        right,
                        has_match,
                        np.where(right, 1.0, 2.0),
                        100,
                        blocks,
                    )
                    asked.setdefault(k, []).append(some)
        found = compared_by_right_answers(asked, drives)
        is_hit = all(
            np.isnan(one.interval.low)
            or one.interval.low <= shares[a] - shares[b] <= one.interval.high
            for (a, b), one in found.items()
        )
        first = next(iter(found.values())).interval
        shown = Interval(-1.0, 1.0) if is_hit else Interval(2.0, 2.0)
        count.add(
            first if np.isnan(first.low) else shown,
            any(one.p_value < SIGNIFICANT for one in found.values()),
        )
    number = len(set(drives))
    where = f"{number} drives of {length} m" if number > 1 else f"{length} m"
    return {
        "part": "differences",
        "units": number * (blocks[-1] + 1),
        "conditions": len(drives),
        "scenario": f"{where}, {_of_all(shares)}",
        "quantity": "difference of r1",
        **count.columns(has_size=len(set(shares)) == 1),
    }


def city_row(city: int, pair: int, value: float) -> Row:
    return Row(
        experiment="e",
        map=f"city {city}",
        database=f"drive {pair}",
        query="query",
        seed=1,
        factors={},
        task="place",
        method="solid",
        verified=False,
        protocol="own",
        metric="relative_auc_strict",
        value=value,
    )


def cities(
    runs: int, scenarios: Sequence[Sequence[float]] = CITIES
) -> Iterator[dict[str, object]]:
    """Means over cities, and survival, with unequal numbers of pairs."""
    for mean, correlation in scenarios:
        spread = np.sqrt(mean * (1.0 - mean) * correlation)
        for number in (1, 2, 4, 8, 12):
            rng = np.random.default_rng(number)
            count, kept = Count(mean), Count(1.0 - mean)
            for _ in range(runs):
                rows = [
                    city_row(k, pair, float(value))
                    for k, value in enumerate(
                        beta(rng, mean, correlation, number)
                    )
                    for pair in range(int(rng.integers(1, 4)))
                ]
                (ranked,) = rank_methods(rows)
                if len(rows) > 1:
                    count.add(ranked.interval)
                (one,) = judge_survival(rows)
                kept.add(one.interval, one.verdict == "survives")
            for name, some, has_size in (
                ("mean over cities", count, False),
                ("loss, and survival", kept, mean <= 0.9),
            ):
                yield {
                    "part": "cities",
                    "units": number,
                    "conditions": "",
                    "scenario": f"mean {mean:g}, deviation {spread:.2f}",
                    "quantity": name,
                    **some.columns(has_size),
                }


def rare_failures(
    runs: int, scenarios: Sequence[float] = RARE
) -> Iterator[dict[str, object]]:
    """Survival of cities of which few lose half, and the others nothing.

    Twelve independent cities, or three on each of four networks, which fail
    together.
    """
    for chance, networks in itertools.product(scenarios, (12, 4)):
        rng = np.random.default_rng(networks)
        loss = 0.5 * chance
        count = Count(loss)
        for _ in range(runs):
            fails = rng.random(networks) < chance
            losses = np.repeat(0.5 * fails, 12 // networks)
            one = Survival.of("solid", dict(enumerate(losses.tolist())))
            count.add(one.interval, one.verdict == "survives")
        yield {
            "part": "rare",
            "units": 12,
            "conditions": "",
            "scenario": f"half lost with probability {chance:g},"
            f" {networks} independent networks",
            "quantity": "loss, and survival",
            **count.columns(has_size=True),
        }


def rankings(
    runs: int, steps: Sequence[float] = STEPS
) -> Iterator[dict[str, object]]:
    """Kendall's tau between the rankings of four methods in two tables."""
    orders = {1.0: (0, 1, 2, 3), 2.0 / 3.0: (0, 2, 1, 3)}
    for tau, step, number in itertools.product(orders, steps, (12, 20)):
        rng = np.random.default_rng(number)
        count = Count(tau)
        for _ in range(runs):
            with tempfile.TemporaryDirectory() as folder:
                paths = [Path(folder, name) for name in ("a.csv", "b.csv")]
                for path, order in zip(
                    paths, (orders[1.0], orders[tau]), strict=True
                ):
                    means = 0.3 + step * np.array(order)
                    rows = _scattered(rng, means, number)
                    Results.of(rows).write_csv(path)
                found = compare_tables(paths, rankings=True)
            count.add(found.agreements[0].interval)
        yield {
            "part": "rankings",
            "units": number,
            "conditions": 1,
            "scenario": f"true tau {tau:.2g}, steps of {step:g}",
            "quantity": "Kendall's tau",
            **count.columns(),
        }


def _scattered(
    rng: np.random.Generator, means: np.ndarray, number: int
) -> list[Row]:
    """Returns results of methods in cities, of which some are hard for all."""
    hard = rng.normal(0.0, 0.05, (number, 1))
    results = means + hard + rng.normal(0.0, 0.08, (number, len(means)))
    return [
        replace(
            city_row(city, 0, float(np.clip(value, 0.0, 1.0))),
            method=f"method_{k}",
            metric="auc",
        )
        for city, values in enumerate(results)
        for k, value in enumerate(values)
    ]


PARTS = {
    "drives": drives,
    "excesses": two_causes,
    "differences": differences,
    "cities": cities,
    "rare": rare_failures,
    "rankings": rankings,
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("parts", nargs="*", default=list(PARTS), metavar="PART")
    parser.add_argument("--runs", type=int, default=1000)
    options = parser.parse_args()
    table = csv.DictWriter(sys.stdout, COLUMNS, lineterminator="\n")
    table.writeheader()
    for name in options.parts:
        for row in PARTS[name](options.runs):
            table.writerow(row)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
