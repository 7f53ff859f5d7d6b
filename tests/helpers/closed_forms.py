"""Distances along rays in closed form, as oracles for the ray caster.

Every function takes an origin p (3,) or origins (N, 3) and directions d
(N, 3) in the frame of the shape, centred on its origin, and returns the (N,)
distance of the nearest intersection ahead, inf for none.
"""

import numpy as np


def _nearest(candidates) -> np.ndarray:
    candidates = np.stack(candidates)
    ahead = np.isfinite(candidates) & (candidates > 0.0)
    return np.where(ahead, candidates, np.inf).min(axis=0)


def box(p, d, size) -> np.ndarray:
    """Distances to an axis-aligned box, from outside or inside."""
    half = np.asarray(size) / 2.0
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (-half - p) / d, (half - p) / d
    near = np.minimum(low, high).max(axis=1)
    far = np.maximum(low, high).min(axis=1)
    return _nearest(
        [
            np.where(near <= far, near, np.inf),
            np.where(near <= far, far, np.inf),
        ]
    )


def ellipsoid(p, d, semi_axes) -> np.ndarray:
    p, d = p / np.asarray(semi_axes), d / np.asarray(semi_axes)
    return _nearest(_quadratic(p, d))


def _quadratic(p, d, radius=1.0):
    """Both roots of |p + t d| = radius, NaN where there are none."""
    a = (d * d).sum(axis=1)
    b = (p * d).sum(axis=-1)
    c = (p * p).sum(axis=-1) - radius**2
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - a * c)
        return (-b - root) / a, (-b + root) / a


def cylinder(p, d, radius, length) -> np.ndarray:
    """Distances to a closed cylinder along z."""
    p = np.broadcast_to(p, d.shape)
    candidates = []
    for t in _quadratic(p[:, :2], d[:, :2], radius):
        z = p[:, 2] + t * d[:, 2]
        candidates.append(np.where(np.abs(z) <= length / 2.0, t, np.inf))
    for z in (-length / 2.0, length / 2.0):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (z - p[:, 2]) / d[:, 2]
            off_axis = np.linalg.norm(p[:, :2] + t[:, None] * d[:, :2], axis=1)
        candidates.append(np.where(off_axis <= radius, t, np.inf))
    return _nearest(candidates)


def capsule(p, d, radius, length) -> np.ndarray:
    """Distances to a capsule along z; `length` is its cylindrical part's."""
    p = np.broadcast_to(p, d.shape)
    candidates = []
    for t in _quadratic(p[:, :2], d[:, :2], radius):
        z = p[:, 2] + t * d[:, 2]
        candidates.append(np.where(np.abs(z) <= length / 2.0, t, np.inf))
    for side in (-1.0, 1.0):
        end = np.array([0.0, 0.0, side * length / 2.0])
        for t in _quadratic(p - end, d, radius):
            z = p[:, 2] + t * d[:, 2]
            outer = side * z >= length / 2.0
            candidates.append(np.where(outer, t, np.inf))
    return _nearest(candidates)
