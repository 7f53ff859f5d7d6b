"""Agreement of the rankings of methods on two sets of drives.

The measure is Kendall's tau-b (Kendall, Biometrika 33, 1945): 1 if every two
methods have the same order on both sets, -1 if the opposite one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
import warnings

import numpy as np
from scipy.stats import kendalltau

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.json_text import json_number
from evaluation.recognition.pr_curve import pr_curve
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.resampling import (
    Interval,
    percentile_interval,
    resampled_metrics,
    resampled_weights,
)

_NEEDED = ("map", "db", "query", "method", "correct", "has_match", "score")
# Columns of a table of queries that name the pair of drives.
_KEYS = ("map", "db", "query", "cause", "level", "seed", "gate")

# Pair of drives -> method -> outcomes of its queries.
Answers = Mapping[tuple[str, ...], Mapping[str, QueryOutcomes]]


@dataclass(frozen=True)
class RankAgreement:
    """The agreement of two rankings of methods.

    Attributes:
        methods: names of the M methods that ran on all pairs of both sets.
        first: (M,) mean AUC over the pairs of the first set.
        second: (M,) of the second set.
        tau: Kendall's tau-b; NaN if all values of a set are equal.
        interval: 95 % interval by bootstrap over the queries of each pair; a
            sample has the same queries for every method.
    """

    methods: tuple[str, ...]
    first: np.ndarray
    second: np.ndarray
    tau: float
    interval: Interval

    def to_json(self) -> dict:
        """Returns all numbers; NaN becomes None."""
        low, high = self.interval.low, self.interval.high
        return {
            "kendall_tau": json_number(self.tau),
            "interval_95": [json_number(low), json_number(high)],
            "methods": {
                method: {"first": float(one), "second": float(other)}
                for method, one, other in zip(
                    self.methods, self.first, self.second, strict=True
                )
            },
        }


def rank_agreement(first: Path, second: Path, seed: int = 0) -> RankAgreement:
    """Compares the ranking of methods in two reports.

    Args:
        first: `queries.csv` of a report or of a ladder, or its folder.
        second: another one.
        seed: of the bootstrap.

    Raises:
        InputError: a file cannot be read, or the two share fewer than two
            methods.
    """
    answers = [read_answers(path) for path in (first, second)]
    per_pair = [set(pair) for one in answers for pair in one.values()]
    methods = tuple(sorted(set.intersection(*per_pair)))
    if len(methods) < 2:
        raise InputError(
            f"{first}, {second}: fewer than two methods answered on all pairs"
            f" of both ({', '.join(methods) or 'none'})"
        )
    # The draws of one pair do not depend on those of other pairs.
    rng = np.random.default_rng(seed)
    one, one_samples = _areas(answers[0], methods, rng)
    other, other_samples = _areas(answers[1], methods, rng)
    taus = [
        _tau(*pair) for pair in zip(one_samples, other_samples, strict=True)
    ]
    return RankAgreement(
        methods=methods,
        first=one,
        second=other,
        tau=_tau(one, other),
        interval=percentile_interval(np.array(taus)),
    )


def read_answers(path: Path) -> Answers:
    """Returns the outcome of each query, by pair of drives and method.

    Args:
        path: `queries.csv`, or the folder that holds it.

    Raises:
        InputError: it cannot be read, has no query, or has an invalid value.
    """
    file = path / "queries.csv" if path.is_dir() else path
    groups: dict[tuple[str, ...], dict[str, list[tuple[float, ...]]]] = {}
    for line, row in read_records(file, _NEEDED):
        try:
            score = float(row["score"] or "nan")
            values = score, _flag(row["correct"]), _flag(row["has_match"])
        except ValueError:
            raise InputError(
                f"{file}: line {line}: correct, has_match, score: not 0 or 1,"
                " 0 or 1, and a number"
            ) from None
        pair = tuple(row[key] for key in _KEYS if key in row)
        group = groups.setdefault(pair, {})
        group.setdefault(row["method"], []).append(values)
    if not groups:
        raise InputError(f"{file}: no query")
    return {
        pair: {method: _outcomes(rows) for method, rows in group.items()}
        for pair, group in groups.items()
    }


def _flag(cell: str) -> int:
    return ("0", "1").index(cell)


def _outcomes(rows: list[tuple[float, ...]]) -> QueryOutcomes:
    scores, right, match = np.array(rows).T
    is_right = right == 1.0
    # Only the first rank matters here.
    ranks = np.where(is_right, 1.0, np.inf)
    return QueryOutcomes(scores, is_right, match == 1.0, ranks, 0)


def _areas(
    answers: Answers, methods: tuple[str, ...], rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean AUC (M,), and that of samples of the queries (B, M)."""
    means, samples = [], []
    for pair in answers.values():
        number = len(pair[methods[0]])
        if any(len(pair[method]) != number for method in methods):
            raise InputError("methods of one pair have different queries")
        seed = int(rng.integers(1 << 31))
        weights = resampled_weights(number, seed)
        means.append([pr_curve(pair[method]).auc for method in methods])
        samples.append(
            [resampled_metrics(pair[method], weights)[0] for method in methods]
        )
    return np.mean(means, axis=0), np.mean(samples, axis=0).T


def _tau(first: np.ndarray, second: np.ndarray) -> float:
    with warnings.catch_warnings():
        # SciPy warns if all values are equal; the result is then NaN.
        warnings.simplefilter("ignore")
        return float(kendalltau(first, second).statistic)
