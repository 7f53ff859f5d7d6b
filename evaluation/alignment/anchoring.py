"""Poses of a drive from loops: as one rigid piece, or bent to fit.

LT-SLAM (Kim and Kim, "LT-mapper", ICRA 2022) ties two drives by loops and
gives one an anchor: the unknown pose of its world in the other's. Here the
target's poses are held. The unknown is the anchor, or, if the source has
drifted, the poses of its keyframes.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base import poses
from evaluation.alignment.loops import Loop, implied_poses, loop_errors
from evaluation.alignment.pose_graph import FIXED, Ties, optimise
from evaluation.alignment.submaps import Submaps

# Loops that agree with an anchor [m, rad].
AGREEMENT = (1.0, np.radians(2.0))
# Expected bend of a drive on a metre of its path, 0.15 degrees and 0.05 m; it
# grows with the square root of the distance.
_BEND = np.diag([np.radians(0.15) ** 2] * 3 + [0.05**2] * 3)
# Deviation of keyframes at one place; it keeps the ties regular [m].
_LEAST_STEP = 0.1
_TIGHT = 1e-8 * np.eye(6)


def fit_anchor(
    loops: list[Loop], X_TL: np.ndarray, X_SK: np.ndarray
) -> np.ndarray:
    """Returns the pose X_TS (4, 4) with the most agreeing loops.

    Args:
        loops: M >= 1 from a source to a target.
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
    # The variable is the pose of one keyframe amid the loops: the worlds'
    # origins may be kilometres away.
    V = optimise(
        implied[best][None],
        [
            _loop_ties(
                loops,
                X_TL,
                np.zeros(len(loops), dtype=np.int64),
                poses.inverse(X_SK[k[best]]) @ X_SK[k],
            )
        ],
    )
    return V[0] @ poses.inverse(X_SK[k[best]])


def fit_bent(
    loops: list[Loop], X_TL: np.ndarray, source: Submaps, X_TS: np.ndarray
) -> np.ndarray:
    """Returns poses X_TK (K, 4, 4) of a source that has drifted.

    Args:
        loops: M >= 1 from the source to a target.
        X_TL: poses of the target's keyframes in its world.
        source: the drive.
        X_TS: (4, 4) anchor to start from.
    """
    k = np.array([loop.source for loop in loops])
    ties = _loop_ties(loops, X_TL, k, np.tile(np.eye(4), (len(k), 1, 1)))
    return optimise(X_TS @ source.X_WK, [ties, _drive_ties(source)])


def straighten(loops: list[Loop], drive: Submaps) -> np.ndarray:
    """Returns poses X_WK (K, 4, 4) of a drive under loops to itself.

    Its first keyframe stays.
    """
    number = len(loops)
    eye = np.tile(np.eye(4), (number, 1, 1))
    ties = Ties(
        i=np.array([loop.target for loop in loops]),
        j=np.array([loop.source for loop in loops]),
        A=eye,
        B=eye,
        Z=np.array([loop.X_LK for loop in loops]),
        covariance=np.array([loop.covariance for loop in loops]),
        is_doubtful=True,
    )
    hold = Ties(
        i=np.array([FIXED]),
        j=np.array([0]),
        A=drive.X_WK[:1],
        B=np.eye(4)[None],
        Z=np.eye(4)[None],
        covariance=_TIGHT[None],
        is_doubtful=False,
    )
    return optimise(drive.X_WK, [ties, hold, _drive_ties(drive)])


def agreeing(
    loops: list[Loop], X_TL: np.ndarray, X_TK: np.ndarray
) -> np.ndarray:
    """Returns (M,) bool, which loops poses agree with."""
    distances, angles = loop_errors(loops, X_TL, X_TK)
    return (distances < AGREEMENT[0]) & (angles < AGREEMENT[1])


def _loop_ties(
    loops: list[Loop], X_TL: np.ndarray, j: np.ndarray, B: np.ndarray
) -> Ties:
    return Ties(
        i=np.full(len(loops), FIXED),
        j=j,
        A=X_TL[[loop.target for loop in loops]],
        B=B,
        Z=np.array([loop.X_LK for loop in loops]),
        covariance=np.array([loop.covariance for loop in loops]),
        is_doubtful=True,
    )


def _drive_ties(drive: Submaps) -> Ties:
    """Returns the ties of neighbouring keyframes by the drive's own poses."""
    number = len(drive) - 1
    eye = np.tile(np.eye(4), (number, 1, 1))
    step = np.maximum(np.diff(drive.path), _LEAST_STEP)
    return Ties(
        i=np.arange(number),
        j=np.arange(1, number + 1),
        A=eye,
        B=eye,
        Z=poses.inverse(drive.X_WK[:-1]) @ drive.X_WK[1:],
        covariance=step[:, None, None] * _BEND,
        is_doubtful=False,
    )
