"""Puts two drives of one place into one world.

As LT-SLAM does it (Kim and Kim, "LT-mapper", ICRA 2022), made robust:

1. Each drive is checked against itself where it passes a place again, and
   straightened if it has drifted.
2. A first guess: the same coordinates if both name the same datum or frame,
   else, or if that does not hold, places that look alike.
3. From where the guess holds, submaps are registered along the source's
   path, each with what its neighbour taught; so drift does not add up.
4. One rigid pose for the source if the loops agree on one, else a pose
   graph that bends it. The target is held.
5. Heights start at the target's ground, since the grid of the TCR does.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from evaluation import poses
from evaluation.alignment.anchor_search import (
    find_candidates,
    find_guesses,
    upright,
)
from evaluation.alignment.anchoring import (
    agreeing,
    fit_anchor,
    fit_bent,
    straighten,
)
from evaluation.alignment.loop_search import (
    SAME_PLACE,
    LoopSearch,
    evenly,
    find_self_loops,
)
from evaluation.alignment.loops import loop_errors
from evaluation.alignment.submaps import Submaps
from evaluation.errors import InputError
from evaluation.progress import Track, silent
from evaluation.sequences.moved import MovedSequence
from evaluation.sequences.sequence import Sequence, check_same_map

When = Literal["auto", "always", "never"]

# Keyframes that try a guess; a guess holds if half of them fit.
_NUM_PROBES = 8
# Loops that must agree: at least, and of the keyframes that were tried. Under
# a wrong guess in a city of equal blocks 15 % fitted somehow.
_FEWEST_LOOPS = 4
_LEAST_YIELD = 0.25
# Pairs of a drive with itself that are tried, and how often if it drifted.
_NUM_SELF_LOOPS = 30
_ROUNDS = 3
# A drive has drifted if a quarter of its loops are off by more [m].
_DRIFT = 0.3
# The ground of a world that is off zero by less is left there [m].
_GROUND_TOLERANCE = 0.25


@dataclass(frozen=True)
class AlignmentReport:
    """How two drives were put into one world.

    Attributes:
        held: name of the drive that gives the world.
        moved: name of the other.
        frames: names of the worlds that the two came in.
        guess: where the first guess came from.
        candidates: pairs of places that look alike; None if not asked for.
        attempts: registrations tried.
        loops: registrations that fit.
        inliers: loops that agree with the result.
        distance_median: between inliers and result [m].
        distance_95: 95 % of the inliers are nearer [m].
        angle_median_deg: between inliers and result.
        model: "anchor" for one rigid pose, "pose graph" for a bent drive.
        move: of the source's middle frame, along x, y, z [m].
        turn_deg: of that frame about the vertical.
        bend: how far another frame was moved unlike the middle one, at most
            [m].
        straightened: the drives that disagreed with themselves, and by how
            much: upper quartile over their loops [m].
        ground: height that was subtracted from both [m].
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
    straightened: dict[str, float]
    ground: float

    def to_json(self) -> dict:
        """Returns all numbers."""
        return asdict(self)

    def to_text(self) -> str:
        """Returns one line for the user."""
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
        first: the one, and
        second: the other, in the order given; either may have been moved.
        report: how.
    """

    first: Sequence
    second: Sequence
    report: AlignmentReport


def in_one_world(
    first: Sequence,
    second: Sequence,
    when: When,
    track: Track = silent,
    *,
    hold_first: bool = False,
) -> Alignment | None:
    """Aligns two drives if that is wanted.

    Args:
        first: a drive.
        second: another one.
        when: "auto" aligns drives whose world frames differ by name.
        track: reports progress.
        hold_first: see `align`.

    Returns:
        None if the two are left as they are.

    Raises:
        InputError: if they are to be aligned and cannot be.
    """
    check_same_map(first, second)
    differ = first.world_frame != second.world_frame
    if when == "never" or (when == "auto" and not differ):
        return None
    return align(first, second, track, hold_first=hold_first)


def align(
    first: Sequence,
    second: Sequence,
    track: Track = silent,
    *,
    hold_first: bool = False,
) -> Alignment:
    """Moves one of two drives into the world of the other.

    Args:
        first: a drive. It is held, unless it has drifted more than the
            other.
        second: another one.
        track: reports progress.
        hold_first: hold the first one even then, and leave it wholly as it
            is, since others are aligned to it already.

    Raises:
        InputError: if the two have too little in common, or a scan cannot
            be read.
    """
    straightened: dict[str, float] = {}
    held = Submaps(first) if hold_first else _straightened(first, straightened)
    moving = _straightened(second, straightened)
    off = [straightened.get(one.name, 0.0) for one in (first, second)]
    swapped = off[0] > off[1]
    if swapped:
        held, moving = moving, held
    search, guess, num_candidates = _start(moving, held, track)
    search.grow(track)
    X_TK, model = _fit(search)
    for _ in range(_ROUNDS):
        if not search.retry(_doubtful(search, X_TK), X_TK):
            break
        X_TK, model = _fit(search)
    loops = list(search.loops.values())
    is_inlier = agreeing(loops, held.X_WK, X_TK)
    names = (second.name, first.name) if swapped else (first.name, second.name)
    needed = max(
        _FEWEST_LOOPS, 0.5 * len(loops), _LEAST_YIELD * len(search.tried)
    )
    if is_inlier.sum() < needed:
        raise InputError(
            f"{names[1]}: cannot be aligned to {names[0]}:"
            f" {len(search.tried)} places tried, {len(loops)} fit, and only"
            f" {is_inlier.sum()} of these agree"
        )
    distances, angles = loop_errors(loops, held.X_WK, X_TK)
    ground = 0.0 if hold_first else held.ground_height()
    if abs(ground) < _GROUND_TOLERANCE:
        ground = 0.0
    X_TS = moving.bend(X_TK)
    world_frame = held.sequence.world_frame
    placed = [
        _lowered(held.sequence, world_frame, held.X_WS, ground),
        _lowered(moving.sequence, world_frame, X_TS, ground),
    ]
    if swapped:
        placed.reverse()
    return Alignment(
        *placed,
        AlignmentReport(
            held=names[0],
            moved=names[1],
            frames=(held.sequence.world_frame, moving.sequence.world_frame),
            guess=guess,
            candidates=num_candidates,
            attempts=search.num_attempts,
            loops=len(loops),
            inliers=int(is_inlier.sum()),
            distance_median=float(np.median(distances[is_inlier])),
            distance_95=float(np.quantile(distances[is_inlier], 0.95)),
            angle_median_deg=float(np.degrees(np.median(angles[is_inlier]))),
            model=model,
            straightened=straightened,
            ground=ground,
            **_motion((first if swapped else second).X_WS, X_TS),
        ),
    )


def _straightened(sequence: Sequence, straightened: dict) -> Submaps:
    """Returns a drive, made to agree with itself where it can be checked.

    Args:
        sequence: the drive.
        straightened: gets an entry if it did not agree.
    """
    drive = Submaps(sequence)
    # Near places first: what they tell brings others within reach.
    for _ in range(_ROUNDS):
        loops = find_self_loops(drive, _NUM_SELF_LOOPS)
        if not loops:
            break
        distances, _ = loop_errors(loops, drive.X_WK, drive.X_WK)
        off = float(np.quantile(distances, 0.75))
        if off < _DRIFT:
            break
        straightened.setdefault(sequence.name, off)
        X_WS = drive.bend(straighten(loops, drive))
        drive = Submaps(MovedSequence(sequence, sequence.world_frame, X_WS))
    return drive


def _start(
    source: Submaps, target: Submaps, track: Track
) -> tuple[LoopSearch, str, int | None]:
    """Finds first loops.

    Returns:
        A search with some loops; what told where to look; the number of
        candidates if places had to be recognised.

    Raises:
        InputError: if nothing fits.
    """
    a, b = source.sequence, target.sequence
    known = None
    if a.world_frame == b.world_frame:
        known = "the common frame"
    elif a.datum is not None and a.datum == b.datum:
        known = f"the common datum {a.datum}"
    if known is not None:
        search, holds = _probe(
            source, target, _same_coordinates(source, target)
        )
        if holds:
            return search, known, None
    candidates = find_candidates(source, target, track)
    best = LoopSearch(source, target)
    for guess in find_guesses(candidates):
        seen = np.unique(candidates.source[guess.pairs])
        search, holds = _probe(source, target, guess.X_TS, seen)
        if len(search.loops) > len(best.loops):
            best = search
        if holds:
            break
    if len(best.loops) < 2:
        raise InputError(
            f"{a.name}: cannot be aligned to {b.name}: no place of the one"
            " was found in the other"
        )
    return best, "places that look alike", len(candidates.turn)


def _same_coordinates(source: Submaps, target: Submaps) -> np.ndarray:
    """Returns X_TS of worlds that differ, if at all, in their heights."""
    offsets = target.X_WK[:, None, :3, 3] - source.X_WK[None, :, :3, 3]
    away = np.linalg.norm(offsets[:, :, :2], axis=2)
    place = away.argmin(axis=0)
    near = away.min(axis=0) <= SAME_PLACE
    height = 0.0
    if near.any():
        # The LiDARs are about as high above the ground.
        height = float(np.median(offsets[place, np.arange(len(near)), 2][near]))
    return upright(0.0, np.array([0.0, 0.0, height]))


def _probe(
    source: Submaps,
    target: Submaps,
    X_TS: np.ndarray,
    keyframes: np.ndarray | None = None,
) -> tuple[LoopSearch, bool]:
    """Tries a guess at some keyframes; returns loops and whether it holds."""
    search = LoopSearch(source, target)
    X_TK = X_TS @ source.X_WK
    if keyframes is None:
        keyframes = search.near(X_TK)
    chosen = keyframes[evenly(len(keyframes), _NUM_PROBES)]
    for k in chosen:
        search.attempt(int(k), X_TK[k])
    return search, len(search.loops) >= max(2, 0.5 * len(chosen))


def _fit(search: LoopSearch) -> tuple[np.ndarray, str]:
    """Returns poses X_TK (K, 4, 4) by all loops, and the model's name."""
    loops = list(search.loops.values())
    X_TL, source = search.target.X_WK, search.source
    X_TS = fit_anchor(loops, X_TL, source.X_WK)
    X_TK = X_TS @ source.X_WK
    distances, _ = loop_errors(loops, X_TL, X_TK)
    if np.quantile(distances, 0.75) < _DRIFT:
        return X_TK, "anchor"
    return fit_bent(loops, X_TL, source, X_TS), "pose graph"


def _doubtful(search: LoopSearch, X_TK: np.ndarray) -> np.ndarray:
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
    sequence: Sequence, world_frame: str, X_WS: np.ndarray, ground: float
) -> Sequence:
    X = X_WS.copy()
    X[:, 2, 3] -= ground
    return MovedSequence(sequence, world_frame, X)


def _motion(X_WS: np.ndarray, X_TS: np.ndarray) -> dict:
    """Returns the fields of the report that tell how a drive was moved."""
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
