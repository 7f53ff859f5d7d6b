"""Tests whether a classifier can tell real scans from simulated scans.

Of each scan, sixteen square patches are described by features. The sides of a
patch are 8 m long, and all patches lie within 30 m of the LiDAR. Boosted trees
are then trained to distinguish the patches of the two sets; a place is never in
both training and test data. A place consists of the scans less than 30 m from
its first scan, even if they come from several passes or drives. In a folder
without poses, all scans are one place. The AUC of the classifier is 1 if it
classifies all patches correctly, and 0.5 if it guesses. As a control, the
classifier distinguishes the first half of the simulated places from the second
half. All AUCs are means over random samples of patches; the AUCs of single
samples differ by up to 0.04.

Some features need the ring (laser) of each point. Rings are read from
recordings, or from files that store one ring after the other, like KITTI's. If
one of the two sets has no rings, these features are left out.

Bird's-eye images are judged in the same way, as columns of points without
intensities and rings. The simulated scans first become such images, too.

The module needs the optional packages of the extra `judge`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_score
from threadpoolctl import threadpool_limits

from cns_drake.base import step_lengths, terminal, track
from cns_drake.drives import Drive
from evaluation.clouds import count_image, image_points

# Scans closer to each other than this are from one place [m].
_ONE_PLACE = 30.0
# Greatest number of scans per drive.
_MOST_SCANS = 40
# Greatest number of folds of the cross-validation.
_MOST_FOLDS = 3
# Number of boosted trees.
_TREES = 120
# Greatest intensity after scaling, like KITTI's, which never reaches 1.
_FULL = 99.0
# Least and greatest number of rings of a LiDAR. Outside of it, the points are
# not in the order of rings.
_RINGS = (8, 160)


def scan_table(scan: np.ndarray) -> np.ndarray:
    """Returns a scan as (N, 5): x, y, z [m], intensity from 0 to 99, ring.

    Args:
        scan: (N, 4) x, y, z and intensity, or records of a drive.
    """
    ring = None
    if scan.dtype.names:
        names = scan.dtype.names
        ring = scan["ring"].astype(float) if "ring" in names else None
        empty = np.zeros(len(scan))
        bright = scan["intensity"] if "intensity" in names else empty
        scan = np.stack([scan["x"], scan["y"], scan["z"], bright], axis=1)
    table = np.asarray(scan, float)
    if not len(table):
        return np.zeros((0, 5))
    bright = table[:, 3] * (100.0 if table[:, 3].max() <= 1.0 else 1.0)
    bright = np.minimum(np.rint(bright), _FULL)
    if ring is None:
        azimuth = np.arctan2(table[:, 1], table[:, 0]) % (2.0 * np.pi)
        ring = np.cumsum(np.diff(azimuth, prepend=0.0) < -np.pi).astype(float)
        if not _RINGS[0] <= ring[-1] <= _RINGS[1]:
            ring = np.full(len(table), np.nan)
    table = np.column_stack([table[:, :3], bright, ring])
    return table[np.isfinite(table[:, :3]).all(axis=1)]


def image_table(scan: np.ndarray) -> np.ndarray:
    """Returns the bird's-eye image of a scan as columns of points.

    A scan that was itself made from such an image gives the same columns of
    points again.

    Args:
        scan: as for `scan_table`.

    Returns:
        (N, 5) as from `scan_table`, with NaN as intensity and as ring.
    """
    points = image_points(count_image(scan_table(scan)[:, :3]))
    return np.column_stack([points, np.full((len(points), 2), np.nan)])


def places_of(
    drives: Iterable[Drive],
    table: Callable[[np.ndarray], np.ndarray] = scan_table,
    note: Callable[[str], None] = terminal.note,
) -> list[list[np.ndarray]]:
    """Returns at most 40 scans of each drive, as a list for each place.

    A place begins with a scan that is at least 30 m from the first scans of all
    earlier places in the same world frame and map. All other scans belong to
    the earliest place whose first scan is less than 30 m away. Scans at one
    position are therefore always at one place, even if a drive comes back, or
    if they are from different drives. Each scan is a table as `scan_table`
    returns it. Scans without points are left out, with a note on their number.
    """
    places: dict[tuple, list[np.ndarray]] = {}
    for drive in drives:
        num_empty = 0
        world = drive.world_frame, (drive.scenario or {}).get("map")
        for k in range(0, len(drive), -(-len(drive) // _MOST_SCANS)):
            p_WS = drive.X_WS[k, :3, 3]
            near = (
                first
                for first in places
                if first[0] == world
                and np.linalg.norm(p_WS - first[1]) < _ONE_PLACE
            )
            place = next(near, (world, tuple(p_WS)))
            scan = table(drive.scan(k))
            if len(scan):
                places.setdefault(place, []).append(scan)
            num_empty += not len(scan)
        if num_empty:
            note(f"{drive.name}: {num_empty} scans without points left out")
    return list(places.values())


@dataclass(frozen=True)
class Features:
    """The features of all patches of a set of scans (real or simulated).

    A patch is a square piece of a scan.

    Attributes:
        rows: for each of the N patches, name of a feature -> its value.
        place: (N,) number of the place at which each patch was recorded.
    """

    rows: list[dict[str, float]]
    place: np.ndarray

    @classmethod
    def of_places(
        cls, places: list[list[np.ndarray]], seed: int = 0
    ) -> Features:
        """Returns the features of random patches of scans.

        Args:
            places: scans by place, see `places_of`.
            seed: seed of the random choice of patches.
        """
        rng = np.random.default_rng(seed)
        rows = []
        numbers = []
        for number, scans in enumerate(places):
            for scan in scans:
                for patch in _patches(scan, rng):
                    rows.append(_describe(patch, rng))
                    numbers.append(number)
        return cls(rows, np.array(numbers))

    def of(self, names: list[str]) -> np.ndarray:
        """Returns some features of all patches as an array (N, F).

        A feature that a patch lacks is NaN.

        Args:
            names: names of the F features.
        """
        return np.array(
            [[row.get(name, np.nan) for name in names] for row in self.rows]
        )

    def part(self, mask: np.ndarray) -> Features:
        """Returns the features of the patches that a mask selects."""
        kept = np.flatnonzero(mask).tolist()
        return Features([self.rows[k] for k in kept], self.place[mask])


def common_names(sets: list[Features]) -> list[str]:
    """Returns the names of features that are common in each of several sets.

    A feature is common in a set of scans if at least a tenth of the set's
    patches have it.
    """
    names = list(dict.fromkeys(n for s in sets for row in s.rows for n in row))
    shares = [np.isfinite(features.of(names)).mean(axis=0) for features in sets]
    kept = np.min(shares, axis=0) >= 0.1
    return [name for name, is_kept in zip(names, kept, strict=True) if is_kept]


def tell_apart(real: Features, simulated: Features, names: list[str]) -> float:
    """Returns how well a classifier tells real from simulated patches, as AUC.

    The AUC is the mean of a cross-validation in up to three folds. All patches
    of a place are in the same fold. The result is NaN if all real patches, or
    all simulated patches, are from one place.

    Args:
        real: features and places of real patches.
        simulated: features and places of simulated patches.
        names: names of the features that the classifier uses.
    """
    sets = [_in_folds(features) for features in (real, simulated)]
    folds = min(_MOST_FOLDS, *(fold.max() + 1 for fold in sets))
    if folds < 2:
        return np.nan
    x = np.concatenate([real.of(names), simulated.of(names)])
    y = np.repeat([1, 0], [len(real.rows), len(simulated.rows)])
    fold = np.concatenate([places % folds for places in sets])
    model = HistGradientBoostingClassifier(
        max_iter=_TREES,
        min_samples_leaf=10,
        random_state=0,
        class_weight="balanced",
    )
    # A patch weighs 1 over the share of its set, which is twice the weight that
    # `balanced` gives. The scale matters: a leaf needs a fixed sum of Hessians.
    weights = {"sample_weight": np.full(len(y), 2.0)}
    folded = PredefinedSplit(fold)
    aucs = cross_val_score(
        model, x, y, cv=folded, scoring="roc_auc", params=weights
    )
    return float(np.mean(aucs))


def _in_folds(features: Features) -> np.ndarray:
    """Returns the number of each patch's place, counted by appearance."""
    return np.unique(features.place, return_inverse=True)[1]


def aucs_by_group(real: Features, simulated: Features) -> dict:
    """Returns how well a classifier tells real from simulated scans.

    The result contains two AUCs for each group of features: the AUC of the
    classifier, and the AUC of a control. The control is the same classifier on
    two halves of the simulated scans.
    """
    names = common_names([real, simulated])
    groups = {"all": names}
    for name in names:
        groups.setdefault(name.partition(":")[0], []).append(name)
    groups["all but intensity"] = [
        n for n in names if not n.startswith("intensity")
    ]
    groups["all but intensity and rings"] = [
        n for n in groups["all but intensity"] if "rings" not in n
    ]
    place = _in_folds(simulated)
    half = place > place.max() // 2
    halves = simulated.part(half), simulated.part(~half)
    # The trees are small: several threads would take longer than one.
    with threadpool_limits(1):
        return {
            "patches": [len(real.rows), len(simulated.rows)],
            "auc": {
                g: tell_apart(real, simulated, n) for g, n in groups.items()
            },
            "control": {g: tell_apart(*halves, n) for g, n in groups.items()},
        }


def judge_draws(
    real: list[list[np.ndarray]],
    simulated: list[list[np.ndarray]],
    draws: int,
) -> dict:
    """Returns the mean result of `aucs_by_group` over random draws of patches.

    Groups of features that a draw lacks are left out. The numbers of patches in
    the result are from the first draw.

    Args:
        real, simulated: scans by place, see `places_of`.
        draws: number of random draws of patches.
    """
    results = [
        aucs_by_group(
            Features.of_places(real, seed), Features.of_places(simulated, seed)
        )
        for seed in track(range(draws), "judging", draws, "draws")
    ]
    means = {
        key: {
            group: float(np.mean([result[key][group] for result in results]))
            for group in results[0][key]
            if all(group in result[key] for result in results)
        }
        for key in ("auc", "control")
    }
    return {"patches": results[0]["patches"], **means}


# Number of patches of a scan.
_PATCHES = 16
# Half the side of a patch [m].
_HALF_WIDTH = 4.0
# Least range of the middle of a patch [m].
_LEAST_RANGE = 5.0
# Greatest range of the middle of a patch [m].
_MOST_RANGE = 30.0
# Least number of points of a patch.
_FEWEST_POINTS = 150
# Greatest number of neighbourhoods in a patch.
_NEIGHBOURHOODS = 160
# Radius of a neighbourhood [m].
_RADIUS = 0.75
# Least number of points of a neighbourhood.
_FEWEST_NEIGHBOURS = 8
# Quantiles of values over a patch that are features.
_QUANTILES = (0.1, 0.5, 0.9)


def _patches(
    scan: np.ndarray, rng: np.random.Generator
) -> Iterator[np.ndarray]:
    """Yields up to sixteen patches of a scan, at random positions.

    A patch contains the points (M, 5) in a square with sides of 8 m, in the
    form of `scan`.

    Args:
        scan: (N, 5) the scan, see `evaluation.real.judge.scan_table`.
        rng: random generator of the positions.
    """
    ranges = np.linalg.norm(scan[:, :3], axis=1)
    near = np.flatnonzero((ranges > _LEAST_RANGE) & (ranges < _MOST_RANGE))
    found = 0
    for row in rng.permutation(near)[: 4 * _PATCHES]:
        apart = np.abs(scan[:, :2] - scan[row, :2]).max(axis=1)
        patch = scan[apart < _HALF_WIDTH]
        if len(patch) >= _FEWEST_POINTS:
            yield patch
            found += 1
        if found == _PATCHES:
            return


def _describe(patch: np.ndarray, rng: np.random.Generator) -> dict[str, float]:
    """Returns the features of a piece of a scan, by name.

    A name begins with the group of the feature, such as `intensity`.

    Args:
        patch: (M, 5) the piece, see `evaluation.real.judge.scan_table`.
        rng: random generator, which chooses the points whose neighbourhoods are
            described.
    """
    p, bright, ring = patch[:, :3], patch[:, 3], patch[:, 4]
    tree = cKDTree(p)
    has_intensity = np.isfinite(bright).all()
    result = _intensity(bright, tree) if has_intensity else {}
    result |= _density(p, ring, tree)
    low = np.quantile(p[:, 2], 0.05)
    height = p[:, 2] - low
    for part in (0.25, *_QUANTILES, 0.99):
        result[f"height: {part:.0%}"] = float(np.quantile(height, part))
    result["height: 2 to 5 m"] = float(np.mean((height > 2) & (height < 5)))
    result["height: below 0.3 m"] = float(np.mean(height < 0.3))
    result |= _ground_steps(p[height < 0.5])

    count = min(len(p), _NEIGHBOURHOODS)
    chosen = rng.choice(len(p), count, replace=False)
    groups = tree.query_ball_point(p[chosen], _RADIUS)
    has_shape = [len(g) >= _FEWEST_NEIGHBOURS for g in groups]
    chosen, groups = chosen[has_shape], groups[has_shape]
    shapes = [_shape(p[g], ring[g]) for g in groups]
    if not shapes:
        return result
    table = np.array(shapes)
    linear, planar, scattered, up, residual, within, between = table.T
    flat = planar > 0.5
    kinds = ("linear", linear), ("planar", planar), ("scattered", scattered)
    for name, values in kinds:
        result[f"eigenvalues: {name}"] = float(np.mean(values))
        result[f"eigenvalues: {name}, 90 %"] = float(np.quantile(values, 0.9))
    result["eigenvalues: mainly scattered"] = float(
        np.mean(scattered > np.maximum(linear, planar))
    )
    result["eigenvalues: oblique"] = _masked_mean(
        (up > 0.3) & (up < 0.85), flat
    )
    result["eigenvalues: up"] = _masked_mean(up > 0.95, flat)
    ground = flat & (up > 0.95) & (p[chosen, 2] < low + 0.5)
    for name, mask in (("ground", ground), ("walls", flat & (up < 0.2))):
        for kind, values in (
            ("all", residual),
            ("within rings", within),
            ("between rings", between),
        ):
            known = values[mask & np.isfinite(values)]
            for part in _QUANTILES:
                key = f"roughness: {name}, {kind}, {part:.0%} [log mm]"
                result[key] = _quantile(known, part)
    result["intensity: ground"] = _masked_mean(bright[chosen], ground)
    return result


def _intensity(bright: np.ndarray, tree: cKDTree) -> dict[str, float]:
    rows = tree.query(tree.data, 7)[1][:, 1:]
    spread = bright[rows].std(axis=1)
    result = {
        "intensity: spread among 6": float(np.median(spread)),
        "intensity: spread among 6, mean": float(np.mean(spread)),
        "intensity: values": float(len(np.unique(bright))),
        "intensity: zeros": float(np.mean(bright == 0.0)),
        "intensity: spread": float(np.std(bright)),
        "intensity: mean": float(np.mean(bright)),
    }
    for part in (0.05, 0.25, 0.5, 0.75, 0.95):
        result[f"intensity: {part:.0%}"] = float(np.quantile(bright, part))
    return result


def _density(
    p: np.ndarray, ring: np.ndarray, tree: cKDTree
) -> dict[str, float]:
    ranges = np.linalg.norm(p, axis=1)
    distance = tree.query(p, 5)[0][:, 1:] / ranges[:, None]
    result = {"density: points": float(np.log(len(p)))}
    for part in _QUANTILES:
        key = f"density: neighbour, {part:.0%}"
        result[key] = float(np.quantile(distance[:, 0], part))
    result["density: isolated"] = float(np.mean(distance[:, 3] > 0.02))
    along, across = np.full((2, 1), np.nan)
    if np.isfinite(ring).all():
        order = np.lexsort((np.arctan2(p[:, 1], p[:, 0]), ring))
        gap = step_lengths(p[order])
        gap /= ranges[order][1:]
        along = gap[np.diff(ring[order]) == 0.0]
        rows = tree.query(p, 16)[1] % len(p)
        other = ring[rows] != ring[:, None]
        first = rows[np.arange(len(p)), other.argmax(axis=1)]
        across = np.linalg.norm(p - p[first], axis=1) / ranges
        across = across[other.any(axis=1)]
    for part in _QUANTILES:
        result[f"density: along rings, {part:.0%}"] = _quantile(along, part)
        result[f"density: across rings, {part:.0%}"] = _quantile(across, part)
    for size in (0.2, 0.5, 1.0):
        cells = len(np.unique(np.floor(p / size), axis=0))
        result[f"voxels: of {size} m a point"] = cells / len(p)
    return result


def _ground_steps(p: np.ndarray) -> dict[str, float]:
    """Returns the differences in height of neighbouring cells of the ground."""
    cell = np.floor(p[:, :2] / 0.5).astype(int)
    places, which = np.unique(cell, axis=0, return_inverse=True)
    which = which.reshape(-1)
    mean = np.bincount(which, p[:, 2]) / np.bincount(which)
    heights = {tuple(k): z for k, z in zip(places, mean, strict=True)}
    steps = np.array(
        [
            abs(z - heights.get((i + 1, j), np.nan))
            for (i, j), z in heights.items()
        ]
    )
    steps = steps[np.isfinite(steps)]
    return {
        f"ground: steps, {part:.0%}": _quantile(steps, part)
        for part in _QUANTILES
    }


def _shape(p: np.ndarray, ring: np.ndarray) -> tuple[float, ...]:
    """Returns the shape of a neighbourhood: shares, normal and residuals.

    Demantke et al. (2011) define the shares of lines, planes and scatter.
    Residuals from the plane are logarithms of lengths in mm. There are three
    kinds of residuals: of all points, within rings, and of the rings' means.
    """
    spread = p - p.mean(axis=0)
    values, vectors = np.linalg.eigh(spread.T @ spread / len(p))
    c, b, a = np.sqrt(np.maximum(values, 1e-12))
    residual = spread @ vectors[:, 0]
    within = between = np.nan
    if np.isfinite(ring[0]):
        _, which, count = np.unique(
            ring, return_inverse=True, return_counts=True
        )
        mean = np.bincount(which, residual) / count
        many = count >= 3
        if many.sum() >= 3:
            between = _log_mm(mean[many].std())
            within = _log_mm((residual - mean[which])[many[which]].std())
    shares = (a - b) / a, (b - c) / a, c / a
    return *shares, abs(vectors[2, 0]), _log_mm(c), within, between


def _log_mm(metres: float) -> float:
    return float(np.log(max(1e3 * metres, 1e-2)))


def _masked_mean(values: np.ndarray, mask: np.ndarray) -> float:
    """Returns the mean of the masked values; NaN if there are fewer than 5."""
    return float(values[mask].mean()) if mask.sum() >= 5 else np.nan


def _quantile(values: np.ndarray, part: float) -> float:
    """Returns a quantile of values; NaN if there are fewer than 5."""
    return float(np.quantile(values, part)) if len(values) >= 5 else np.nan
