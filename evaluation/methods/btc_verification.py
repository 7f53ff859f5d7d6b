"""Verifies that two clouds fit together, from common triangles.

Part of BTC (see `evaluation.methods.btc`).
"""

from __future__ import annotations

import numpy as np

from cns_drake.base import poses
from cns_drake.base.compiled import compiled
from evaluation.geometry.nearest import NearestPoints
from evaluation.methods.btc_planes import Planes

# Fixed in the public program: how many pairs are tried at most (about), how
# far from its partner a vertex may come to lie [m], and how many pairs must
# agree on a motion.
_TRIALS = 50
_VERTEX_LIMIT = 3.0
_MIN_AGREEING = 4


def align(query: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Returns the motion that brings triangles closest to their partners.

    Kabsch's solution, without reflections.

    Args:
        query: (..., 3, 3) vertices, one a row [m].
        place: (..., 3, 3) their partners.

    Returns:
        (..., 4, 4) X_PQ.
    """
    query_mean = query.mean(axis=-2)
    place_mean = place.mean(axis=-2)
    covariance = np.swapaxes(query - query_mean[..., None, :], -1, -2) @ (
        place - place_mean[..., None, :]
    )
    U, _, Vt = np.linalg.svd(covariance)
    V = np.swapaxes(Vt, -1, -2).copy()
    mirrored = np.linalg.det(V @ np.swapaxes(U, -1, -2)) < 0.0
    V[..., 2] *= np.where(mirrored, -1.0, 1.0)[..., None]
    R = V @ np.swapaxes(U, -1, -2)
    p = place_mean - (R @ query_mean[..., None])[..., 0]
    return poses.make_pose(R, p)


def find_motion(query: np.ndarray, place: np.ndarray) -> np.ndarray | None:
    """Returns the motion with the most agreeing pairs of triangles.

    Every pair, or every n-th of many, proposes the motion that aligns it.

    Args:
        query: (M, 3, 3) vertices, M > 0.
        place: (M, 3, 3) vertices of their partners.

    Returns:
        X_PQ (4, 4), the first of equally good ones; None where too few
        pairs agree.
    """
    stride = len(query) // _TRIALS + 1
    # As many as there are whole strides.
    tried = np.arange(len(query) // stride) * stride
    motions = align(query[tried], place[tried])
    agreeing = _count_agreeing(
        np.ascontiguousarray(motions),
        np.ascontiguousarray(query),
        np.ascontiguousarray(place),
        _VERTEX_LIMIT,
    )
    best = int(agreeing.argmax())
    return motions[best] if agreeing[best] >= _MIN_AGREEING else None


def plane_overlap(
    query: Planes,
    place: Planes,
    place_centers: NearestPoints,
    X_PQ: np.ndarray,
    normal_limit: float,
    distance_limit: float,
) -> float:
    """Returns the part of a query's patches that lie on one of a place.

    Each patch is compared with the one whose center is nearest to its own.

    Args:
        query: patches of the query, at least one.
        place: patches of the place, at least one.
        place_centers: the centers of the latter.
        X_PQ: (4, 4) the query's frame in that of the place.
        normal_limit: upper limit of the difference of the two normals.
        distance_limit: of the center from the other's plane [m].
    """
    centers = poses.transform(X_PQ, query.centers)
    normals = query.normals @ X_PQ[:3, :3].T
    nearest, _ = place_centers.find(centers)
    # |n1 - n2| < d of unit vectors; either sign of a normal will do.
    cosines = np.abs((normals * place.normals[nearest]).sum(axis=1))
    offsets = ((centers - place.centers[nearest]) * place.normals[nearest]).sum(
        axis=1
    )
    fitting = (cosines > 1.0 - 0.5 * normal_limit**2) & (
        np.abs(offsets) < distance_limit
    )
    return np.count_nonzero(fitting) / len(query)


@compiled
def _count_agreeing(
    motions: np.ndarray, query: np.ndarray, place: np.ndarray, limit: float
) -> np.ndarray:
    """Returns how many pairs (M, 3, 3) each motion (S, 4, 4) brings close."""
    counts = np.zeros(len(motions), dtype=np.int64)
    for s in range(len(motions)):
        X = motions[s]
        for i in range(len(query)):
            close = True
            for vertex in range(3):
                p = query[i, vertex]
                square = 0.0
                for axis in range(3):
                    moved = (
                        X[axis, 0] * p[0]
                        + X[axis, 1] * p[1]
                        + X[axis, 2] * p[2]
                        + X[axis, 3]
                    )
                    square += (moved - place[i, vertex, axis]) ** 2
                if square >= limit * limit:
                    close = False
                    break
            counts[s] += close
    return counts
