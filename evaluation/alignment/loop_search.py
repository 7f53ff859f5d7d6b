"""Finds the loops between two drives, or of a drive with itself."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.alignment.registration import register
from evaluation.alignment.submaps import Submaps
from evaluation.base import poses, track

# Least share of a submap's points that have a counterpart in the other submap.
# In a simulated city that lost three quarters of its buildings, trees and
# poles, right pairs reach at least 0.71. Of wrong pairs (other places, or
# shifted along a street), 95 % stay below 0.64.
_LEAST_FITNESS = 0.55
# The same share of the upright points only; right pairs reach at least 0.69,
# and 95 % of wrong pairs stay below 0.45.
_LEAST_STRUCTURE = 0.55
# Greatest error of a guess that registration can correct [m].
_BASIN = 12.0
# Additional errors, which ICP does not estimate: 0.2 degrees, 0.1 m.
_FLOOR = np.diag([np.radians(0.2) ** 2] * 3 + [0.1**2] * 3)
# Greatest horizontal distance of keyframes that can be registered [m].
SAME_PLACE = 10.0
# Least length of the path between two passes of a place [m].
_DETOUR = 50.0
# A keyframe is tried again if its guess has moved by this distance [m].
_ANOTHER_GUESS = 1.0


@dataclass(frozen=True)
class Loop:
    """A keyframe of a source drive, registered to a keyframe of a target.

    Attributes:
        source: keyframe K of the source.
        target: keyframe L of the target.
        X_LK: (4, 4) pose of K in L.
        covariance: (6, 6) covariance of a small motion of K in L: rotation
            [rad], translation [m].
    """

    source: int
    target: int
    X_LK: np.ndarray
    covariance: np.ndarray


def register_keyframe(
    source: Submaps, target: Submaps, k: int, place: int, X_LK: np.ndarray
) -> Loop | None:
    """Registers a keyframe of the source to a keyframe of the target.

    Args:
        source: a drive.
        target: another drive, or the same.
        k: keyframe of the source.
        place: keyframe of the target.
        X_LK: (4, 4) guess of the pose of keyframe k in the frame of `place`.

    Returns:
        The loop; None if the registration fails.
    """
    moving, held = source.surface(k), target.surface(place)
    if moving is None or held is None:
        return None
    result = register(moving, held, X_LK)
    strayed = np.linalg.norm(result.X_TS[:3, 3] - X_LK[:3, 3])
    if (
        result.fitness < _LEAST_FITNESS
        or result.structure < _LEAST_STRUCTURE
        or strayed > _BASIN
    ):
        return None
    return Loop(k, place, result.X_TS, result.covariance + _FLOOR)


def loop_errors(
    loops: list[Loop], X_WL: np.ndarray, X_WK: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the deviations of keyframe poses from the measured loops.

    Args:
        loops: the M loops.
        X_WL: (N, 4, 4) poses of all N keyframes L of the target.
        X_WK: (P, 4, 4) poses of all P keyframes K of the source.

    Returns:
        For each loop, the deviation of the source keyframe's pose from the
        pose that the loop implies: (M,) distances [m]; (M,) angles [rad].
    """
    expected = implied_poses(loops, X_WL)
    E = poses.inverse(expected) @ X_WK[[loop.source for loop in loops]]
    angles = Rotation.from_matrix(E[:, :3, :3]).magnitude()
    return np.linalg.norm(E[:, :3, 3], axis=1), angles


def implied_poses(loops: list[Loop], X_WL: np.ndarray) -> np.ndarray:
    """Returns the pose X_WK of each loop's source keyframe K, (M, 4, 4).

    Each pose is X_WL X_LK: the pose of the loop's target keyframe L, and the
    measured pose of K in L.

    Args:
        loops: the M loops.
        X_WL: (N, 4, 4) poses of all keyframes of the target.
    """
    X_LK = np.array([loop.X_LK for loop in loops]).reshape(-1, 4, 4)
    return X_WL[[loop.target for loop in loops]] @ X_LK


@dataclass
class LoopSearch:
    """Loops between two drives, as they are found.

    Attributes:
        source: drive of the keyframes K to register.
        target: drive of the keyframes L. T is its world frame.
        loops: keyframe of the source -> the loop found for it.
        tried: keyframe of the source -> (4, 4) guess X_TK from which it was
            last registered.
        num_attempts: number of registrations that were tried.
    """

    source: Submaps
    target: Submaps
    loops: dict[int, Loop] = field(default_factory=dict)
    tried: dict[int, np.ndarray] = field(default_factory=dict)
    num_attempts: int = 0

    def near(self, X_TK: np.ndarray) -> np.ndarray:
        """Returns which keyframes of the source are near the target drive.

        Args:
            X_TK: (N, 4, 4) guessed poses of all N keyframes K of the source in
                the target's world frame T.

        Returns:
            (M,) numbers of these keyframes.
        """
        return np.flatnonzero([self._place(X) is not None for X in X_TK])

    def attempt(self, k: int, X_TK: np.ndarray) -> bool:
        """Registers one keyframe of the source to the target.

        Args:
            k: number of the keyframe.
            X_TK: (4, 4) guess of the keyframe's pose in T.

        Returns:
            Whether a loop was found.
        """
        place = self._place(X_TK)
        if place is None:
            return False
        self.num_attempts += 1
        self.tried[k] = X_TK
        X_LK = poses.inverse(self.target.X_WK[place]) @ X_TK
        loop = register_keyframe(self.source, self.target, k, place, X_LK)
        if loop is None:
            return False
        self.loops[k] = loop
        return True

    def grow(self) -> None:
        """Tries to register all keyframes, starting next to known loops.

        The initial guess for a keyframe is computed from the nearest registered
        keyframe and the drive's own motion between the two keyframes.
        """
        path = self.source.path
        # The nearest keyframe with a loop, and the distance to it.
        nearest = np.zeros(len(path), dtype=np.int64)
        away = np.full(len(path), np.inf)
        is_open = np.ones(len(path), dtype=bool)

        def add_registered(k: int) -> None:
            """Makes a keyframe with a loop the nearest one of others."""
            distance = np.abs(path - path[k])
            closer = distance < away
            away[closer], nearest[closer] = distance[closer], k
            is_open[k] = False

        for k in self.loops:
            add_registered(k)
        remaining = int(is_open.sum())
        description = f"aligning {self.source.name}"
        for _ in track(range(remaining), description, remaining, "loops"):
            k = int(np.where(is_open, away, np.inf).argmin())
            is_open[k] = False
            if self.attempt(k, self._moved_with(nearest[k], k)):
                add_registered(k)

    def retry(self, keyframes: np.ndarray, X_TK: np.ndarray) -> int:
        """Registers keyframes again if their guesses have changed.

        Args:
            keyframes: numbers of the keyframes.
            X_TK: (K, 4, 4) guessed poses of all keyframes of the source.

        Returns:
            The number of new loops.
        """
        made = 0
        for k in keyframes:
            before = self.tried.get(k)
            if before is not None:
                moved = np.linalg.norm(X_TK[k, :3, 3] - before[:3, 3])
                if moved < _ANOTHER_GUESS:
                    continue
            made += self.attempt(k, X_TK[k])
        return made

    def _moved_with(self, registered: int, k: int) -> np.ndarray:
        """Returns the pose of a keyframe, moved with a registered keyframe.

        Returns:
            (4, 4) X_TK of keyframe k, if the drive's own motion between the two
            is right.
        """
        loop = self.loops[registered]
        X_TJ = self.target.X_WK[loop.target] @ loop.X_LK
        X_WK = self.source.X_WK
        return X_TJ @ poses.inverse(X_WK[registered]) @ X_WK[k]

    def _place(self, X_TK: np.ndarray) -> int | None:
        """Returns the nearest keyframe of the target; None if none is near."""
        offsets = self.target.X_WK[:, :2, 3] - X_TK[:2, 3]
        away = np.linalg.norm(offsets, axis=1)
        nearest = int(away.argmin())
        return nearest if away[nearest] <= SAME_PLACE else None


def find_self_loops(drive: Submaps, most: int) -> list[Loop]:
    """Returns the loops between keyframes of the same drive.

    A pair of keyframes that cannot be registered makes no loop.

    Args:
        drive: the drive.
        most: greatest number of pairs to register, evenly spread over the
            drive.
    """
    pairs = _repeated_places(drive)
    chosen = [pairs[index] for index in even_indices(len(pairs), most)]
    loops = []
    for k, place in track(
        chosen, f"checking {drive.name}", len(chosen), "places"
    ):
        X_LK = poses.inverse(drive.X_WK[place]) @ drive.X_WK[k]
        loop = register_keyframe(drive, drive, k, place, X_LK)
        if loop is not None:
            loops.append(loop)
    return loops


def _repeated_places(drive: Submaps) -> list[tuple[int, int]]:
    """Returns keyframes at places that a drive has passed before.

    Each keyframe is paired with an earlier keyframe at most 10 m away (seen
    from above), if at least 50 m of path lie between the two. If there are
    several such earlier keyframes, the closest one is used.

    Returns:
        Pairs of a keyframe and the earlier keyframe, in order of the first.
    """
    pairs = []
    for k in range(len(drive)):
        offsets = drive.X_WK[:, :2, 3] - drive.X_WK[k, :2, 3]
        away = np.linalg.norm(offsets, axis=1)
        away[drive.path > drive.path[k] - _DETOUR] = np.inf
        if away.min() <= SAME_PLACE:
            pairs.append((k, int(away.argmin())))
    return pairs


def even_indices(number: int, most: int) -> np.ndarray:
    """Returns up to `most` evenly spaced indices from 0 to `number` - 1."""
    if number <= most:
        return np.arange(number)
    return np.linspace(0, number - 1, most).astype(np.int64)
