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

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_score
from threadpoolctl import threadpool_limits

from cns_drake.base import terminal, track
from cns_drake.drives import Drive
from evaluation.clouds import count_image, image_points
from evaluation.real.patch_features import describe, patches

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
                for patch in patches(scan, rng):
                    rows.append(describe(patch, rng))
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
