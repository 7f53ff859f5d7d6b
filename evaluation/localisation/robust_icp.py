"""Point-to-plane ICP and GICP with a robust kernel and a shrinking search.

Changed parts of a city lead to wrong pairs, and the Python package of
small_gicp gives wrong pairs the same weight as right pairs. Here a pair at a
distance d from its surface has the weight (k / (k + d^2))^2 (Geman and
McClure); k falls with the search width, the greatest distance of a pair.

Width and kernel follow KISS-ICP (Vizzo et al., RA-L 2023): the search width is
3 s and k is s / 3, where s is how far the last alignment moved the scan from
its initial pose. A rotation counts as the distance by which the rotation moves
a point at the greatest range. KISS-ICP takes s from the previous scans, but
here a scan is localised by itself. The scan is therefore aligned repeatedly,
each time from the previous result and with at most half of the previous width,
until the least width is reached.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base import poses
from evaluation.alignment import Surface
from evaluation.localisation.settings import MAX_RANGE

# Sum of two points' variances across the plane in small_gicp's covariances;
# along the plane the variance is a thousand times as large.
_ACROSS = 2e-3
# The search width is this many times s, see above.
_WIDTH_PER_MOTION = 3.0
# The search width is this many times the kernel's k, because k is s / 3.
_WIDTH_PER_KERNEL = 9.0
# An alignment has at most this share of the previous alignment's width.
_SHRINKING = 0.5
# Added to the diagonal of the Hessian, so that it can be inverted where pairs
# do not determine a motion.
_DAMPING = 1e-6
# An alignment ends if there are fewer pairs, which do not determine a pose.
_FEWEST_PAIRS = 6


def align_robustly(
    surface: Surface,
    scan: np.ndarray,
    start: np.ndarray,
    widths: tuple[float, float],
    iterations: int,
    still: tuple[float, float],
    covariances: np.ndarray | None = None,
) -> tuple[np.ndarray, int]:
    """Registers a scan to a map by ICP or GICP with a Geman-McClure kernel.

    Several alignments follow one another. Each alignment begins at the result
    of the previous alignment, and pairs points over shorter distances than the
    previous alignment.

    Args:
        surface: the map.
        scan: (N, 3) in S [m].
        start: initial pose X_WS (4, 4).
        widths: greatest distance between a scan point and the map point with
            which it is paired, in the first and in the last alignment [m].
        iterations: greatest number of steps of each alignment.
        still: translation and rotation below which a step ends an alignment [m,
            rad].
        covariances: (N, 3, 3) covariances of the scan's points in S, for GICP;
            None for point-to-plane ICP.

    Returns:
        The estimated X_WS, and the number of steps.
    """
    X = start
    width, last_width = widths
    total = 0
    while True:
        begin = X
        X, number = _align(
            surface, scan, begin, width, iterations, still, covariances
        )
        total += number
        if width <= last_width:
            return X, total
        wanted = _WIDTH_PER_MOTION * _greatest_motion(begin, X)
        width = max(last_width, min(wanted, _SHRINKING * width))


def _align(
    surface: Surface,
    scan: np.ndarray,
    start: np.ndarray,
    width: float,
    iterations: int,
    still: tuple[float, float],
    covariances: np.ndarray | None,
) -> tuple[np.ndarray, int]:
    """Registers a scan with one search width.

    Args:
        width: greatest distance between paired points [m].
        surface, scan, start, iterations, still, covariances: see
            `align_robustly`.

    Returns:
        The estimated X_WS, and the number of steps.
    """
    X = start
    least_move, least_turn = still
    for number in range(1, iterations + 1):
        step = _gauss_newton_step(surface, scan, X, width, covariances)
        R = Rotation.from_rotvec(step[:3]).as_matrix() @ X[:3, :3]
        X = poses.make_pose(R, X[:3, 3] + step[3:])
        move, turn = np.linalg.norm(step[3:]), np.linalg.norm(step[:3])
        if move < least_move and turn < least_turn:
            return X, number
    return X, iterations


def _greatest_motion(X_WA: np.ndarray, X_WB: np.ndarray) -> float:
    """Returns how far a point of a scan moves at most from pose A to B [m].

    A rotation counts by how far it moves a point at the greatest range.
    """
    X_AB = poses.inverse(X_WA) @ X_WB
    turn = Rotation.from_matrix(X_AB[:3, :3]).magnitude()
    by_turn = 2.0 * MAX_RANGE * math.sin(turn / 2.0)
    return by_turn + float(np.linalg.norm(X_AB[:3, 3]))


def _gauss_newton_step(
    surface: Surface,
    scan: np.ndarray,
    X_WS: np.ndarray,
    width: float,
    covariances: np.ndarray | None,
) -> np.ndarray:
    """Returns a Gauss-Newton step (6,) in W.

    The step is a rotation vector about the LiDAR [rad], then a translation [m].
    It is 0 with too few pairs.

    Args:
        surface: the map.
        scan: (N, 3) in S [m].
        X_WS: (4, 4) pose before the step.
        width: greatest distance between paired points [m].
        covariances: (N, 3, 3) covariances of the scan's points in S, for GICP;
            None for point-to-plane ICP.
    """
    arms = scan @ X_WS[:3, :3].T
    found, squares = surface.tree.batch_nearest_neighbor_search(
        arms + X_WS[:3, 3]
    )
    near = np.asarray(squares) < width**2
    nearest = np.asarray(found, dtype=np.int64)[near]
    if len(nearest) < _FEWEST_PAIRS:
        return np.zeros(6)
    arms = arms[near]
    off = arms + X_WS[:3, 3] - surface.points[nearest]
    if covariances is None:
        n = surface.normals[nearest]
        omega = n[:, :, None] * n[:, None]
    else:
        R = X_WS[:3, :3]
        spread = surface.covariances[nearest] + R @ covariances[near] @ R.T
        omega = _ACROSS * np.linalg.inv(spread)
    pull = np.einsum("nij,nj->ni", omega, off)
    kernel = width / _WIDTH_PER_KERNEL
    squares = np.einsum("ni,ni->n", off, pull)
    weights = (kernel / (kernel + squares)) ** 2
    # A small turn w moves a point by w x arm.
    J = np.zeros((len(arms), 3, 6))
    J[:, :, :3] = np.cross(np.eye(3), arms[:, None]).transpose(0, 2, 1)
    J[:, :, 3:] = np.eye(3)
    weighted = (J.transpose(0, 2, 1) @ omega) * weights[:, None, None]
    H = np.einsum("nij,njk->ik", weighted, J) + _DAMPING * np.eye(6)
    g = np.einsum("nij,nj->i", weighted, off)
    return np.linalg.solve(H, -g)
