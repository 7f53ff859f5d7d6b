"""Verifies a place: the motion of its triangles, and the planes that match.

Part of BTC (see `evaluation.methods.btc`).
"""

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base import poses
from evaluation.methods.btc_planes import Planes

# Fixed in the public program: approximate greatest number of pairs to try.
_TRIALS = 50
# Fixed in the public program: greatest distance of an aligned vertex from its
# partner [m].
_VERTEX_LIMIT = 3.0
# Fixed in the public program: number of pairs that must agree on a motion.
_MIN_AGREEING = 4


def align(query: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Returns the motion that best aligns triangles with their partners.

    The motion is Kabsch's solution, without reflections.

    Args:
        query: (..., 3, 3) vertices, one in each row [m].
        place: (..., 3, 3) the partners of these vertices [m].

    Returns:
        (..., 4, 4) pose X_PQ of the query's frame Q in the place's frame P.
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
    """Returns the pose on which most of M pairs of triangles agree.

    Every pair (or, if there are many, every n-th pair) proposes the pose that
    aligns its two triangles.

    Args:
        query: (M, 3, 3) vertices of the query's triangles in the query's frame
            Q [m], M > 0.
        place: (M, 3, 3) vertices of the matching triangles of the place in the
            place's frame P [m].

    Returns:
        X_PQ (4, 4), the first of several equally good poses; None if too few
        pairs agree.
    """
    stride = len(query) // _TRIALS + 1
    # One proposal for each whole stride.
    tried = np.arange(len(query) // stride) * stride
    motions = align(query[tried], place[tried])
    turned = query.reshape(-1, 3) @ np.swapaxes(motions[:, :3, :3], 1, 2)
    offsets = turned + motions[:, None, :3, 3] - place.reshape(-1, 3)
    is_near = (offsets**2).sum(axis=2) < _VERTEX_LIMIT**2
    agreeing = is_near.reshape(len(motions), -1, 3).all(axis=2).sum(axis=1)
    best = int(agreeing.argmax())
    return motions[best] if agreeing[best] >= _MIN_AGREEING else None


def plane_overlap(
    query: Planes,
    place: Planes,
    X_PQ: np.ndarray,
    normal_limit: float,
    distance_limit: float,
) -> float:
    """Returns the share of a query's patches that match a patch of a place.

    Each patch is compared with the patch whose centre is nearest.

    Args:
        query: patches of the query, at least one.
        place: patches of the place, at least one.
        X_PQ: (4, 4) pose of the query's frame Q in the place's frame P.
        normal_limit: upper limit of the length of the difference of the two
            unit normals. The sign of a normal does not matter.
        distance_limit: upper limit of a centre's distance from the plane of the
            other patch [m].
    """
    centers = poses.transform(X_PQ, query.centers)
    normals = query.normals @ X_PQ[:3, :3].T
    _, nearest = cKDTree(place.centers).query(centers)
    # |n1 - n2| < d of unit vectors; either sign of a normal will do.
    cosines = np.abs((normals * place.normals[nearest]).sum(axis=1))
    offsets = ((centers - place.centers[nearest]) * place.normals[nearest]).sum(
        axis=1
    )
    fitting = (cosines > 1.0 - 0.5 * normal_limit**2) & (
        np.abs(offsets) < distance_limit
    )
    return np.count_nonzero(fitting) / len(query)
