"""How long a block of street must be, so that intervals are worth 95 %.

    python tests/benchmarks/street_blocks.py QUERIES.csv

prints how the answers to two queries are correlated over their distance, in the
`queries.csv` of an experiment, and which share of the intervals of R@1 contains
the true value, for answers as correlated along shipped routes.
"""

import collections
import csv
from pathlib import Path
import sys

import numpy as np
from scipy.stats import norm

from cns_drake import load_scenario
from cns_drake.scenarios import DrivePlan
from cns_drake.simulation import load_drive
from evaluation.recognition import jackknife_interval, route_blocks

_DISTANCES = (0.0, 15.0, 30.0, 50.0, 70.0, 100.0, 140.0)
_LENGTHS = (50.0, 70.0, 80.0, 100.0)
_DRIVES = ("metropolis_04", "suburbia_02", "downtown_04")
# Correlation of the normal variables behind the answers: 0.65 exp(-d / 45 m).
# For answers of which half are right, it gives .38, .27, .17 and .11 at 7, 22,
# 40 and 60 m, by the arcsine law.
_CLOSE = 0.65
_SCALE = 45.0
_RUNS = 1000


def main() -> None:
    """Prints both tables."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    _print_correlations(Path(sys.argv[1]))
    for name in _DRIVES:
        _print_coverage(name)


def _print_correlations(path: Path) -> None:
    """Prints the mean correlation of two answers, by their distance."""
    groups = collections.defaultdict(list)
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["task"] == "place" and row["has_match"] == "1":
                names = "database", "query", "both.stage", "method", "verified"
                key = tuple(row.get(name) for name in names)
                groups[key].append(
                    [
                        float(row[name])
                        for name in ("query_x", "query_y", "correct")
                    ]
                )
    found = collections.defaultdict(list)
    for rows in groups.values():
        *p_WQ, right = np.transpose(rows)
        if not 0.1 < right.mean() < 0.9:
            continue
        z = (right - right.mean()) / right.std()
        first, second = np.triu_indices(len(z), 1)
        distance = np.hypot(*(p[first] - p[second] for p in p_WQ))
        product = z[first] * z[second]
        bins = np.digitize(distance, _DISTANCES)
        for k in range(1, len(_DISTANCES)):
            if (bins == k).any():
                found[k].append(product[bins == k].mean())
    for k in sorted(found):
        ends = _DISTANCES[k - 1 : k + 1]
        print("{:g} to {:g} m".format(*ends), f"{np.mean(found[k]):.3f}")


def _print_coverage(name: str) -> None:
    """Prints the share of intervals that contain the true R@1."""
    drive = load_drive(DrivePlan(load_scenario(name)))
    p_WB = np.array(
        [
            drive.trajectory.pose(0.05 * frame).translation()
            for frame in range(drive.num_frames)
        ]
    )
    steps = np.linalg.norm(np.diff(p_WB, axis=0), axis=1)
    path = np.append(0.0, np.cumsum(steps))
    frames = np.searchsorted(path, np.arange(0.0, path[-1], 10.0))
    apart = np.linalg.norm(p_WB[frames, None] - p_WB[frames], axis=2)
    covariance = _CLOSE * np.exp(-apart / _SCALE)
    np.fill_diagonal(covariance, 1.0)
    factor = np.linalg.cholesky(covariance)
    for share in (0.5, 0.8, 0.95):
        rng = np.random.default_rng(0)
        normal = factor @ rng.normal(size=(len(frames), _RUNS))
        answers = (normal < norm.ppf(share)).astype(float)
        for length in _LENGTHS:
            blocks = route_blocks(p_WB, frames, length)
            number, covered = _covered(blocks, answers, share)
            print(f"{name} R@1 {share} {length:g} m: {number} blocks", covered)


def _covered(
    blocks: np.ndarray, answers: np.ndarray, share: float
) -> tuple[int, str]:
    """Returns the number of blocks, and the share of intervals in words."""
    _, block = np.unique(blocks, return_inverse=True)
    weights = np.bincount(block).astype(float)
    hits = []
    for right in answers.T:
        others = len(right) - weights
        without = (right.sum() - np.bincount(block, right)) / others
        interval = jackknife_interval(
            right.mean(), without, weights, (0.0, 1.0)
        )
        if np.isfinite(interval.low):
            hits.append(interval.low <= share <= interval.high)
    return len(weights), f"{np.mean(hits):.3f}" if hits else "no interval"


if __name__ == "__main__":
    main()
