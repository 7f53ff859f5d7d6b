"""Aligns two drives of one place, so that both are in one world frame.

One drive, the source, is moved into the world of the other drive, the target.
The method follows LT-SLAM (Kim and Kim, "LT-mapper", ICRA 2022), but is more
robust:

1. Each drive is checked against itself where it passes a place again, and
   straightened if it has drifted.
2. The first guess of the pose between the two worlds is the identity, if both
   drives name the same datum or frame. Otherwise, or if the identity fails,
   the guess comes from places that look alike.
3. Submaps are registered along the source's path, outwards from where the guess
   holds. Each registration starts from the result at the neighbouring submap,
   so that drift does not add up.
4. The source is moved as a rigid whole if the loops (registered pairs of
   submaps) agree on one pose; otherwise a pose graph bends its path. The target
   stays fixed.
5. Heights are measured from the target's ground, as the measure of change (TCR)
   needs.
"""

from dataclasses import asdict, dataclass

import numpy as np

from evaluation.alignment.loop_search import (
    SAME_PLACE,
    LoopSearch,
    even_indices,
    find_self_loops,
    loop_errors,
)
from evaluation.alignment.pose_graph import (
    agreeing,
    fit_anchor,
    fit_bent,
    fitted_to_loops,
)
from evaluation.alignment.pose_guesses import find_candidates, find_guesses
from evaluation.alignment.submaps import Submaps
from evaluation.base import InputError, poses
from evaluation.drives import Drive, MovedDrive

# Number of keyframes that test a guess.
_NUM_PROBES = 8
# A guess holds if this share of these keyframes fit.
_HOLDING_SHARE = 0.5
# A guess needs this many keyframes that fit.
_FEWEST_FITS = 2
# Least number of loops that must agree.
_FEWEST_LOOPS = 4
# Least share of the loops that must agree.
_AGREEING_SHARE = 0.5
# Least share of the tried keyframes whose loops must agree. In a city of equal
# blocks, 15 % of the keyframes fitted a wrong guess.
_LEAST_YIELD = 0.25
# Number of times that keyframes without a loop are tried again.
_ROUNDS = 3
# A drive has drifted if this quantile of its loops' errors is greater than
# `_DRIFT`. These are loops of the drive with itself or, under the best rigid
# pose, with the target.
_DRIFT_QUANTILE = 0.75
# See `_DRIFT_QUANTILE` [m].
_DRIFT = 0.3
# Heights are not changed if the ground is within this distance of zero [m].
_GROUND_TOLERANCE = 0.25
# Self-loops: number of pairs to try.
_MOST_SELF_LOOPS = 30
# Number of pairs that must fit, so that no chance fit bends a drive.
_FEWEST_SELF_LOOPS = 3
# Number of rounds if the drive has drifted.
_STRAIGHTENINGS = 3


@dataclass(frozen=True)
class AlignmentReport:
    """The alignment of two drives.

    Attributes:
        held: name of the drive that stays fixed. The common world is the world
            of this drive.
        moved: name of the other drive.
        frames: names of the original world frames of the fixed and of the moved
            drive.
        guess: source of the first guess.
        candidates: number of pairs of places that look alike; None if the guess
            did not need such pairs.
        attempts: number of registrations that were tried.
        loops: number of registrations that fit; each is a loop.
        inliers: number of loops that agree with the result.
        distance_median: median deviation of a keyframe's position from the
            position that an inlier implies [m].
        distance_95: 95 % quantile of this deviation [m].
        angle_median_deg: median deviation of a keyframe's orientation from the
            orientation that an inlier implies [deg].
        model: "anchor" for one rigid pose, "pose graph" for a bent drive.
        move: displacement of the LiDAR at the middle scan of the moved drive,
            along x, y, z [m].
        turn_deg: angle by which the middle scan was rotated about the vertical
            [deg].
        bend: greatest distance of a moved scan from where it would be if the
            whole drive had moved rigidly with its middle scan [m].
        straightened: for the fixed and for the moved drive, the upper quartile
            of the position errors at places that the drive passes again [m].
            The errors are from before the drift was corrected; 0 for a drive
            that was not corrected.
        ground: ground height that was subtracted from the heights of both
            drives [m].
    """

    held: str
    moved: str
    frames: tuple[str, str]
    guess: str
    candidates: int | None
    attempts: int
    loops: int
    inliers: int
    distance_median: float
    distance_95: float
    angle_median_deg: float
    model: str
    move: tuple[float, float, float]
    turn_deg: float
    bend: float
    straightened: tuple[float, float]
    ground: float

    def to_json(self) -> dict:
        """Returns all numbers of the alignment, ready for JSON."""
        return asdict(self)

    def to_text(self) -> str:
        """Returns a line for the user that summarises the alignment."""
        return (
            f"{self.moved} (poses in {self.frames[1]!r}) aligned to"
            f" {self.held} (in {self.frames[0]!r}): {self.inliers} of"
            f" {self.loops} loops agree ({self.attempts} tried), median"
            f" {self.distance_median:.2f} m and"
            f" {self.angle_median_deg:.2f} deg off; {self.model}, first guess"
            f" from {self.guess}"
        )


@dataclass(frozen=True)
class Alignment:
    """Two drives in one world.

    Attributes:
        first, second: the drives in the given order; either may have been
            moved.
        report: report on the alignment.
    """

    first: Drive
    second: Drive
    report: AlignmentReport


def align(
    first: Drive,
    second: Drive,
    *,
    hold_first: bool = False,
) -> Alignment:
    """Moves one of two drives into the world of the other.

    Args:
        first: a drive, which stays fixed unless it has drifted more than the
            other.
        second: another drive.
        hold_first: whether the first drive must stay unchanged in any case,
            because other drives are already aligned to it.

    Returns:
        Both drives in one world, and a report.

    Raises:
        InputError: if the drives have too little in common, or a scan cannot be
            read.
    """
    target, target_drift = (
        (Submaps(first), 0.0) if hold_first else _without_drift(first)
    )
    source, source_drift = _without_drift(second)
    swapped = target_drift > source_drift and not hold_first
    if swapped:
        target, source = source, target
        target_drift, source_drift = source_drift, target_drift
    search, guess, num_candidates = _search_from_a_guess(source, target)
    search.grow()
    X_TK, model = _fit_with_retries(search)
    numbers_of_loops = _numbers_of_loops(search, X_TK)
    ground = 0.0 if hold_first else target.ground_height()
    if abs(ground) < _GROUND_TOLERANCE:
        ground = 0.0
    X_TS = source.bend(X_TK)
    frame = target.drive.world
    if ground != 0.0 or target_drift > 0.0:
        # The name of the drive's world frame no longer names this frame.
        frame = f"{frame}, corrected by {target.name}"
    datum = target.drive.datum
    held_drive = _lowered(target.drive, target.X_WS, ground, frame, datum)
    moved_drive = _lowered(source.drive, X_TS, ground, frame, datum)
    return Alignment(
        moved_drive if swapped else held_drive,
        held_drive if swapped else moved_drive,
        AlignmentReport(
            held=target.name,
            moved=source.name,
            frames=(target.drive.world_frame, source.drive.world_frame),
            guess=guess,
            candidates=num_candidates,
            model=model,
            straightened=(target_drift, source_drift),
            ground=ground,
            **numbers_of_loops,
            **_motion_fields((first if swapped else second).X_WS, X_TS),
        ),
    )


def _search_from_a_guess(
    source: Submaps, target: Submaps
) -> tuple[LoopSearch, str, int | None]:
    """Finds a guess of the pose X_TS that holds, and the first loops.

    Returns three values: the search, which contains these loops; where the
    guess comes from, in words; and the number of candidate pairs, or None if no
    place had to be recognised.
    """
    known = _common_coordinates(source.drive, target.drive)
    if known is not None:
        search, holds = _probe(
            source, target, _same_coordinates(source, target)
        )
        if holds:
            return search, known, None
    candidates = find_candidates(source, target)
    best = LoopSearch(source, target)
    for guess in find_guesses(candidates):
        seen = np.unique(candidates.source[guess.pairs])
        search, holds = _probe(source, target, guess.X_TS, seen)
        if len(search.loops) > len(best.loops):
            best = search
        if holds:
            break
    if len(best.loops) < _FEWEST_FITS:
        raise InputError(
            f"{source.name}: cannot be aligned to {target.name}: no place of"
            f" either drive was found in the other{source.drive.placing}"
        )
    return best, "places that look alike", len(candidates.turn)


def _common_coordinates(source: Drive, target: Drive) -> str | None:
    """Returns what two drives name as common, in words; None if nothing."""
    if source.world == target.world:
        return "the common frame"
    if source.datum is not None and source.datum == target.datum:
        return f"the common datum {source.datum}"
    return None


def _same_coordinates(source: Submaps, target: Submaps) -> np.ndarray:
    """Returns the pose X_TS (4, 4) of the source's world in the target's world.

    The two worlds must have the same axes and horizontal origin. Their heights
    may differ.
    """
    offsets = target.X_WK[:, None, :3, 3] - source.X_WK[None, :, :3, 3]
    away = np.linalg.norm(offsets[:, :, :2], axis=2)
    place = away.argmin(axis=0)
    near = away.min(axis=0) <= SAME_PLACE
    height = 0.0
    if near.any():
        # The LiDARs have about the same height above the ground.
        height = float(np.median(offsets[place, np.arange(len(near)), 2][near]))
    return poses.yaw_pose(0.0, z=height)


def _probe(
    source: Submaps,
    target: Submaps,
    X_TS: np.ndarray,
    keyframes: np.ndarray | None = None,
) -> tuple[LoopSearch, bool]:
    """Registers some keyframes from a guess, to test the guess.

    Args:
        X_TS: (4, 4) the guess.
        keyframes: (M,) keyframes of the source from which the tested ones are
            chosen; by default all that are near the target.

    Returns:
        The search with the loops, and whether the guess holds.
    """
    search = LoopSearch(source, target)
    X_TK = X_TS @ source.X_WK
    if keyframes is None:
        keyframes = search.near(X_TK)
    chosen = keyframes[even_indices(len(keyframes), _NUM_PROBES)]
    for k in chosen:
        search.attempt(int(k), X_TK[k])
    needed = max(_FEWEST_FITS, _HOLDING_SHARE * len(chosen))
    return search, len(search.loops) >= needed


def _fit_poses(search: LoopSearch) -> tuple[np.ndarray, str]:
    """Returns poses X_TK (K, 4, 4) that fit all loops, and the model's name."""
    loops = list(search.loops.values())
    X_TL, source = search.target.X_WK, search.source
    X_TS = fit_anchor(loops, X_TL, source.X_WK)
    X_TK = X_TS @ source.X_WK
    distances, _ = loop_errors(loops, X_TL, X_TK)
    if np.quantile(distances, _DRIFT_QUANTILE) < _DRIFT:
        return X_TK, "anchor"
    return fit_bent(loops, X_TL, source, X_TS), "pose graph"


def _fit_with_retries(search: LoopSearch) -> tuple[np.ndarray, str]:
    """Fits poses, tries doubtful keyframes again, and fits poses again."""
    X_TK, model = _fit_poses(search)
    for _ in range(_ROUNDS):
        if not search.retry(_doubtful_keyframes(search, X_TK), X_TK):
            break
        X_TK, model = _fit_poses(search)
    return X_TK, model


def _numbers_of_loops(search: LoopSearch, X_TK: np.ndarray) -> dict:
    """Returns the fields of the report on loops, from `attempts` on.

    Args:
        X_TK: (K, 4, 4) poses of the source's keyframes that were fitted to
            them.
    """
    loops = list(search.loops.values())
    is_inlier = agreeing(loops, search.target.X_WK, X_TK)
    _check_agreement(search, int(is_inlier.sum()))
    distances, angles = (
        errors[is_inlier]
        for errors in loop_errors(loops, search.target.X_WK, X_TK)
    )
    return {
        "attempts": search.num_attempts,
        "loops": len(loops),
        "inliers": len(distances),
        "distance_median": float(np.median(distances)),
        "distance_95": float(np.quantile(distances, 0.95)),
        "angle_median_deg": float(np.degrees(np.median(angles))),
    }


def _check_agreement(search: LoopSearch, num_agreeing: int) -> None:
    """Checks that enough of the loops agree."""
    num_loops, num_tried = len(search.loops), len(search.tried)
    needed = max(
        _FEWEST_LOOPS, _AGREEING_SHARE * num_loops, _LEAST_YIELD * num_tried
    )
    if num_agreeing < needed:
        raise InputError(
            f"{search.source.name}: cannot be aligned to {search.target.name}:"
            f" of {num_tried} tried places {num_loops} fit, and only"
            f" {num_agreeing} of these agree{search.source.drive.placing}"
        )


def _doubtful_keyframes(search: LoopSearch, X_TK: np.ndarray) -> np.ndarray:
    """Returns the keyframes without a loop that agrees with their poses."""
    loops = list(search.loops.values())
    good = agreeing(loops, search.target.X_WK, X_TK)
    settled = [
        loop.source
        for loop, is_good in zip(loops, good, strict=True)
        if is_good
    ]
    return np.setdiff1d(np.arange(len(X_TK)), settled)


def _lowered(
    drive: Drive,
    X_WS: np.ndarray,
    ground: float,
    world_frame: str,
    datum: str | None,
) -> Drive:
    """Returns a drive at given poses, lowered by the height of its ground.

    Args:
        X_WS: (N, 4, 4) its poses.
        ground: height of the ground [m].
        world_frame, datum: names of the frame and the datum of these poses.
    """
    X = X_WS.copy()
    X[:, 2, 3] -= ground
    return MovedDrive(drive, X, world_frame, datum)


def _motion_fields(X_WS: np.ndarray, X_TS: np.ndarray) -> dict:
    """Returns the report's fields `move`, `turn_deg` and `bend`.

    Args:
        X_WS: (N, 4, 4) poses of the moved drive before the alignment.
        X_TS: (N, 4, 4) its poses afterwards.
    """
    moves = X_TS @ poses.inverse(X_WS)
    middle = moves[len(moves) // 2]
    rigid = middle @ X_WS
    turn = np.arctan2(middle[1, 0], middle[0, 0])
    move = (X_TS - X_WS)[len(moves) // 2, :3, 3]
    bend = np.linalg.norm((X_TS - rigid)[:, :3, 3], axis=1).max()
    return {
        "move": tuple(float(value) for value in move),
        "turn_deg": float(np.degrees(turn)),
        "bend": float(bend),
    }


def _without_drift(drive: Drive) -> tuple[Submaps, float]:
    """Returns a drive's submaps, with poses that are corrected for drift.

    The corrected poses of a drive that has drifted agree at places that the
    drive passes more than once.

    Returns:
        The submaps, and the upper quartile of the position errors at such
        places [m]. The correction takes several rounds; of the quartiles before
        each round, the greatest is returned. It is 0 without a correction.
    """
    submaps = Submaps(drive)
    worst = 0.0
    # Places that are near by come first: their loops bring the others within
    # reach.
    for _ in range(_STRAIGHTENINGS):
        loops = find_self_loops(submaps, _MOST_SELF_LOOPS)
        if len(loops) < _FEWEST_SELF_LOOPS:
            break
        distances, _ = loop_errors(loops, submaps.X_WK, submaps.X_WK)
        disagreement = float(np.quantile(distances, _DRIFT_QUANTILE))
        if disagreement < _DRIFT:
            break
        worst = max(worst, disagreement)
        X_WS = submaps.bend(fitted_to_loops(loops, submaps))
        submaps = Submaps(MovedDrive(drive, X_WS, drive.world, drive.datum))
    return submaps, worst
