"""The numbers of a ladder: each method under each cause of change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base.jobs.fingerprint import fingerprint
from evaluation.recognition.pr_curve import pr_curve
from evaluation.recognition.resampling import (
    Interval,
    percentile_interval,
    resampled_metrics,
    resampled_weights,
)
from evaluation.recognition.rung_outcome import FAULTS, RungOutcome
from evaluation.recognition.survival import Kept


@dataclass(frozen=True)
class LadderRung:
    """The change between two drives.

    Attributes:
        map_name: of the city.
        database: name of the drive along the database's route.
        query: name of the query drive.
        cause: of the change; `none` without one.
        level: its strength, from 1 to 4; 0 without a change.
        strength: in words.
        radius: of a match [m].
    """

    map_name: str
    database: str
    query: str
    cause: str
    level: int
    strength: str
    radius: float


@dataclass(frozen=True)
class MeasuredRung:
    """The outcomes of all methods on a rung, with one random draw.

    Attributes:
        rung: which.
        seed: of the draw.
        drives: fingerprint of the drives.
        outcomes: of each method, without and
            with the gate.
    """

    rung: LadderRung
    seed: int
    drives: str
    outcomes: Sequence[RungOutcome]


@dataclass(frozen=True)
class LadderRow:
    """A method on a rung: means over the draws.

    Attributes:
        rung: which.
        method: its name.
        is_gated: whether it was gated by the radius.
        auc_interval: 95 % interval of AUC by bootstrap over queries; a sample
            has the same queries in each draw.
        r1: R@1.
        kept: share of the AUC on the rung `none` of the same map.
        queries: number of queries in each draw.
        with_match: number of those with a match.
        places: number of places of the database.
        draws: number of random draws.
        drives: fingerprints of the drives of all draws.
        lost: mean number of queries that are right on the rung `none` and wrong
            here.
        found: mean number of queries that are wrong there and right here.
        hidden: see `RungOutcome.num_hidden`; mean.
        overlap: mean over queries, see `RungOutcome.overlaps`.
        faults: fault -> mean number of queries with it. See
            `RungOutcome.faults`.
    """

    rung: LadderRung
    method: str
    is_gated: bool
    auc_interval: Interval
    r1: float
    kept: Kept
    queries: int
    with_match: int
    places: int
    draws: int
    drives: str
    lost: float
    found: float
    hidden: float
    overlap: float
    faults: Mapping[str, float]

    @property
    def auc(self) -> float:
        return self.kept.changed


def ladder_rows(measured: Iterable[MeasuredRung]) -> list[LadderRow]:
    """Returns a row for each rung, method and gate.

    Args:
        measured: of all maps; the rung `none` of a map comes first.
    """
    groups: dict[tuple[LadderRung, str, bool], list[RungOutcome]] = {}
    drives: dict[LadderRung, list[str]] = {}
    for one in measured:
        drives.setdefault(one.rung, []).append(one.drives)
        for outcome in one.outcomes:
            key = one.rung, outcome.method, outcome.is_gated
            groups.setdefault(key, []).append(outcome)
    plain: dict[tuple[str, str, bool], list[RungOutcome]] = {}
    rows = []
    for (rung, method, is_gated), draws in groups.items():
        unchanged = plain.setdefault((rung.map_name, method, is_gated), draws)
        drawn = fingerprint({"drives": drives[rung]})
        rows.append(_row(rung, drawn, unchanged, draws))
    return rows


def _row(
    rung: LadderRung,
    drives: str,
    unchanged: Sequence[RungOutcome],
    draws: Sequence[RungOutcome],
) -> LadderRow:
    first = draws[0]
    num_queries = len(first.outcomes)
    weights = resampled_weights(num_queries)
    samples = _sampled_auc(draws, weights)
    share = Interval(math.nan, math.nan)
    lost = found = math.nan
    if len(unchanged[0].outcomes) == num_queries:
        before = _sampled_auc(unchanged, weights)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = percentile_interval(
                np.where(before > 0.0, samples / before, math.nan)
            )
        right = unchanged[0].outcomes.is_right
        lost, found = (
            _mean([float((a & ~b).sum()) for a, b in pairs])
            for pairs in (
                [(right, one.outcomes.is_right) for one in draws],
                [(one.outcomes.is_right, right) for one in draws],
            )
        )
    faults = [fault for one in draws for fault in one.faults(rung.radius)]
    return LadderRow(
        rung=rung,
        method=first.method,
        is_gated=first.is_gated,
        auc_interval=percentile_interval(samples),
        r1=_mean([one.outcomes.recall_at(1) for one in draws]),
        kept=Kept(_auc(unchanged), _auc(draws), share),
        queries=num_queries,
        with_match=int(first.outcomes.has_match.sum()),
        places=first.outcomes.num_places,
        draws=len(draws),
        drives=drives,
        lost=lost,
        found=found,
        hidden=_mean([one.num_hidden for one in draws]),
        overlap=_mean_known(np.concatenate([one.overlaps for one in draws])),
        faults={name: faults.count(name) / len(draws) for name in FAULTS},
    )


def _auc(draws: Sequence[RungOutcome]) -> float:
    return _mean([pr_curve(one.outcomes).auc for one in draws])


def _sampled_auc(
    draws: Sequence[RungOutcome], weights: np.ndarray
) -> np.ndarray:
    """Returns the mean AUC over draws, of samples of the queries."""
    return np.mean(
        [resampled_metrics(one.outcomes, weights)[0] for one in draws], axis=0
    )


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


def _mean_known(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else math.nan
