"""Writes which methods survive by road networks: `network_survival.csv`.

    python tests/benchmarks/network_verdicts.py [--runs N]

Right and wrong answers with and without the change, of all cities that were
measured, in a logistic model: the change is a fixed effect, and networks,
cities, and how the change differs between networks and between cities are
random effects. The loss is the share of the places found without the change
that is not found with it, on a network drawn at random; nothing is cut at 0.

The tables have no single answers, but AUC strict, and numbers of queries with a
match: their product, rounded, counts as right. With verification, this is the
number of right answers of BTC and of layered overlap; of the other methods, it
is less, since AUC strict also asks for an order of the scores. Which queries
changed is not in the tables, so pairs of answers count as independent.

An interval is that of the jackknife over networks, with Student's t. Networks
where a query sees less than `LEAST_CHANGE` more change than in the control show
nothing, and neither do those where a method finds no place without the change.

The same verdicts are then given N times on made-up answers, with the effects
that were fitted, and with such a change that the loss is a tenth. Needs the
extra `benchmark`; with 40 runs, it takes half an hour on one core.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable, Iterator
import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit
from scipy.stats import t

from evaluation.recognition import Interval
from evaluation.results import Survival

ROOT = Path(__file__).resolve().parents[2]
TABLES = (
    "evaluation/results/baselines/stages.csv",
    "evaluation/results/baselines/fresh.csv",
    "docs/notes/new_plans.csv",
)
COLUMNS = (
    "part", "pairs", "verified", "method", "network", "networks", "cities",
    "queries", "loss", "low", "high", "verdict", "networks_over_a_tenth",
    "runs", "coverage", "survives", "does_not_survive",
)  # fmt: skip
LEAST_CHANGE = 0.01
# Loss with which both verdicts are wrong.
A_TENTH = 0.1
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()


class Counts(NamedTuple):
    """Right answers of one method to each pair of drives.

    Attributes:
        networks, cities: names (n,) of the pairs' road networks and cities.
        queries: numbers (n,) of queries with a match.
        right: numbers (n, 2) of right answers without and with the change.
    """

    networks: np.ndarray
    cities: np.ndarray
    queries: np.ndarray
    right: np.ndarray

    def where(self, kept: np.ndarray) -> Counts:
        return Counts(*(column[kept] for column in self))

    def losses(self) -> dict[str, float]:
        """Returns the share of its places that each network loses."""
        return {
            str(name): float(1.0 - after / before)
            for name in np.unique(self.networks)
            for before, after in [self.right[self.networks == name].sum(axis=0)]
        }

    def that_show(self) -> Counts:
        """Returns the networks where something is found without change."""
        found = self.right[:, 0] > 0
        return self.where(np.isin(self.networks, self.networks[found]))


class Effects(NamedTuple):
    """Effects on the log odds of a right answer.

    Attributes:
        fixed: (2,) of no change, and of the change.
        variances: (4,) of networks, cities, and of the change on both.
    """

    fixed: np.ndarray
    variances: np.ndarray

    def loss(self) -> float:
        """Returns the share of its places that a method loses on average."""
        before = share(self.fixed[0], self.variances[:2].sum())
        after = share(self.fixed.sum(), self.variances.sum())
        return 1.0 - after / before

    def of_loss(self, loss: float) -> Effects:
        """Returns the same with such a change that the loss is this one."""

        def excess(change: float) -> float:
            fixed = np.array([self.fixed[0], change])
            return Effects(fixed, self.variances).loss() - loss

        fixed = np.array([self.fixed[0], brentq(excess, -30.0, 30.0)])
        return Effects(fixed, self.variances)

    def made_up(self, like: Counts, rng: np.random.Generator) -> Counts:
        """Returns made-up answers on the same networks."""
        odds = np.tile(np.cumsum(self.fixed), (len(like.queries), 1))
        deviations = np.sqrt(self.variances)
        for k, groups in enumerate((like.networks, like.cities) * 2):
            names, index = np.unique(groups, return_inverse=True)
            drawn = deviations[k] * rng.normal(size=len(names))
            odds[:, k // 2 :] += drawn[index, None]
        right = rng.binomial(like.queries[:, None], expit(odds))
        return like._replace(right=right)


def share(mean: float, variance: float) -> float:
    """Returns the mean of a share whose log odds are normally distributed."""
    return float(expit(mean + np.sqrt(variance) * _NODES) @ _WEIGHTS)


def fitted(counts: Counts) -> Effects:
    """Returns effects of the greatest likelihood (Laplace's approximation)."""
    # Imported here: it is in the extra `benchmark` alone.
    from gpboost import GPModel

    number = len(counts.queries)
    change = np.tile([0.0, 1.0], number)
    queries = np.repeat(counts.queries, 2).astype(float)
    groups = np.column_stack([counts.networks, counts.cities])
    model = GPModel(
        likelihood="binomial_logit",
        group_data=np.repeat(groups, 2, axis=0),
        group_rand_coef_data=np.column_stack([change, change]),
        ind_effect_group_rand_coef=[1, 2],
        weights=queries,
        num_parallel_threads=1,
    )
    model.fit(
        y=counts.right.ravel() / queries,
        X=np.column_stack([np.ones(2 * number), change]),
    )
    fixed = model.get_coef(format_pandas=False)
    variances = model.get_cov_pars(format_pandas=False)
    return Effects(np.ravel(fixed)[:2], np.ravel(variances)[:4])


def judged(method: str, counts: Counts) -> tuple[Survival, Effects]:
    """Returns the verdict by networks, and the effects that were fitted."""
    effects = fitted(counts)
    kept = np.log1p(-effects.loss())
    without = [
        np.log1p(-fitted(counts.where(counts.networks != name)).loss())
        for name in np.unique(counts.networks)
    ]
    low, high = jackknife(kept, np.array(without))
    interval = Interval(float(-np.expm1(high)), float(-np.expm1(low)))
    loss = effects.loss()
    return Survival(method, loss, interval, counts.losses()), effects


def jackknife(whole: float, without: np.ndarray) -> tuple[float, float]:
    """Returns the 95 % interval of a result from those without one unit."""
    number = len(without)
    variance = (number - 1) / number * np.sum(np.square(without - whole))
    half = t.ppf(0.975, number - 1) * np.sqrt(variance)
    return whole - half, whole + half


def table_rows() -> Iterator[dict[str, str]]:
    """Yields the rows of all tables, with the names of network and city."""
    for path in TABLES:
        with (ROOT / path).open(newline="", encoding="utf-8") as stream:
            for row in csv.DictReader(stream):
                redraw = row.get("both.city.redraw.frozen", "")
                yield {**row, "city": f"{row['map']} {redraw}"}


def read_counts(rows: Iterable[dict[str, str]]) -> dict[tuple, Counts]:
    """Returns the counts of each verification, method, and choice of pairs.

    Networks that show no change are left out.
    """
    shares: dict[tuple, dict[tuple, dict[str, float]]] = defaultdict(
        lambda: defaultdict(dict)
    )
    matches: dict[tuple, int] = {}
    seen: dict[str, dict[str, float]] = defaultdict(dict)
    for row in rows:
        pair = row["map"], row["city"], row["database"], row["query"]
        stage = row["both.stage"]
        if row["metric"] == "visible_change":
            seen[row["map"]][stage] = float(row["value"])
        elif row["metric"] == "pose_success":
            matches[pair] = int(row["n"])
        elif row["metric"] == "auc_strict":
            key = row["verified"], row["method"]
            shares[key][pair][stage] = float(row["value"])
            # Where poses were not measured, each query has a match.
            matches.setdefault(pair, int(row["n"]))
    unseen = {
        name
        for name, of_stage in seen.items()
        if of_stage["own"] - of_stage.get("last", 0.0) < LEAST_CHANGE
    }
    found = {}
    for (verified, method), of_pairs in shares.items():
        for choice in ("first", "all"):
            lines = [
                (
                    *pair[:2],
                    matches[pair],
                    [matches[pair] * of_stage[one] for one in ("last", "own")],
                )
                for pair, of_stage in of_pairs.items()
                if pair[0] not in unseen
                and (choice == "all" or pair[2].endswith("_01"))
            ]
            columns = map(np.array, zip(*lines, strict=True))
            counts = Counts(*columns)
            right = np.rint(counts.right).astype(int)
            found[choice, verified, method] = counts._replace(right=right)
    return found


def lines(runs: int) -> Iterator[dict[str, object]]:
    """Yields the verdicts, and how often made-up ones are right."""
    for (choice, verified, method), some in read_counts(table_rows()).items():
        if len(np.unique(some.networks)) < 8:
            continue
        counts = some.that_show()
        survival, effects = judged(method, counts)
        yield {
            "part": "found",
            "pairs": choice,
            "verified": verified,
            "method": method,
            **_numbers(counts),
            "loss": f"{survival.loss:.3f}",
            "low": f"{survival.interval.low:.3f}",
            "high": f"{survival.interval.high:.3f}",
            "verdict": survival.verdict,
            "networks_over_a_tenth": sum(
                loss > A_TENTH for loss in survival.of_cities.values()
            ),
        }
        if choice == "first":
            for name, loss in survival.of_cities.items():
                yield {
                    "part": "network",
                    "pairs": choice,
                    "verified": verified,
                    "method": method,
                    "network": name,
                    "loss": f"{loss:.3f}",
                }
        if runs and choice == "first" and verified == "1":
            for true in (effects, effects.of_loss(A_TENTH)):
                yield {
                    "part": "simulated",
                    "pairs": choice,
                    "verified": verified,
                    "method": method,
                    **_numbers(counts),
                    **simulated(true, counts, runs),
                }


def simulated(true: Effects, like: Counts, runs: int) -> dict[str, object]:
    """Returns how often verdicts on made-up answers hold the true loss."""
    rng = np.random.default_rng(1)
    verdicts, hits = [], 0
    for _ in range(runs):
        one, _ = judged("made up", true.made_up(like, rng).that_show())
        verdicts.append(one.verdict)
        hits += one.interval.low <= true.loss() <= one.interval.high
    return {
        "loss": f"{true.loss():.3f}",
        "runs": runs,
        "coverage": f"{hits / runs:.3f}",
        "survives": f"{verdicts.count('survives') / runs:.3f}",
        "does_not_survive": f"{verdicts.count('does not survive') / runs:.3f}",
    }


def _numbers(counts: Counts) -> dict[str, object]:
    return {
        "networks": len(np.unique(counts.networks)),
        "cities": len(np.unique(counts.cities)),
        "queries": int(counts.queries.sum()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=40)
    arguments = parser.parse_args()
    path = ROOT / "docs/notes/network_survival.csv"
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        table.writeheader()
        for line in lines(arguments.runs):
            table.writerow(line)
            stream.flush()


if __name__ == "__main__":
    main()
