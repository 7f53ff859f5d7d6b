"""Poses at the stamps of scans: one way to them for all formats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from evaluation.base import InputError, poses

# Greatest time between two poses that are interpolated [ns].
_LONGEST_GAP_NS = 1_000_000_000
# A pose has a scan's stamp if they differ by no more: a double rounds
# nanoseconds since 1970 [ns].
_SAME_NS = 1000


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
    """

    source: object
    stamps_ns: np.ndarray
    X_WB: np.ndarray
    num_unknown: int = 0

    def at_scans(self, stamps_ns: np.ndarray) -> PosedScans:
        """Returns the poses at the stamps of scans.

        Rotations are interpolated by SLERP, positions linearly. A pose within a
        microsecond of a stamp is taken as it is.

        Args:
            stamps_ns: (M,) int64 stamps, increasing [ns].

        Raises:
            InputError: no scan has a pose, or a scan lies in a gap of more than
                a second.
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
        if (gaps > _LONGEST_GAP_NS).any():
            worst = off[gaps.argmax()]
            raise InputError(
                f"{self.source}: no pose for the scan at {wanted[worst]} ns:"
                f" the poses there are {gaps.max() * 1e-9:.2f} s apart, more"
                f" than {_LONGEST_GAP_NS * 1e-9:g} s"
            )
        notes = []
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
