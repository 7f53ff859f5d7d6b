"""Guesses of the transformation between the worlds of two drives.

Without common coordinates, the transformation is found from places that look
alike. Scan Context proposes pairs of keyframes, with the heading between them.
A consensus of pairs (RANSAC on two pairs at a time) fixes the four numbers by
which two upright worlds can differ: a rotation about the vertical and a
translation.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from cns_drake.base import poses
from cns_drake.base.angles import wrapped
from cns_drake.base.progress import track
from evaluation.alignment.loop_search import Loop, implied_poses, loop_errors
from evaluation.alignment.submaps import Submaps
from evaluation.drives.sampling import gather
from evaluation.methods.method import yaw_pose
from evaluation.methods.scan_context import ScanContext

# Factors of the kernel's width.
_WIDTHS = (100.0, 30.0, 10.0, 3.0, 1.0)
# Number of iterations for each factor.
_STEPS = 8
# Limit of the squared, normalised error: 95 % of the chi-squared distribution
# with six degrees of freedom.
_KERNEL = 12.6
_STILL = 1e-6
# Candidates for each query. LT-mapper takes 3 with a score of at least 0.7.
# Here no score is required: in a changed city, right candidates score 0.3 to
# 0.5, and wrong ones are outvoted.
_CANDIDATES = 5
# Greatest distance error of a pair under a guess [m]. It allows for half a
# lane, the spacing of keyframes and drift.
_NEAR = 8.0
# Greatest angular error of a pair under a guess [rad]. It allows for sectors of
# six degrees.
_TURN = np.radians(12.0)
# Two pairs determine a turn if they are this far apart [m].
_BASELINE = 20.0
_MOST_TRIALS = 3000
_NUM_GUESSES = 5
# Extent of the points of a scan along each axis [m].
_MAX_RANGE = 100.0
_SEED = 11
# Greatest error of a loop that agrees with an anchor [m, rad].
AGREEMENT = (1.0, np.radians(2.0))
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
    (ties) that may be wrong are weighted by Cauchy's kernel, whose width
    shrinks step by step to its final value (graduated non-convexity), so that
    poor initial poses do not decide which measurements count as right.

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
            step = _solve(V, free, all_ties, information, width)
            V[free] = V[free] @ poses.make_pose(
                Rotation.from_rotvec(step[:, :3]).as_matrix(), step[:, 3:]
            )
            if np.abs(step).max() < _STILL:
                break
    return V


def _solve(
    V: np.ndarray,
    free: slice,
    all_ties: list[Ties],
    information: list[np.ndarray],
    width: float,
) -> np.ndarray:
    """Returns the steps (F, 6) of the free poses for one iteration."""
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
        J = _blocks(_adjoint(ties.Z), ties.j, len(V)) + _blocks(
            opposite, ties.i, len(V)
        )
        J = J.tocsc()[:, :size]
        weighted = J.T @ _blocks(omega, np.arange(len(omega)), len(omega))
        H = H + weighted @ J
        b += weighted @ errors.ravel()
    return -spsolve(H.tocsc(), b).reshape(-1, 6)


def _blocks(
    blocks: np.ndarray, columns: np.ndarray, number: int
) -> sparse.bsr_matrix:
    """Returns a sparse matrix with one block (6, 6) in each row of blocks."""
    starts = np.arange(len(blocks) + 1)
    shape = 6 * len(blocks), 6 * number
    return sparse.bsr_matrix((blocks, columns, starts), shape)


def _adjoint(X: np.ndarray) -> np.ndarray:
    """Returns the adjoints (M, 6, 6) of poses X, for twists (turn, move)."""
    R, p = X[:, :3, :3], X[:, :3, 3]
    result = np.zeros((len(X), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = R
    result[:, 3:, :3] = np.cross(p[:, None], R, axisb=1, axisc=1)
    return result


@dataclass(frozen=True)
class Candidates:
    """M pairs of keyframes that look alike.

    Attributes:
        source: (M,) keyframes of the source.
        target: (M,) keyframes of the target.
        p_S: (M, 3) positions of the source's keyframes in its world S [m].
        p_T: (M, 3) positions of the target's keyframes in its world T [m].
        turn: (M,) angle about the vertical from S to T at which the two
            keyframes look alike [rad].
    """

    source: np.ndarray
    target: np.ndarray
    p_S: np.ndarray
    p_T: np.ndarray
    turn: np.ndarray


@dataclass(frozen=True)
class Guess:
    """A guess of the pose of the source's world S in the target's world T.

    Attributes:
        X_TS: (4, 4) pose: a rotation about the vertical, and a translation.
        pairs: (A,) indices of the pairs in `Candidates` that agree with this
            pose.
    """

    X_TS: np.ndarray
    pairs: np.ndarray


def find_candidates(source: Submaps, target: Submaps) -> Candidates:
    """Returns pairs of keyframes of two drives that look alike."""
    method = ScanContext()
    places = [
        method.describe_place(gather(target.drive, frame, 1, _MAX_RANGE))
        for frame in track(
            target.frames, f"describing {target.name}", len(target), "scans"
        )
    ]
    database = method.build_database(places)
    found = []
    for k in track(
        range(len(source)), f"recognising {source.name}", len(source), "scans"
    ):
        frame = int(source.frames[k])
        query = method.describe(gather(source.drive, frame, 1, _MAX_RANGE))
        scores = np.nan_to_num(method.score(query, database), nan=-np.inf)
        for place in np.argsort(-scores, kind="stable")[:_CANDIDATES]:
            if not np.isfinite(scores[place]):
                break
            X_PQ = method.relative_pose(query, database, int(place))
            assert X_PQ is not None  # NaN means no score.
            turn = (
                _heading(target.X_WK[place])
                + _heading(X_PQ)
                - _heading(source.X_WK[k])
            )
            found.append((k, int(place), turn))
    rows = np.array(found).reshape(-1, 3)
    sources, targets = rows[:, :2].astype(np.int64).T
    return Candidates(
        source=sources,
        target=targets,
        p_S=source.X_WK[sources, :3, 3],
        p_T=target.X_WK[targets, :3, 3],
        turn=rows[:, 2],
    )


def find_guesses(candidates: Candidates) -> list[Guess]:
    """Returns guesses of the pose of the source's world in the target's.

    A candidate is a pair of keyframes that look alike. Two candidates determine
    a guess, which is then refined with all candidates that agree with it. The
    guess with the most agreeing candidates comes first. Candidates that agree
    with a guess do not count for later guesses.
    """
    trials = _trials(candidates)
    is_left = np.ones(len(candidates.turn), dtype=bool)
    guesses: list[Guess] = []
    while len(guesses) < _NUM_GUESSES and len(trials):
        agreement = np.stack(
            [_agrees(candidates, turn, move) for turn, move in trials]
        )
        # A query for which several pairs agree has only one vote.
        votes = np.array(
            [
                len(np.unique(candidates.source[row & is_left]))
                for row in agreement
            ]
        )
        best = int(votes.argmax())
        if votes[best] < 2:
            break
        pairs = agreement[best] & is_left
        for _ in range(3):
            turn, move = _fit(candidates, pairs)
            agreeing = _agrees(candidates, turn, move)
            if not agreeing.any():
                break
            pairs = agreeing
        guesses.append(Guess(yaw_pose(turn, *move), np.flatnonzero(pairs)))
        is_left &= ~pairs & ~agreement[best]
        trials = [
            trial
            for trial, row in zip(trials, agreement, strict=True)
            if (row & is_left).sum() >= 2
        ]
    return guesses


def _trials(candidates: Candidates) -> list[tuple[float, np.ndarray]]:
    """Returns the turns and moves on which each two candidates agree."""
    p_S, p_T = candidates.p_S[:, :2], candidates.p_T[:, :2]
    one, two = np.triu_indices(len(p_S), k=1)
    from_S, from_T = p_S[two] - p_S[one], p_T[two] - p_T[one]
    apart = np.linalg.norm(from_S, axis=1)
    turns = np.arctan2(from_T[:, 1], from_T[:, 0]) - np.arctan2(
        from_S[:, 1], from_S[:, 0]
    )
    fits = (
        (apart > _BASELINE)
        & (np.abs(apart - np.linalg.norm(from_T, axis=1)) < _NEAR)
        & (np.abs(wrapped(turns - candidates.turn[one])) < _TURN)
        & (np.abs(wrapped(turns - candidates.turn[two])) < _TURN)
    )
    chosen = np.flatnonzero(fits)
    if len(chosen) > _MOST_TRIALS:
        rng = np.random.default_rng(_SEED)
        chosen = np.sort(rng.choice(chosen, _MOST_TRIALS, replace=False))
    trials = []
    for pair in chosen:
        ends = [one[pair], two[pair]]
        trials.append(
            (turns[pair], _move(candidates, np.array(ends), turns[pair]))
        )
    return trials


def _agrees(
    candidates: Candidates, turn: float, move: np.ndarray
) -> np.ndarray:
    """Returns which pairs agree with a guess, (M,) bool."""
    p_T = _turned(candidates.p_S, turn) + move
    distances = np.linalg.norm((p_T - candidates.p_T)[:, :2], axis=1)
    return (distances < _NEAR) & (
        np.abs(wrapped(candidates.turn - turn)) < _TURN
    )


def _fit(candidates: Candidates, pairs: np.ndarray) -> tuple[float, np.ndarray]:
    """Returns turn and move by least squares (Umeyama 1991, in 2-D)."""
    p_S, p_T = candidates.p_S[pairs, :2], candidates.p_T[pairs, :2]
    a, b = p_S - p_S.mean(axis=0), p_T - p_T.mean(axis=0)
    turn = float(
        np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    )
    return turn, _move(candidates, pairs, turn)


def _move(candidates: Candidates, pairs: np.ndarray, turn: float) -> np.ndarray:
    offsets = candidates.p_T[pairs] - _turned(candidates.p_S[pairs], turn)
    move = offsets.mean(axis=0)
    # Wrong pairs may be at any height.
    move[2] = np.median(offsets[:, 2])
    return move


def _turned(p: np.ndarray, turn: float) -> np.ndarray:
    return p @ yaw_pose(turn)[:3, :3].T


def _heading(X: np.ndarray) -> float:
    return float(np.arctan2(X[1, 0], X[0, 0]))


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
    # The unknown is the pose of a keyframe near the loops, because the origins
    # of the worlds may be kilometres away.
    ties = _loop_ties(loops)
    X_MK = poses.inverse(X_SK[k[best]]) @ X_SK[k]
    ties = replace(
        ties,
        i=1 + ties.i,
        j=np.zeros_like(ties.j),
        Z=ties.Z @ poses.inverse(X_MK),
    )
    V = np.concatenate([implied[best][None], X_TL])
    V = optimise(V, [ties], num_held=len(X_TL))
    return V[0] @ poses.inverse(X_SK[k[best]])


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


def straighten(loops: list[Loop], drive: Submaps) -> np.ndarray:
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
    return (distances < AGREEMENT[0]) & (angles < AGREEMENT[1])


def _loop_ties(loops: list[Loop]) -> Ties:
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
