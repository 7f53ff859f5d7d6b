"""Agreement of the rankings of methods on two sets of drives.

The measure is Kendall's tau-b (Kendall, Biometrika 33, 1945): 1 if every two
methods have the same order on both sets, -1 if the opposite one.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
import warnings

import numpy as np
from scipy.stats import kendalltau

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.json_text import json_number
from evaluation.recognition.metrics import (
    Interval,
    percentile_interval,
    pr_curve,
    resampled_metrics,
    resampled_weights,
    route_blocks,
)
from evaluation.recognition.protocol import PROTOCOL_NAMES
from evaluation.recognition.query_outcomes import QueryOutcomes

_NEEDED = ("map", "db", "query", "method", "correct", "has_match", "score")
# Columns of a table of queries that name the pair of drives.
_POSITION = ("query_x", "query_y", "query_z")
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
        first_intervals, second_intervals: 95 % interval of each mean, by
            bootstrap over blocks of the route of each pair; a sample has the
            same blocks for every method.
        tau: Kendall's tau-b; NaN if all values of a set are equal.
        interval: its 95 % interval, from the same samples.
    """

    methods: tuple[str, ...]
    first: np.ndarray
    second: np.ndarray
    first_intervals: tuple[Interval, ...]
    second_intervals: tuple[Interval, ...]
    tau: float
    interval: Interval

    def to_json(self) -> dict:
        """Returns all numbers; NaN becomes None."""
        return {
            "kendall_tau": json_number(self.tau),
            "interval_95": self.interval.to_json(),
            "methods": {
                method: {
                    "first": float(self.first[k]),
                    "second": float(self.second[k]),
                    "first_interval_95": self.first_intervals[k].to_json(),
                    "second_interval_95": self.second_intervals[k].to_json(),
                }
                for k, method in enumerate(self.methods)
            },
        }


def rank_agreement(
    first: Path, second: Path, seed: int = 0, protocol: str | None = None
) -> RankAgreement:
    """Compares the ranking of methods in two reports.

    Args:
        first: `queries.csv` of a report or of a ladder, or its folder.
        second: another one.
        seed: of the bootstrap.
        protocol: see `read_answers`.

    Raises:
        InputError: a file cannot be read, or the two share fewer than two
            methods.
    """
    answers = [read_answers(path, protocol) for path in (first, second)]
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
        first_intervals=tuple(
            map(percentile_interval, np.transpose(one_samples))
        ),
        second_intervals=tuple(
            map(percentile_interval, np.transpose(other_samples))
        ),
        tau=_tau(one, other),
        interval=percentile_interval(np.array(taus)),
    )


def read_answers(path: Path, protocol: str | None = None) -> Answers:
    """Returns the outcome of each query, by pair of drives and method.

    Args:
        path: `queries.csv`, or the folder that holds it.
        protocol: name of the protocol whose rows count; by default `fair` if
            there are any, else the only one. Rows without one always count.

    Raises:
        InputError: it cannot be read, has no query by that protocol, or has an
            invalid value.
    """
    file = path / "queries.csv" if path.is_dir() else path
    rows = list(read_records(file, _NEEDED))
    protocol = _chosen_protocol(file, rows, protocol)
    groups: dict[tuple[str, ...], dict[str, list[tuple[float, ...]]]] = {}
    for line, row in rows:
        if row.get("protocol", protocol) != protocol:
            continue
        try:
            score = float(row["score"] or "nan")
            position = [float(row.get(one, "nan")) for one in _POSITION]
            if np.isinf([score, *position]).any():
                raise ValueError
            values = (
                score,
                _flag(row["correct"]),
                _flag(row["has_match"]),
                *position,
            )
        except ValueError:
            raise InputError(
                f"{file}: line {line}: correct, has_match, score, place: not 0"
                " or 1, 0 or 1, and numbers that are finite"
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


def _chosen_protocol(
    file: Path,
    rows: Iterable[tuple[int, Mapping[str, str]]],
    wanted: str | None,
) -> str | None:
    """Returns the protocol whose rows count; None if rows have no protocol."""
    names = ", ".join(PROTOCOL_NAMES)
    if wanted is not None and wanted not in PROTOCOL_NAMES:
        raise InputError(
            f"--protocol: {wanted!r} is unknown (there are: {names})"
        )
    lines: dict[str, int] = {}
    for line, row in rows:
        if "protocol" in row:
            lines.setdefault(row["protocol"], line)
    for name, line in lines.items():
        if name not in PROTOCOL_NAMES:
            raise InputError(
                f"{file}: line {line}: protocol: {name!r} is unknown (there"
                f" are: {names})"
            )
    known = " and ".join(lines)
    if lines and wanted is not None and wanted not in lines:
        raise InputError(f"{file}: no query by protocol {wanted} (but {known})")
    if wanted is None and "fair" in lines:
        return "fair"
    if wanted is None and len(lines) > 1:
        raise InputError(
            f"{file}: protocol: {known} in one table; choose one with"
            " --protocol"
        )
    return wanted or next(iter(lines), None)


def _flag(cell: str) -> int:
    return ("0", "1").index(cell)


def _outcomes(rows: list[tuple[float, ...]]) -> QueryOutcomes:
    scores, right, match, *position = np.array(rows).T
    is_right = right == 1.0
    # Only the first rank matters here.
    ranks = np.where(is_right, 1.0, np.inf)
    blocks = None
    if not np.isnan(position).any():
        blocks = route_blocks(np.transpose(position), np.arange(len(rows)))
    return QueryOutcomes(scores, is_right, match == 1.0, ranks, 0, blocks)


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
        weights = resampled_weights(number, seed, pair[methods[0]].blocks)
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
