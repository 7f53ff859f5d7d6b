"""Pose graphs: poses fitted to measured relative poses, such as loops."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from evaluation.alignment.loop_search import Loop, implied_poses, loop_errors
from evaluation.alignment.submaps import Submaps
from evaluation.base import poses

# Factors of the kernel's width.
_WIDTHS = (100.0, 30.0, 10.0, 3.0, 1.0)
# Number of iterations for each factor.
_STEPS = 8
# Limit of the squared, normalised error: 95 % of the chi-squared distribution
# with six degrees of freedom.
_KERNEL = 12.6
# Steps below this end the iteration [rad, m].
_STILL = 1e-6
# Greatest distance error of a loop that agrees with given poses [m].
_DISTANCE = 1.0
# Greatest angular error of such a loop [rad].
_ANGLE = np.radians(2.0)
# Covariance of the drift over a metre of path: 0.15 degrees and 0.05 m. The
# drift grows with the square root of the distance.
_BEND = np.diag([np.radians(0.15) ** 2] * 3 + [0.05**2] * 3)
# Least distance that counts between keyframes; it keeps the covariance of
# keyframes at one place regular [m].
_LEAST_STEP = 0.1


@dataclass(frozen=True)
class Ties:
    """M measured relative poses Z = inverse(V_i) V_j between poses V.

    Attributes:
        i: (M,) index of the first pose.
        j: (M,) index of the second pose.
        Z: (M, 4, 4) measured relative poses.
        covariance: (M, 6, 6) covariance of a small motion applied to Z from the
            left: rotation [rad], then translation [m].
        is_doubtful: whether the ties may be wrong.
    """

    i: np.ndarray
    j: np.ndarray
    Z: np.ndarray
    covariance: np.ndarray
    is_doubtful: bool

    def errors(self, V: np.ndarray) -> np.ndarray:
        """Returns the residuals inverse(V_i) V_j inverse(Z), (M, 6).

        Each residual is a rotation vector [rad], then a translation [m].

        Args:
            V: (N, 4, 4) the poses V, of which `i` and `j` are indices.
        """
        E = poses.inverse(V[self.i]) @ V[self.j] @ poses.inverse(self.Z)
        turn = Rotation.from_matrix(E[:, :3, :3]).as_rotvec()
        return np.concatenate([turn, E[:, :3, 3]], axis=1)


def optimise(
    V: np.ndarray, all_ties: list[Ties], num_held: int = 0
) -> np.ndarray:
    """Returns poses that fit measured relative poses best, by least squares.

    The method is Gauss-Newton on SE(3) with sparse normal equations, as in
    Grisetti et al., "A tutorial on graph-based SLAM" (2010). Measurements
    (ties) that may be wrong are weighted by Cauchy's kernel. The width of the
    kernel shrinks step by step to its final value (graduated non-convexity).
    Poor initial poses therefore do not decide which measurements count as
    right.

    Args:
        V: (N, 4, 4) poses from which the optimisation starts.
        all_ties: the measured relative poses, which together must determine
            every pose.
        num_held: number of fixed poses, which are the last poses.
    """
    information = [np.linalg.inv(ties.covariance) for ties in all_ties]
    V = V.copy()
    free = slice(0, len(V) - num_held)
    for width in _WIDTHS:
        for _ in range(_STEPS):
            step = _gauss_newton_steps(V, free, all_ties, information, width)
            V[free] = V[free] @ poses.make_pose(
                Rotation.from_rotvec(step[:, :3]).as_matrix(), step[:, 3:]
            )
            if np.abs(step).max() < _STILL:
                break
    return V


def _gauss_newton_steps(
    V: np.ndarray,
    free: slice,
    all_ties: list[Ties],
    information: list[np.ndarray],
    width: float,
) -> np.ndarray:
    """Returns the steps (F, 6) of the free poses for one iteration.

    Args:
        V: (N, 4, 4) the present poses.
        free: indices of the F free poses, which come first.
        all_ties: the measured relative poses.
        information: the inverse covariances (M, 6, 6) of each of these.
        width: factor of the kernel's width.
    """
    size = 6 * free.stop
    H, b = sparse.csc_matrix((size, size)), np.zeros(size)
    for ties, omega in zip(all_ties, information, strict=True):
        errors = ties.errors(V)
        if ties.is_doubtful:
            squared = np.einsum("mi,mij,mj->m", errors, omega, errors)
            weights = 1.0 / (1.0 + squared / (_KERNEL * width**2))
            omega = omega * weights[:, None, None]
        # To first order in the errors, a step of V_j, as V_j exp(step), changes
        # the error by the adjoint of Z times the step; a step of V_i changes it
        # directly, with the opposite sign.
        opposite = np.broadcast_to(-np.eye(6), omega.shape)
        J = _block_matrix(_adjoint(ties.Z), ties.j, len(V)) + _block_matrix(
            opposite, ties.i, len(V)
        )
        J = J.tocsc()[:, :size]
        weighted = J.T @ _block_matrix(omega, np.arange(len(omega)), len(omega))
        H = H + weighted @ J
        b += weighted @ errors.ravel()
    return -spsolve(H.tocsc(), b).reshape(-1, 6)


def _block_matrix(
    blocks: np.ndarray, columns: np.ndarray, number: int
) -> sparse.bsr_matrix:
    """Returns a sparse matrix with one block in each row of blocks.

    Args:
        blocks: (M, 6, 6) the blocks, from the first row of blocks on.
        columns: (M,) column of blocks in which each block is.
    """
    starts = np.arange(len(blocks) + 1)
    shape = 6 * len(blocks), 6 * number
    return sparse.bsr_matrix((blocks, columns, starts), shape)


def _adjoint(X: np.ndarray) -> np.ndarray:
    """Returns the adjoints (M, 6, 6) of poses X.

    The first three components of a twist are the rotation.
    """
    R, p = X[:, :3, :3], X[:, :3, 3]
    result = np.zeros((len(X), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = R
    result[:, 3:, :3] = np.cross(p[:, None], R, axisb=1, axisc=1)
    return result


def fit_anchor(
    loops: list[Loop], X_TL: np.ndarray, X_SK: np.ndarray
) -> np.ndarray:
    """Returns the pose X_TS (4, 4) with which the most loops agree.

    Args:
        loops: one or more loops (M) from a source to a target.
        X_TL: poses (L, 4, 4) of the target's keyframes in its world T.
        X_SK: poses (K, 4, 4) of the source's keyframes in its world S.
    """
    implied = implied_poses(loops, X_TL)
    k = [loop.source for loop in loops]
    anchors = implied @ poses.inverse(X_SK[k])
    agreement = [
        np.count_nonzero(agreeing(loops, X_TL, anchor @ X_SK))
        for anchor in anchors
    ]
    best = int(np.argmax(agreement))
    # The unknown is the pose of a keyframe M near the loops, because the
    # origins of the worlds may be kilometres away.
    X_SM = X_SK[k[best]]
    X_MK = poses.inverse(X_SM) @ X_SK[k]
    ties = _loop_ties(loops)
    ties = replace(
        ties,
        i=1 + ties.i,
        j=np.zeros_like(ties.j),
        Z=ties.Z @ poses.inverse(X_MK),
    )
    V = np.concatenate([implied[best][None], X_TL])
    X_TM = optimise(V, [ties], num_held=len(X_TL))[0]
    return X_TM @ poses.inverse(X_SM)


def fit_bent(
    loops: list[Loop], X_TL: np.ndarray, source: Submaps, X_TS: np.ndarray
) -> np.ndarray:
    """Returns poses X_TK (K, 4, 4) of a drifting source, fitted to loops.

    Args:
        loops: one or more loops (M) from the source to a target.
        X_TL: (L, 4, 4) poses of the target's keyframes in its world T.
        source: the drive.
        X_TS: (4, 4) pose of the source's world in T, from which the
            optimisation starts.
    """
    ties = _loop_ties(loops)
    ties = replace(ties, i=len(source) + ties.i)
    V = np.concatenate([X_TS @ source.X_WK, X_TL])
    V = optimise(V, [ties, _drive_ties(source)], num_held=len(X_TL))
    return V[: len(source)]


def fitted_to_loops(loops: list[Loop], drive: Submaps) -> np.ndarray:
    """Returns poses X_WK (K, 4, 4) of a drive's keyframes, fitted to its loops.

    The first keyframe keeps its pose.

    Args:
        loops: loops from the drive to itself.
        drive: the drive, with its poses before the fit.
    """
    X_WK = drive.X_WK
    V = optimise(X_WK, [_loop_ties(loops), _drive_ties(drive)], num_held=1)
    return X_WK[0] @ poses.inverse(V[0]) @ V


def agreeing(
    loops: list[Loop], X_TL: np.ndarray, X_TK: np.ndarray
) -> np.ndarray:
    """Returns which loops agree with given poses of the keyframes, (M,) bool.

    A loop measures the pose X_LK of the source's keyframe K in the target's
    keyframe L. The loop agrees if this measured pose differs by less than 1 m
    and 2 degrees from the pose that follows from the given poses of K and L.

    Args:
        loops: the M loops.
        X_TL: (A, 4, 4) poses of the target's keyframes in its world T.
        X_TK: (B, 4, 4) poses of the source's keyframes in T.
    """
    distances, angles = loop_errors(loops, X_TL, X_TK)
    return (distances < _DISTANCE) & (angles < _ANGLE)


def _loop_ties(loops: list[Loop]) -> Ties:
    """Returns loops as ties from keyframes of the target to the source's."""
    return Ties(
        i=np.array([loop.target for loop in loops]),
        j=np.array([loop.source for loop in loops]),
        Z=np.array([loop.X_LK for loop in loops]),
        covariance=np.array([loop.covariance for loop in loops]),
        is_doubtful=True,
    )


def _drive_ties(drive: Submaps) -> Ties:
    """Returns the ties of neighbouring keyframes by the drive's own poses."""
    number = len(drive) - 1
    step = np.maximum(np.diff(drive.path), _LEAST_STEP)
    return Ties(
        i=np.arange(number),
        j=np.arange(1, number + 1),
        Z=poses.inverse(drive.X_WK[:-1]) @ drive.X_WK[1:],
        covariance=step[:, None, None] * _BEND,
        is_doubtful=False,
    )
