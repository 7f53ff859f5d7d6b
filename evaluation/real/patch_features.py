"""Features of square pieces of scans, by which scans are told apart.

A piece is called a patch. Some features need the ring (laser) of each point.
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base import step_lengths

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


def patches(scan: np.ndarray, rng: np.random.Generator) -> Iterator[np.ndarray]:
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


def describe(patch: np.ndarray, rng: np.random.Generator) -> dict[str, float]:
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
