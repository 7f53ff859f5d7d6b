"""Can a classifier tell simulated scans of an HDL-64E from real ones?

    python tests/benchmarks/real_or_simulated.py KITTI
        [--drive NAME ...] [--roadsides VALUE ...] [--scans N] [--draws N]

KITTI is a drive of KITTI odometry, which `cns-eval` reads. For each value of
`roadsides`, N scans of each simulated drive are compared with it. Of each scan,
sixteen patches of 8 m within 30 m are described by features of their points.
Boosted trees then tell the patches of both sets apart, cross-validated by place
(the scans within 30 m of one of them). An AUC of 1 means that they always can,
0.5 that they guess, as they should between two halves of the simulated places.
All values are means over random draws of patches. Needs scikit-learn.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

from class_shares import judged
import numpy as np
from scipy.spatial import cKDTree
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.model_selection import GroupKFold, cross_val_score
from threadpoolctl import threadpool_limits

from cns_drake.scenarios import RideConfig
from cns_drake.simulation import SimulatedDrive
from evaluation import open_drive
from evaluation.drives import Drive

DRIVES = ("riverside_02", "metropolis_04", "suburbia_02")
# Of a revolution of KITTI's LiDAR, by its manual.
_COLUMNS = 2156
# As of the road of KITTI's first place.
_CROSSFALL = 0.03
_VEHICLES = 60
# Scans closer to each other than this are from one place [m].
_ONE_PLACE = 30.0
# Number of patches of a scan; half their side, and the ranges of their middles
# [m].
_PATCHES = 16
_HALF_WIDTH = 4.0
_RANGES = (5.0, 30.0)
_FEWEST_POINTS = 150
# Radius of a neighbourhood [m], its fewest points, and how many a patch has.
_RADIUS = 0.75
_FEWEST_NEIGHBOURS = 8
_NEIGHBOURHOODS = 160
_QUANTILES = (0.1, 0.5, 0.9)
# A feature that fewer patches of a set have is left out.
_LEAST_SHARE = 0.1
_FOLDS = 3
_GROUPS = {
    "all": ("",),
    "intensity": ("intensity",),
    "all but intensity": ("density", "roughness", "shape", "height"),
    "density": ("density",),
    "roughness": ("roughness",),
    "shape": ("shape",),
    "height": ("height",),
}


def simulated(name: str, roadsides: float) -> SimulatedDrive:
    """Returns a drive as KITTI would record it, without motion distortion."""
    scenario = judged(name, roadsides, _COLUMNS).with_traffic(_VEHICLES)
    ride = RideConfig(roughness="A", crossfall=_CROSSFALL)
    return SimulatedDrive(scenario.replaced(ride=ride))


def some_scans(drive: Drive, number: int) -> Iterator[tuple[np.ndarray, int]]:
    """Yields scans (N, 5), evenly over a drive, each with its place's number.

    The columns are x, y, z [m], the intensity from 0 to 99, and the ring.
    """
    number = min(number, len(drive))
    places: list[np.ndarray] = []
    for frame in np.linspace(0, len(drive) - 1, number).round().astype(int):
        p = drive.X_WS[frame, :3, 3]
        apart = [float(np.linalg.norm(p - one)) for one in places]
        if min(apart, default=np.inf) >= _ONE_PLACE:
            places.append(p)
            apart.append(0.0)
        scan = drive.scan(int(frame))
        bright = scan["intensity"].astype(float)
        bright *= 100.0 if bright.max() <= 1.0 else 1.0
        azimuth = np.arctan2(scan["y"], scan["x"]) % (2.0 * np.pi)
        # KITTI's files have one ring after the other.
        ring = np.cumsum(np.diff(azimuth, prepend=0.0) < -np.pi)
        if "ring" in (scan.dtype.names or ()):
            ring = scan["ring"]
        columns = [scan[axis].astype(float) for axis in "xyz"]
        columns += [np.minimum(np.rint(bright), 99.0), ring.astype(float)]
        yield np.stack(columns, axis=1), int(np.argmin(apart))


def patches(scan: np.ndarray, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Yields up to sixteen patches (M, 5) of a scan, at random positions."""
    ranges = np.linalg.norm(scan[:, :3], axis=1)
    near = np.flatnonzero((ranges > _RANGES[0]) & (ranges < _RANGES[1]))
    found = 0
    for row in rng.permutation(near)[: 4 * _PATCHES]:
        apart = np.abs(scan[:, :2] - scan[row, :2]).max(axis=1)
        patch = scan[apart < _HALF_WIDTH]
        if len(patch) >= _FEWEST_POINTS and found < _PATCHES:
            found += 1
            yield patch


def describe(patch: np.ndarray, rng: np.random.Generator) -> dict[str, float]:
    """Returns the features of a patch; a name begins with that of its group."""
    p, bright, ring = patch[:, :3], patch[:, 3], patch[:, 4]
    tree = cKDTree(p)
    distance, rows = tree.query(p, 16)
    ranges = np.linalg.norm(p, axis=1)
    height = p[:, 2] - np.quantile(p[:, 2], 0.05)
    spread = bright[rows[:, 1:7]].std(axis=1)
    found = {
        "intensity: spread among 6": np.median(spread),
        "intensity: values": len(np.unique(bright)),
        "intensity: zeros": np.mean(bright == 0.0),
        "intensity: mean": bright.mean(),
        "density: points": np.log(len(p)),
        "density: isolated": np.mean(distance[:, 4] > 0.02 * ranges),
        "height: 2 to 5 m": np.mean((height > 2.0) & (height < 5.0)),
        "height: below 0.3 m": np.mean(height < 0.3),
    }
    other = ring[rows] != ring[:, None]
    first = p[rows[np.arange(len(p)), other.argmax(axis=1)]]
    across = (np.linalg.norm(p - first, axis=1) / ranges)[other.any(axis=1)]
    series = {
        "intensity": bright,
        "density: neighbour": distance[:, 1] / ranges,
        "density: across rings": across,
        "height": height,
    }
    chosen = rng.choice(len(p), min(len(p), _NEIGHBOURHOODS), replace=False)
    groups = tree.query_ball_point(p[chosen], _RADIUS)
    shapes = np.array(
        [
            (*_shape(p[group], ring[group]), height[row])
            for row, group in zip(chosen, groups, strict=True)
            if len(group) >= _FEWEST_NEIGHBOURS
        ]
    ).reshape(-1, 7)
    linear, planar, scattered, up, within, between, low = shapes.T
    series |= {
        "shape: linear": linear,
        "shape: planar": planar,
        "shape: scattered": scattered,
    }
    flat = planar > 0.5
    ground = flat & (up > 0.95) & (low < 0.5)
    for kind, mask in (("ground", ground), ("walls", flat & (up < 0.2))):
        series[f"roughness: {kind}, within rings"] = within[mask]
        series[f"roughness: {kind}, between rings"] = between[mask]
    for name, values in series.items():
        known = values[np.isfinite(values)]
        for part in _QUANTILES if len(known) >= 5 else ():
            found[f"{name}, {part:.0%}"] = np.quantile(known, part)
    return {name: float(value) for name, value in found.items()}


def _shape(p: np.ndarray, ring: np.ndarray) -> tuple[float, ...]:
    """Returns shares of line, plane and scatter (Demantke et al. 2011), the
    normal's z, and residuals from the plane within and between rings [log mm].
    """
    spread = p - p.mean(axis=0)
    values, vectors = np.linalg.eigh(spread.T @ spread / len(p))
    c, b, a = np.sqrt(np.maximum(values, 1e-12))
    residual = spread @ vectors[:, 0]
    _, which, count = np.unique(ring, return_inverse=True, return_counts=True)
    mean = np.bincount(which, residual) / count
    within = between = np.nan
    if (count >= 3).sum() >= 3:
        between = mean[count >= 3].std()
        within = (residual - mean[which])[(count >= 3)[which]].std()
    shares = (a - b) / a, (b - c) / a, c / a
    logs = np.log(np.maximum(1e3 * np.array([within, between]), 1e-2))
    return *shares, abs(vectors[2, 0]), *logs


def tell_apart(sets: list[tuple[list[dict], np.ndarray]]) -> dict[str, float]:
    """Returns the AUC of a classifier between two sets, by group of features.

    Args:
        sets: features of the patches of each set, and (N,) their places.
    """
    every = [row for rows, _ in sets for row in rows]
    names = list(dict.fromkeys(name for row in every for name in row))
    x = np.array([[row.get(name, np.nan) for name in names] for row in every])
    y = np.repeat([1, 0], [len(rows) for rows, _ in sets])
    kept = [np.isfinite(x[y == k]).mean(axis=0) >= _LEAST_SHARE for k in (0, 1)]
    # Each fold has places of both sets.
    folds = [np.unique(places, return_inverse=True)[1] for _, places in sets]
    number = min(_FOLDS, *(fold.max() + 1 for fold in folds))
    fold = np.concatenate(folds) % number
    model = HistGradientBoostingClassifier(
        max_iter=120,
        min_samples_leaf=10,
        random_state=0,
        class_weight="balanced",
    )
    found = {}
    for group, beginnings in _GROUPS.items():
        chosen = kept[0] & kept[1]
        chosen &= [name.startswith(beginnings) for name in names]
        split = GroupKFold(number)
        aucs = cross_val_score(
            model, x[:, chosen], y, groups=fold, cv=split, scoring="roc_auc"
        )
        found[group] = float(np.mean(aucs))
    return found


def described(
    scans: list[tuple[np.ndarray, object]], seed: int
) -> tuple[list[dict], np.ndarray]:
    """Returns the features of random patches of scans, and their places."""
    rng = np.random.default_rng(seed)
    rows, places = [], []
    for scan, place in scans:
        for patch in patches(scan, rng):
            rows.append(describe(patch, rng))
            places.append(place)
    return rows, np.array(places)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kitti", type=Path)
    parser.add_argument("--drive", nargs="*", default=DRIVES)
    parser.add_argument("--roadsides", nargs="*", type=float, default=(0.0,))
    parser.add_argument("--scans", type=int, default=7)
    parser.add_argument("--draws", type=int, default=4)
    given = parser.parse_args()
    real = list(some_scans(open_drive(given.kitti), 40))
    print("scans", *_GROUPS, sep=",")
    for roadsides in given.roadsides:
        made = [
            (scan, f"{name} {place}")
            for name in given.drive
            for scan, place in some_scans(
                simulated(name, roadsides), given.scans
            )
        ]
        rows: dict[str, list[dict]] = {"real": [], "halves": []}
        with threadpool_limits(1):  # The trees are small.
            for seed in range(given.draws):
                patched = described(made, seed)
                pair = [described(real, seed), patched]
                rows["real"].append(tell_apart(pair))
                places = np.unique(patched[1], return_inverse=True)[1]
                later = places > places.max() // 2
                halves = [
                    (
                        [patched[0][k] for k in np.flatnonzero(half)],
                        places[half],
                    )
                    for half in (later, ~later)
                ]
                rows["halves"].append(tell_apart(halves))
        for kind, found in rows.items():
            means = [np.mean([one[g] for one in found]) for g in _GROUPS]
            values = ",".join(f"{mean:.3f}" for mean in means)
            print(f"{kind} roadsides {roadsides:g},{values}", flush=True)


if __name__ == "__main__":
    main()
