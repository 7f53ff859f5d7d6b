"""Six numbers that describe the shape of a cloud around each point.

A selection of the hand-made features of LPD-Net (Liu et al., ICCV 2019), as
RING++ uses it. With the covariance of a point's neighbours, its eigenvalues
l1 >= l2 >= l3, their sum s, and the eigenvalues m1 >= m2 of its horizontal
part:

- change of curvature l3 / s,
- omnivariance (l1 l2 l3)^(1/3) / s,
- entropy of the eigenvalues, -sum (li / s) ln (li / s),
- horizontal roundness m2 / m1 (there called linearity),
- range and variance of z.
"""

from __future__ import annotations

import math

import numpy as np

from cns_drake.base.compiled import compiled

NUM_FEATURES = 6


@compiled
def local_features(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Returns the features of each point.

    Where the neighbours lie in a plane or on a line, the limits of the
    formulas count (0 ln 0 = 0, and 0 / 0 = 0 for a vertical line).

    Args:
        points: (N, 3) float64.
        neighbours: (N, K) indices, K >= 2, of points that are not all in
            one place.

    Returns:
        (N, 6) float64, in the order above; all are at least 0. Eigenvalues
        are exact to about 1e-8 of the greatest.
    """
    num_points, num_neighbours = neighbours.shape
    result = np.empty((num_points, NUM_FEATURES))
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
        total = xx + yy + zz
        # All but the last two features are ratios.
        l1, l2, l3 = _eigenvalues(
            xx / total,
            yy / total,
            zz / total,
            xy / total,
            xz / total,
            yz / total,
        )
        half_sum = 0.5 * (xx + yy)
        root = math.hypot(0.5 * (xx - yy), xy)
        result[point, 0] = l3
        result[point, 1] = (l1 * l2 * l3) ** (1.0 / 3.0)
        result[point, 2] = -(_x_ln_x(l1) + _x_ln_x(l2) + _x_ln_x(l3))
        result[point, 3] = 0.0
        if half_sum > 0.0:
            result[point, 3] = max(half_sum - root, 0.0) / (half_sum + root)
        result[point, 4] = most - least
        result[point, 5] = zz / num_neighbours
    return result


@compiled
def _eigenvalues(
    xx: float, yy: float, zz: float, xy: float, xz: float, yz: float
) -> tuple[float, float, float]:
    """Returns the eigenvalues of a symmetric positive matrix, greatest first.

    In closed form (O. K. Smith, Comm. ACM 4 (4), 1961); what rounding makes
    negative is 0.
    """
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    scale = math.sqrt(
        (a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0
    )
    if scale == 0.0:
        return mean, mean, mean
    determinant = (
        a * (b * c - yz * yz)
        - xy * (xy * c - yz * xz)
        + xz * (xy * yz - b * xz)
    )
    cosine = determinant / (2.0 * scale * scale * scale)
    angle = math.acos(min(max(cosine, -1.0), 1.0)) / 3.0
    greatest = mean + 2.0 * scale * math.cos(angle)
    least = mean + 2.0 * scale * math.cos(angle + 2.0 * math.pi / 3.0)
    middle = 3.0 * mean - greatest - least
    return greatest, max(middle, 0.0), max(least, 0.0)


@compiled
def _x_ln_x(x: float) -> float:
    """Returns x ln x, and its limit 0 at 0."""
    return x * math.log(x) if x > 0.0 else 0.0
