"""Least squares over poses that are tied to each other.

Gauss-Newton on SE(3) with sparse normal equations, as in Grisetti et al.,
"A tutorial on graph-based SLAM" (2010). Ties that may be wrong are weighted
by Cauchy's kernel, whose width shrinks step by step to its final value
(graduated non-convexity), so that a poor start does not decide which ties
are believed.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from cns_drake.base import poses

# Index of a held pose.
FIXED = -1
# Factors on the width of the kernel, and steps at each.
_WIDTHS = (100.0, 30.0, 10.0, 3.0, 1.0)
_STEPS = 8
# Limit of the squared, normalised error: 95 % of the chi-squared distribution
# with six degrees of freedom.
_KERNEL = 12.6
_STILL = 1e-6


@dataclass(frozen=True)
class Ties:
    """M measured relative poses between poses of N variables V.

    A measurement is Z = inverse(V_i A) V_j B; for i == FIXED the first pose is
    A itself.

    Attributes:
        i: (M,) first variable, or FIXED.
        j: (M,) second variable.
        A: (M, 4, 4).
        B: (M, 4, 4).
        Z: (M, 4, 4).
        covariance: (M, 6, 6) of a small motion of Z from the left: turn
            [rad], then move [m].
        is_doubtful: whether they may be wrong.
    """

    i: np.ndarray
    j: np.ndarray
    A: np.ndarray
    B: np.ndarray
    Z: np.ndarray
    covariance: np.ndarray
    is_doubtful: bool

    def errors(self, V: np.ndarray) -> np.ndarray:
        """Returns the errors (M, 6) of the ties: turn and move."""
        first = np.where(
            (self.i == FIXED)[:, None, None], self.A, V[self.i] @ self.A
        )
        E = poses.inverse(first) @ V[self.j] @ self.B @ poses.inverse(self.Z)
        turn = Rotation.from_matrix(E[:, :3, :3]).as_rotvec()
        return np.concatenate([turn, E[:, :3, 3]], axis=1)


def optimise(V: np.ndarray, all_ties: list[Ties]) -> np.ndarray:
    """Returns the variables that fit the ties best.

    Args:
        V: (N, 4, 4) start.
        all_ties: the ties; together they must hold every variable.
    """
    information = [np.linalg.inv(ties.covariance) for ties in all_ties]
    for width in _WIDTHS:
        for _ in range(_STEPS):
            step = _solve(V, all_ties, information, width)
            V = V @ poses.make_pose(
                Rotation.from_rotvec(step[:, :3]).as_matrix(), step[:, 3:]
            )
            if np.abs(step).max() < _STILL:
                break
    return V


def _solve(
    V: np.ndarray,
    all_ties: list[Ties],
    information: list[np.ndarray],
    width: float,
) -> np.ndarray:
    """Returns the steps (N, 6) of one iteration."""
    size = 6 * len(V)
    H = sparse.csc_matrix((size, size))
    b = np.zeros(size)
    for ties, omega in zip(all_ties, information, strict=True):
        errors = ties.errors(V)
        if ties.is_doubtful:
            squared = np.einsum("mi,mij,mj->m", errors, omega, errors)
            weights = 1.0 / (1.0 + squared / (_KERNEL * width**2))
            omega = omega * weights[:, None, None]
        J = _jacobian(ties, len(V))
        omega = sparse.block_diag(list(omega), format="csr")
        weighted = J.T @ omega
        H = H + weighted @ J
        b += weighted @ errors.ravel()
    return -spsolve(H.tocsc(), b).reshape(-1, 6)


def _jacobian(ties: Ties, num_variables: int) -> sparse.csr_matrix:
    """Returns d errors / d steps, (6 M, 6 N), for V stepped as V exp(step).

    To first order in the errors: a step of V_j acts through Z inverse(B), one
    of V_i through inverse(A), with the opposite sign.
    """
    number = len(ties.j)
    free = np.flatnonzero(ties.i != FIXED)
    blocks = np.concatenate(
        [
            _adjoint(ties.Z @ poses.inverse(ties.B)),
            -_adjoint(poses.inverse(ties.A[free])),
        ]
    )
    rows = np.concatenate([np.arange(number), free])
    columns = np.concatenate([ties.j, ties.i[free]])
    within = np.arange(6)
    shape = (len(blocks), 6, 6)
    row = np.broadcast_to(6 * rows[:, None, None] + within[:, None], shape)
    column = np.broadcast_to(6 * columns[:, None, None] + within, shape)
    return sparse.csr_matrix(
        (blocks.ravel(), (row.ravel(), column.ravel())),
        shape=(6 * number, 6 * num_variables),
    )


def _adjoint(X: np.ndarray) -> np.ndarray:
    """Returns the (M, 6, 6) that moves twists (turn, move) through X."""
    R, p = X[:, :3, :3], X[:, :3, 3]
    cross = np.zeros((len(X), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = -p[:, 2], p[:, 1]
    cross[:, 1, 0], cross[:, 1, 2] = p[:, 2], -p[:, 0]
    cross[:, 2, 0], cross[:, 2, 1] = -p[:, 1], p[:, 0]
    result = np.zeros((len(X), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = R
    result[:, 3:, :3] = cross @ R
    return result
