"""Poses at the stamps of scans: one way to them for all formats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import NS_PER_S, InputError, poses

# Greatest time between two poses that are interpolated, by default [s].
LONGEST_GAP = 1.0
# Poses begin anew where they jump by more than this [m] ...
_JUMP = 2.0
# ... and this speed of a vehicle [m/s] ...
_FASTEST = 50.0
# ... or this multiple of its usual speed allow.
_FASTER = 10.0
# Poses with one stamp are one pose if they are within this distance [m] ...
_SAME_PLACE = 0.05
# ... and this angle [rad].
_SAME_TURN = np.radians(1.0)
# A pose has a scan's stamp if they differ by no more: a double rounds
# nanoseconds since 1970 [ns].
_SAME_NS = 1000


def _differences(
    X_WA: np.ndarray, X_WB: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns distances [m] and small angles [rad] of poses (N, 4, 4)."""
    away = np.linalg.norm((X_WB - X_WA)[:, :3, 3], axis=1)
    # The chord of a small angle is as long as its arc.
    chords = (X_WB - X_WA)[:, :3, :3]
    return away, np.linalg.norm(chords, axis=(1, 2)) / np.sqrt(2.0)


class PoseSteps(NamedTuple):
    """The steps between N poses.

    Attributes:
        times: (N - 1,) durations [s].
        moves: (N - 1,) distances [m].
        speed: median speed [m/s]; 0 for less than two poses.
        is_jump: (N - 1,) bool, at which poses begin anew.
    """

    times: np.ndarray
    moves: np.ndarray
    speed: float
    is_jump: np.ndarray

    @classmethod
    def of(cls, stamps_ns: np.ndarray, X: np.ndarray) -> PoseSteps:
        """Returns the steps of poses (N, 4, 4) at increasing stamps (N,)."""
        times = np.diff(stamps_ns) / NS_PER_S
        moves = np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=1)
        speed = float(np.median(moves / times)) if len(times) else 0.0
        allowed = _JUMP + max(_FASTEST, _FASTER * speed) * times
        return cls(times, moves, speed, moves > allowed)


class PosedScans(NamedTuple):
    """The scans of a drive that have poses.

    Attributes:
        kept: the scans between the first and the last pose, a slice of all.
        X_WB: (K, 4, 4) their poses.
        notes: notes for the user on scans that are left out, and on how far
            poses are interpolated.
    """

    kept: slice
    X_WB: np.ndarray
    notes: tuple[str, ...]


@dataclass(frozen=True)
class StampedPoses:
    """Poses at increasing times.

    Attributes:
        source: file or topic they come from, for messages.
        stamps_ns: (N,) int64 [ns], strictly increasing.
        X_WB: (N, 4, 4) float64 poses.
        num_unknown: number of rows or messages that were left out, because they
            have NaN or no rotation in the place of a pose.
        notes: notes for the user on poses that were left out or moved.
    """

    source: object
    stamps_ns: np.ndarray
    X_WB: np.ndarray
    num_unknown: int = 0
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        source: object,
        stamps_ns: np.ndarray,
        X_WB: np.ndarray,
        rows: np.ndarray | None = None,
        **fields: Any,
    ) -> StampedPoses:
        """Returns poses in the order of their stamps, each stamp once.

        Rows in another order, and poses with one stamp, are no fault if they
        do not change the pose at any time: the rows are then sorted, and the
        first pose of a stamp counts.

        Args:
            source: see the class.
            stamps_ns: (N,) int64, in any order [ns].
            X_WB: (N, 4, 4) poses.
            rows: (N,) number of the row of each, for errors; by default they
                are counted.
            fields: further attributes.

        Raises:
            InputError: poses of one stamp are apart, or the poses in the order
                of their stamps are of several drives.
        """
        numbers = np.arange(1, len(stamps_ns) + 1) if rows is None else rows
        order = np.argsort(stamps_ns, kind="stable")
        stamps, X = stamps_ns[order], X_WB[order]
        notes: list[str] = []
        back = np.flatnonzero(np.diff(stamps_ns) < 0)
        if len(back):
            lengths = [
                np.linalg.norm(np.diff(p[:, :3, 3], axis=0), axis=1).sum()
                for p in (X_WB, X)
            ]
            # Rows that were shuffled make a shorter path in order.
            if lengths[1] > lengths[0] + _SAME_PLACE:
                row = int(back[0]) + 1
                raise InputError(
                    f"{source}: time: pose {numbers[row]} at {stamps_ns[row]}"
                    " ns is not later than the one before, and the poses in the"
                    " order of time jump back and forth"
                )
            notes.append(
                f"{source}: {len(back)} poses are earlier than the one before;"
                " the poses are sorted by time"
            )
        twice = np.flatnonzero(np.diff(stamps) == 0) + 1
        if len(twice):
            first = np.searchsorted(stamps, stamps[twice])
            away, turn = _differences(X[first], X[twice])
            is_far = (away > _SAME_PLACE) | (turn > _SAME_TURN)
            if is_far.any():
                k = int(is_far.argmax())
                row = numbers[order[twice[k]]]
                raise InputError(
                    f"{source}: time: pose {row} at {stamps[twice[k]]} ns is"
                    f" not later than the one before: two poses of one time,"
                    f" {away[k]:.3g} m and {np.degrees(turn[k]):.3g} deg apart"
                )
            if away.max() > 0.0 or turn.max() > 0.0:
                notes.append(
                    f"{source}: {len(twice)} poses have the time of another, up"
                    f" to {1000.0 * away.max():.2g} mm apart; the first counts"
                )
            kept = np.delete(np.arange(len(stamps)), twice)
            stamps, X = stamps[kept], X[kept]
        return cls(source, stamps, X, notes=tuple(notes), **fields)

    def at_scans(
        self, stamps_ns: np.ndarray, pose_gap: float | None = None
    ) -> PosedScans:
        """Returns the poses at the stamps of scans.

        Rotations are interpolated by SLERP, positions linearly. A pose within a
        microsecond of a stamp is taken as it is.

        Args:
            stamps_ns: (M,) int64 stamps, increasing [ns].
            pose_gap: greatest time between two poses that are interpolated [s];
                by default a second.

        Raises:
            InputError: no scan has a pose, or a scan lies in a gap of more than
                `pose_gap`.
        """
        own = self.stamps_ns
        spanned = np.flatnonzero(
            (stamps_ns >= own[0] - _SAME_NS) & (stamps_ns <= own[-1] + _SAME_NS)
        )
        if not len(spanned):
            raise InputError(
                f"{self.source}: no pose for any scan: the poses span {own[0]}"
                f" to {own[-1]} ns, the scans {stamps_ns[0]} to"
                f" {stamps_ns[-1]} ns"
            )
        kept = slice(int(spanned[0]), int(spanned[-1]) + 1)
        wanted = stamps_ns[kept]
        after = np.clip(np.searchsorted(own, wanted), 0, len(own) - 1)
        before = np.maximum(after - 1, 0)
        # Differences of int64 are exact, and small enough for a double.
        from_before, to_after = wanted - own[before], own[after] - wanted
        nearest = np.where(
            np.abs(from_before) < np.abs(to_after), before, after
        )
        away = np.abs(own[nearest] - wanted)
        off = np.flatnonzero(away > _SAME_NS)
        X_WB = self.X_WB[nearest]
        gaps = (from_before + to_after)[off]
        longest_gap = LONGEST_GAP if pose_gap is None else pose_gap
        is_long = gaps > longest_gap * NS_PER_S
        moves, turns = _differences(
            self.X_WB[before[off]], self.X_WB[after[off]]
        )
        # Programs such as amcl send poses only while the robot moves.
        is_still = (moves <= _SAME_PLACE) & (turns <= _SAME_TURN)
        if (is_long & ~is_still).any():
            worst = int(np.where(is_still, 0, gaps).argmax())
            raise InputError(
                f"{self.source}: no pose for the scan at {wanted[off[worst]]}"
                f" ns: the poses there are {gaps[worst] * 1e-9:.4g} s apart,"
                f" more than {longest_gap:g} s (--pose-gap SECONDS allows more)"
            )
        notes = [*self.notes]
        if is_long.any():
            notes.append(
                f"{self.source}: no pose for up to {gaps.max() * 1e-9:.4g} s at"
                f" {np.count_nonzero(is_long)} scans, but the same before and"
                " after; the vehicle is taken to stand there"
            )
        if self.num_unknown:
            notes.append(
                f"{self.source}: {self.num_unknown} poses without numbers or"
                " rotation are left out"
            )
        missing = len(stamps_ns) - len(wanted)
        if missing:
            notes.append(
                f"{self.source}: no pose for {missing} of {len(stamps_ns)}"
                " scans at the ends of the drive; they are left out"
            )
        if len(off):
            X_WB[off] = poses.interpolate(
                self.X_WB[before[off]],
                self.X_WB[after[off]],
                from_before[off] / gaps,
            )
            notes.append(
                f"{self.source}: poses are interpolated at {len(off)} of"
                f" {len(wanted)} scans, up to {away.max() * 1e-6:.3g} ms from"
                " the nearest pose"
            )
        return PosedScans(kept, X_WB, tuple(notes))
