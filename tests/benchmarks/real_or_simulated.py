"""Can a classifier tell real scans from simulated ones?

    python tests/benchmarks/real_or_simulated.py REAL SIMULATED
        [--draws N] [--json]

Each of both is a folder of a drive that `cns-eval` reads (KITTI, recordings and
others), a folder of scans (`.bin`, float32 x y z intensity), or a folder of
such folders. `evaluation.real.judge` says how they are told apart; the features
that are printed are those of the first draw. Needs the extra `judge`.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from sklearn.metrics import roc_auc_score

from cns_drake.base import InputError
from cns_drake.drives import Drive
from evaluation.drives import open_drive
from evaluation.real import (
    Features,
    common_names,
    judge_draws,
    places_of,
    scan_table,
)


def read_places(path: Path) -> list[list[np.ndarray]]:
    """Returns the scans of each place in a data set."""
    drives: list[Drive] = []
    return _places_without_poses(path, drives) + places_of(drives)


def _places_without_poses(
    path: Path, drives: list[Drive]
) -> list[list[np.ndarray]]:
    """Returns a place for each folder of scans, and opens all drives."""
    if not path.is_dir():
        raise InputError(f"{path}: no folder of scans")
    files = sorted(path.glob("*.bin"))
    if files:
        raws = (np.fromfile(file, np.float32).reshape(-1, 4) for file in files)
        return [[scan_table(raw) for raw in raws]]
    try:
        drives.append(open_drive(path))
    except InputError:
        folders = sorted(one for one in path.iterdir() if one.is_dir())
        if not folders:
            raise
        return [
            place
            for one in folders
            for place in _places_without_poses(one, drives)
        ]
    return []


def strongest(
    real: Features, simulated: Features, names: list[str]
) -> list[dict]:
    """Returns each feature's own AUC and both medians, the strongest first."""
    table = []
    for name in names:
        a, b = (one.of([name])[:, 0] for one in (real, simulated))
        a, b = a[np.isfinite(a)], b[np.isfinite(b)]
        y = np.repeat([1, 0], [len(a), len(b)])
        auc = roc_auc_score(y, np.concatenate([a, b]))
        table.append(
            {
                "feature": name,
                "auc": float(max(auc, 1.0 - auc)),
                "real": float(np.median(a)),
                "simulated": float(np.median(b)),
            }
        )
    return sorted(table, key=lambda row: -row["auc"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("real", type=Path)
    parser.add_argument("simulated", type=Path)
    parser.add_argument("--draws", type=int, default=4)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if arguments.draws < 1:
        parser.error(f"--draws: {arguments.draws} is not positive")
    try:
        sets = read_places(arguments.real), read_places(arguments.simulated)
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
    result = judge_draws(*sets, arguments.draws)
    first = Features.of_places(sets[0]), Features.of_places(sets[1])
    result["features"] = strongest(*first, common_names([*first]))
    if arguments.json:
        print(json.dumps(result, indent=1))
        return
    print("patches: {} and {}".format(*result["patches"]))
    print("AUC | real or simulated | simulated or simulated")
    for group, auc in result["auc"].items():
        print(f"{group} | {auc:.3f} | {result['control'][group]:.3f}")
    print("feature | AUC | real | simulated")
    for row in result["features"][:20]:
        print(
            "{feature} | {auc:.2f} | {real:.4g} | {simulated:.4g}".format(**row)
        )


if __name__ == "__main__":
    main()
