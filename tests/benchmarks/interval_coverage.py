"""Coverage of every printed interval, and size of every printed test.

python tests/benchmarks/interval_coverage.py [PART...] [--runs N]

Answers to queries and results of cities are made up at random. The table on
stdout says for each quantity: in which share of the runs its interval is shown;
in which share of these it contains the true value; and, where there is no
difference, how often a test finds one nevertheless. Redirect it to
`docs/notes/coverage.csv`. On one core, this takes five minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
import csv
from dataclasses import replace
import itertools
from pathlib import Path
import sys
import tempfile

import numpy as np

from evaluation.recognition import (
    METRICS,
    SIGNIFICANT,
    Interval,
    QueryOutcomes,
    compared_by_right_answers,
    numbers_of,
)
from evaluation.results import (
    Answers,
    QueryRows,
    Results,
    Row,
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
# Intraclass correlations of the results on one road network.
ALIKE = (0.13, 0.5, 0.75)
# Steps between the mean results of methods.
STEPS = (0.01, 0.05, 0.15)
# Queries of a block: from 1 to twice the mean less 1.
MEAN_QUERIES = 5
# Correlation of the answers in a block.
IN_BLOCK = 0.2
# Share of the queries that have a match.
WITH_MATCH = 0.9
# Number of blocks from which true values are computed.
MANY = 20000


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


def answers(
    rng: np.random.Generator, shares: Sequence[float], num_blocks: int
) -> list[QueryOutcomes]:
    """Returns answers to the same queries with several shares of right ones.

    All share the luck of a block; right answers tend to have better scores.
    """
    sizes = rng.integers(1, 2 * MEAN_QUERIES, size=num_blocks)
    blocks = np.repeat(np.arange(num_blocks), sizes)
    has_match = rng.random(len(blocks)) < WITH_MATCH
    found = []
    for share in shares:
        chance = beta(rng, share, IN_BLOCK, num_blocks)
        right = (rng.random(len(blocks)) < chance[blocks]) & has_match
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
        control, changed = answers(rng, (before, after), MANY)
        truth = {n: METRICS[n].of(changed) for n in names}
        for name, of in zip(kept, names, strict=True):
            truth[name] = truth[of] / METRICS[of].of(control)
        for num_blocks in (4, 10, 24):
            counts = {name: Count(truth[name]) for name in (*names, *kept)}
            for _ in range(runs):
                then, now = answers(rng, (before, after), num_blocks)
                for one in numbers_of("place", now, then):
                    if one.metric in counts:
                        counts[one.metric].add(one.interval)
            for name, count in counts.items():
                yield {
                    "part": "drives",
                    "units": num_blocks,
                    "conditions": 1,
                    "scenario": f"{before:g} right, then {after:g}",
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
            for one in answers(np.random.default_rng(0), shares, MANY)
        )
        first, second, both = np.array(kept) / whole
        truth = first * second - both
        for num_blocks in (4, 10, 24):
            rng = np.random.default_rng(num_blocks)
            count = Count(truth)
            for _ in range(runs):
                count.add(_interval(answers(rng, shares, num_blocks)))
            yield {
                "part": "excesses",
                "units": num_blocks,
                "conditions": 4,
                "scenario": " and ".join(f"{s:g}" for s in shares) + " right",
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


def differences(
    runs: int, scenarios: Sequence[Sequence[float]] = METHODS
) -> Iterator[dict[str, object]]:
    """Differences of R@1 between methods, under several conditions."""
    for shares in scenarios:
        for conditions in (1, 2, 4, 12):
            yield _differences(shares, conditions, 10, runs)
        if len(shares) == 2:
            yield _differences(shares, 1, 24, runs)


def _differences(
    shares: Sequence[float], conditions: int, num_blocks: int, runs: int
) -> dict[str, object]:
    """Returns the row of a scenario. All differences count together."""
    rng = np.random.default_rng(conditions)
    count = Count(0.0)
    for _ in range(runs):
        chances = [beta(rng, s, IN_BLOCK, num_blocks) for s in shares]
        asked: dict[int, list[QueryOutcomes]] = {}
        for _ in range(conditions):
            # Other queries in each condition, along the same streets.
            sizes = rng.integers(1, 2 * MEAN_QUERIES, size=num_blocks)
            blocks = np.repeat(np.arange(num_blocks), sizes)
            has_match = rng.random(len(blocks)) < WITH_MATCH
            for k, chance in enumerate(chances):
                right = rng.random(len(blocks)) < chance[blocks]
                ranks = np.where(right & has_match, 1.0, 2.0)
                some = QueryOutcomes(
                    np.zeros(len(blocks)),
                    right & has_match,
                    has_match,
                    ranks,
                    100,
                    blocks,
                )
                asked.setdefault(k, []).append(some)
        found = compared_by_right_answers(asked, [0] * conditions)
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
    return {
        "part": "differences",
        "units": num_blocks,
        "conditions": conditions,
        "scenario": " and ".join(f"{share:g}" for share in shares) + " right",
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


def on_networks(
    rng: np.random.Generator, mean: float, spread: float, alike: float
) -> np.ndarray:
    """Returns results (12,) of cities, of which three share a road network.

    A city has the result of its network, or one of its own. Two cities of one
    network have the intraclass correlation `alike`, and each city the same
    distribution as in `cities`.
    """
    of_network = np.repeat(beta(rng, mean, spread, 4), 3)
    own = beta(rng, mean, spread, 12)
    return np.where(rng.random(12) < np.sqrt(alike), of_network, own)


def cities(
    runs: int, scenarios: Sequence[Sequence[float]] = CITIES
) -> Iterator[dict[str, object]]:
    """Means over cities, and survival, with unequal numbers of pairs."""
    yield from _cities(runs, scenarios, (1, 2, 4, 8, 12), (0.0,))


def networks(
    runs: int, scenarios: Sequence[Sequence[float]] = CITIES
) -> Iterator[dict[str, object]]:
    """The same for twelve cities on four road networks."""
    yield from _cities(runs, scenarios, (12,), ALIKE)


def _cities(
    runs: int,
    scenarios: Sequence[Sequence[float]],
    numbers: Sequence[int],
    correlations: Sequence[float],
) -> Iterator[dict[str, object]]:
    for mean, correlation in scenarios:
        for number, alike in itertools.product(numbers, correlations):
            rng = np.random.default_rng(number)
            count, kept = Count(mean), Count(1.0 - mean)
            for _ in range(runs):
                if alike:
                    results = on_networks(rng, mean, correlation, alike)
                else:
                    results = beta(rng, mean, correlation, number)
                rows = [
                    city_row(k, pair, float(value))
                    for k, value in enumerate(results)
                    for pair in range(int(rng.integers(1, 4)))
                ]
                (ranked,) = rank_methods(rows)
                if len(rows) > 1:
                    count.add(ranked.interval)
                (one,) = judge_survival(rows)
                kept.add(one.interval, one.verdict == "survives")
            spread = np.sqrt(mean * (1.0 - mean) * correlation)
            scenario = f"mean {mean:g}, deviation {spread:.2f}"
            if alike:
                scenario += f", four networks alike by {alike:g}"
            for name, some, has_size in (
                ("mean over cities", count, False),
                ("loss, and survival", kept, mean <= 0.9),
            ):
                yield {
                    "part": "networks" if alike else "cities",
                    "units": number,
                    "conditions": "",
                    "scenario": scenario,
                    "quantity": name,
                    **some.columns(has_size),
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
    "networks": networks,
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
