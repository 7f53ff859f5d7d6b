"""Six numbers that describe the shape of a cloud around each point."""

import math

import numpy as np
import scipy.special
import small_gicp

from cns_drake.base import compiled


def nearest_neighbours(points: np.ndarray, k: int) -> np.ndarray:
    """Returns the k nearest neighbours of each point, including the point.

    Args:
        points: (N, 3) finite float64.
        k: number of neighbours, from 1 to N.

    Returns:
        (N, k) indices in no particular order. Of several equally far points,
        any may be chosen, but for equal clouds always the same points.
    """
    found, _ = small_gicp.KdTree(points).batch_knn_search(points, k)
    return found.astype(np.int64)


def local_features(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Returns six numbers that describe the shape of a cloud at each point.

    The numbers are a selection of the hand-made features of LPD-Net (Liu et
    al., ICCV 2019). Let l1 >= l2 >= l3 be the eigenvalues of the covariance of
    a point's neighbours, s their sum, and m1 >= m2 the eigenvalues of the
    covariance's horizontal part. The features are change of curvature l3 / s;
    omnivariance (l1 l2 l3)^(1/3) / s; entropy of the eigenvalues, -sum (li / s)
    ln (li / s); horizontal roundness m2 / m1 (which LPD-Net calls linearity);
    range and variance of z.

    If the neighbours lie in a plane or on a line, the limits of the formulas
    are used (0 ln 0 = 0, and 0 / 0 = 0 for a vertical line).

    Args:
        points: (N, 3) float64 points.
        neighbours: (N, K) indices, K >= 2, of points that are not all at the
            same position.

    Returns:
        (N, 6) float64, in the order above; all are at least 0. Eigenvalues
        are exact to about 1e-8 of the greatest.
    """
    xx, yy, zz, xy, xz, yz, height = _second_moments(points, neighbours)
    half_sum = 0.5 * (xx + yy)
    root = np.hypot(0.5 * (xx - yy), xy)
    # A vertical line has no horizontal part.
    greatest = np.where(half_sum > 0.0, half_sum + root, 1.0)
    roundness = np.maximum(half_sum - root, 0.0) / greatest
    variance = zz / neighbours.shape[1]
    # Eigenvalues in closed form (O. K. Smith, Comm. ACM 4 (4), 1961).
    total = xx + yy + zz
    xx, yy, zz, xy, xz, yz = (m / total for m in (xx, yy, zz, xy, xz, yz))
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    scale = np.sqrt(
        (a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0
    )
    determinant = (
        a * (b * c - yz * yz)
        - xy * (xy * c - yz * xz)
        + xz * (xy * yz - b * xz)
    )
    cosine = determinant / np.where(scale > 0.0, 2.0 * scale**3, 1.0)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) / 3.0
    l1 = mean + 2.0 * scale * np.cos(angle)
    least = mean + 2.0 * scale * np.cos(angle + 2.0 * math.pi / 3.0)
    # Values that rounding makes negative are set to 0.
    l2, l3 = np.maximum(3.0 * mean - l1 - least, 0.0), np.maximum(least, 0.0)
    entropy = sum(scipy.special.entr(eigenvalue) for eigenvalue in (l1, l2, l3))
    return np.stack(
        [l3, np.cbrt(l1 * l2 * l3), entropy, roundness, height, variance],
        axis=1,
    )


@compiled
def _second_moments(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Returns the second moments of each point's K neighbours about their mean.

    The result is (7, N): sums of the products xx, yy, zz, xy, xz and yz, and
    the range of z.
    """
    num_points, num_neighbours = neighbours.shape
    result = np.empty((7, num_points))
    for point in range(num_points):
        mean_x, mean_y, mean_z = 0.0, 0.0, 0.0
        least, most = np.inf, -np.inf
        for other in neighbours[point]:
            mean_x += points[other, 0]
            mean_y += points[other, 1]
            mean_z += points[other, 2]
            least = min(least, points[other, 2])
            most = max(most, points[other, 2])
        mean_x /= num_neighbours
        mean_y /= num_neighbours
        mean_z /= num_neighbours
        xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for other in neighbours[point]:
            dx = points[other, 0] - mean_x
            dy = points[other, 1] - mean_y
            dz = points[other, 2] - mean_z
            xx += dx * dx
            yy += dy * dy
            zz += dz * dz
            xy += dx * dy
            xz += dx * dz
            yz += dy * dz
        found = xx, yy, zz, xy, xz, yz, most - least
        for row in range(7):
            result[row, point] = found[row]
    return result
