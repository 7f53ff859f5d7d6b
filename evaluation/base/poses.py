"""Rigid poses as homogeneous 4 x 4 matrices, many at a time."""

import math

import numpy as np
from numpy.typing import ArrayLike

# Numbers of poses and velocities that differ by less are equal [m, rad, m/s].
_SAME = 1e-6
# Farther than anything on Earth from the origin of a survey grid [m].
FARTHEST = 1e8


def make_pose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns poses (..., 4, 4) from R (..., 3, 3) and p (..., 3) [m]."""
    X = np.zeros((*R.shape[:-2], 4, 4))
    X[..., :3, :3] = R
    X[..., :3, 3] = p
    X[..., 3, 3] = 1.0
    return X


_I = np.eye(3)
_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


def is_pose(X: np.ndarray) -> bool:
    """Returns whether an array is one rigid pose (4, 4), up to rounding."""
    if X.shape != (4, 4) or not np.isfinite(X).all():
        return False
    R = X[:3, :3]
    # The tolerances of `numpy.allclose`, which takes ten times as long.
    return bool(
        (np.abs(R @ R.T - _I) <= 1e-3 + 1e-5 * _I).all()
        and np.linalg.det(R) > 0.0
        and (np.abs(X[3] - _LAST_ROW) <= 1e-6 + 1e-5 * _LAST_ROW).all()
    )


def rotation_from_quaternion(quat_xyzw: np.ndarray) -> np.ndarray:
    """Returns the rotation matrices (..., 3, 3) of quaternions (..., 4).

    Quaternions are x, y, z, w, and are normalised first.

    Raises:
        ValueError: if a quaternion has no direction (its norm is zero or
            not finite).
    """
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(quat_xyzw, axis=-1, keepdims=True)
    if not np.all(np.isfinite(norm) & (norm > 0.0)):
        raise ValueError("a quaternion of zero or infinite length")
    x, y, z, w = np.moveaxis(quat_xyzw / norm, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def same_numbers(one: ArrayLike, other: ArrayLike) -> bool:
    """Returns whether positions or velocities are equal, up to rounding.

    NaN equals NaN.
    """
    return np.allclose(one, other, rtol=0.0, atol=_SAME, equal_nan=True)


def same_turns(one: ArrayLike, other: ArrayLike) -> bool:
    """Returns whether quaternions (4,) are one rotation, up to rounding.

    The length and the sign of a quaternion do not matter.
    """
    pair = [np.asarray(quat, float) for quat in (one, other)]
    norms = [np.linalg.norm(quat) for quat in pair]
    if not all(np.isfinite(norm) and norm > 0.0 for norm in norms):
        return same_numbers(*pair)
    a, b = (quat / norm for quat, norm in zip(pair, norms, strict=True))
    return same_numbers(a, b) or same_numbers(a, -b)


def inverse(X: np.ndarray) -> np.ndarray:
    """Returns the inverse of each pose, shape (..., 4, 4)."""
    R_transposed = np.swapaxes(X[..., :3, :3], -1, -2)
    p = -np.einsum("...ij,...j->...i", R_transposed, X[..., :3, 3])
    return make_pose(R_transposed, p)


def interpolate(
    X_0: np.ndarray, X_1: np.ndarray, fraction: np.ndarray
) -> np.ndarray:
    """Returns poses between pairs of poses.

    Rotations are interpolated by SLERP, positions linearly.

    Args:
        X_0, X_1: (N, 4, 4) poses at both ends.
        fraction: (N,) interpolation parameter: 0 at X_0, 1 at X_1.

    Returns:
        (N, 4, 4); rotations are made orthonormal.
    """
    # Its import takes a third of the time of a short command.
    from scipy.spatial.transform import Rotation

    R_0 = Rotation.from_matrix(X_0[:, :3, :3])
    turn = (R_0.inv() * Rotation.from_matrix(X_1[:, :3, :3])).as_rotvec()
    R = R_0 * Rotation.from_rotvec(fraction[:, None] * turn)
    p_0, p_1 = X_0[:, :3, 3], X_1[:, :3, 3]
    return make_pose(R.as_matrix(), p_0 + fraction[:, None] * (p_1 - p_0))


def transform(X: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns the points p (N, 3), transformed by one pose X (4, 4)."""
    return p @ X[:3, :3].T + X[:3, 3]


def yaw_pose(
    yaw: float, x: float = 0.0, y: float = 0.0, z: float = 0.0
) -> np.ndarray:
    """Returns a pose (4, 4) from a yaw [rad] and a translation [m]."""
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return make_pose(R, np.array([x, y, z]))
