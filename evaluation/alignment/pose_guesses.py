"""Guesses of the transformation between the worlds of two drives.

Without common coordinates, the transformation is found from places that look
alike. Scan Context proposes pairs of keyframes, with the heading between them.
A consensus of pairs (RANSAC on two pairs at a time) fixes the four numbers by
which two upright worlds can differ: a rotation about the vertical and a
translation.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from evaluation.alignment.submaps import Submaps
from evaluation.base import poses, track, wrapped
from evaluation.drives import cloud_at
from evaluation.methods import ScanContext

# Candidates for each query. LT-mapper takes 3 with a score of at least 0.7.
# Here no score is required: in a changed city, right candidates score 0.3 to
# 0.5, and wrong candidates are outvoted.
_CANDIDATES = 5
# Greatest distance error of a pair under a guess [m]. It allows for half a
# lane, the spacing of keyframes and drift.
_NEAR = 8.0
# Greatest angular error of a pair under a guess [rad]. It allows for sectors of
# six degrees.
_TURN = np.radians(12.0)
# Two pairs determine a turn if they are this far apart [m].
_BASELINE = 20.0
# Greatest number of pairs of pairs by which poses are tried.
_MOST_TRIALS = 3000
# Greatest number of guesses.
_NUM_GUESSES = 5
# Least number of votes of a guess: two pairs determine one.
_FEWEST_VOTES = 2
# Extent of the points of a scan along each axis [m].
_MAX_RANGE = 100.0
# Seed by which pairs of pairs are chosen if there are more.
_SEED = 11
# Number of times that a guess is fitted again to the pairs that agree with it.
_REFINEMENTS = 3


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


class _Trial(NamedTuple):
    """A pose of S in T, as a turn about the vertical, and a move.

    Attributes:
        turn: angle of the turn [rad].
        move: (3,) translation [m].
    """

    turn: float
    move: np.ndarray


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
    """Returns pairs of keyframes of two drives that look alike.

    Raises:
        InputError: a scan cannot be read.
    """
    method = ScanContext()
    places = [
        method.describe_place(cloud_at(target.drive, frame, 1, _MAX_RANGE))
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
        query = method.describe(cloud_at(source.drive, frame, 1, _MAX_RANGE))
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
    """Returns guesses of the pose of the source's world in the target's world.

    A candidate is a pair of keyframes that look alike. Two candidates determine
    a guess, which is then refined with all candidates that agree with it. The
    guess with the most agreeing candidates comes first. Candidates that agree
    with a guess do not count for later guesses.
    """
    trials = _guesses_of_two(candidates)
    is_left = np.ones(len(candidates.turn), dtype=bool)
    guesses: list[Guess] = []
    while len(guesses) < _NUM_GUESSES and len(trials):
        agreement = np.stack([_agree(candidates, one) for one in trials])
        # A query for which several pairs agree has only one vote.
        votes = np.array(
            [
                len(np.unique(candidates.source[row & is_left]))
                for row in agreement
            ]
        )
        best = int(votes.argmax())
        if votes[best] < _FEWEST_VOTES:
            break
        fitted, pairs = _refine(candidates, agreement[best] & is_left)
        X_TS = poses.yaw_pose(fitted.turn, *fitted.move)
        guesses.append(Guess(X_TS, np.flatnonzero(pairs)))
        is_left &= ~pairs & ~agreement[best]
        trials = [
            trial
            for trial, row in zip(trials, agreement, strict=True)
            if (row & is_left).sum() >= _FEWEST_VOTES
        ]
    return guesses


def _refine(
    candidates: Candidates, pairs: np.ndarray
) -> tuple[_Trial, np.ndarray]:
    """Fits a pose to pairs, and then to all pairs that agree with it.

    Args:
        pairs: (M,) bool, the pairs to which the pose is fitted first.

    Returns:
        The pose; and (M,) bool, which pairs agree with it or, if none does,
        those to which it was fitted.
    """
    for _ in range(_REFINEMENTS):
        fitted = _fit_turn_and_move(candidates, pairs)
        agreeing = _agree(candidates, fitted)
        if not agreeing.any():
            break
        pairs = agreeing
    return fitted, pairs


def _guesses_of_two(candidates: Candidates) -> list[_Trial]:
    """Returns the poses on which any two candidates agree.

    If there are too many, a random sample of them is returned.
    """
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
            _Trial(
                turns[pair], _mean_move(candidates, np.array(ends), turns[pair])
            )
        )
    return trials


def _agree(candidates: Candidates, trial: _Trial) -> np.ndarray:
    """Returns which pairs agree with a guess, (M,) bool."""
    p_T = _turned(candidates.p_S, trial.turn) + trial.move
    distances = np.linalg.norm((p_T - candidates.p_T)[:, :2], axis=1)
    return (distances < _NEAR) & (
        np.abs(wrapped(candidates.turn - trial.turn)) < _TURN
    )


def _fit_turn_and_move(candidates: Candidates, pairs: np.ndarray) -> _Trial:
    """Returns turn and move by least squares (Umeyama 1991, in 2-D).

    Args:
        pairs: (M,) bool, the pairs to which they are fitted.
    """
    p_S, p_T = candidates.p_S[pairs, :2], candidates.p_T[pairs, :2]
    a, b = p_S - p_S.mean(axis=0), p_T - p_T.mean(axis=0)
    turn = float(
        np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    )
    return _Trial(turn, _mean_move(candidates, pairs, turn))


def _mean_move(
    candidates: Candidates, pairs: np.ndarray, turn: float
) -> np.ndarray:
    """Returns the translation (3,) that fits pairs after a turn [m].

    Args:
        pairs: the pairs that count, as indices or as a mask (M,).
        turn: angle of the turn [rad].
    """
    offsets = candidates.p_T[pairs] - _turned(candidates.p_S[pairs], turn)
    move = offsets.mean(axis=0)
    # Wrong pairs may be at any height.
    move[2] = np.median(offsets[:, 2])
    return move


def _turned(p: np.ndarray, turn: float) -> np.ndarray:
    """Returns points (N, 3) after a turn about the vertical [rad]."""
    return p @ poses.yaw_pose(turn)[:3, :3].T


def _heading(X: np.ndarray) -> float:
    """Returns the heading of a pose (4, 4) [rad]."""
    return float(np.arctan2(X[1, 0], X[0, 0]))
