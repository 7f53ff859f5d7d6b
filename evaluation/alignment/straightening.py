"""Corrects drives that have drifted, by their own loops.

Drift shows where a drive passes a place again: its scans and its poses then
disagree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.progress import Track
from evaluation.alignment.anchor_search import straighten
from evaluation.alignment.loop_search import find_self_loops, loop_errors
from evaluation.alignment.submaps import Submaps
from evaluation.drives.drive_views import MovedDrive

# Number of tried pairs; number that must fit, so that a chance fit bends no
# drive; and number of rounds, if the drive has drifted.
_NUM_LOOPS = 30
_FEWEST_LOOPS = 3
_ROUNDS = 3
# A drive has drifted if a quarter of its loops have a greater error [m].
_DRIFT = 0.3


@dataclass(frozen=True)
class Straightened:
    """A drive that agrees with itself.

    Attributes:
        drive: with new poses, if it had drifted.
        disagreement: of the drive with itself before, see `AlignmentReport`.
    """

    drive: Submaps
    disagreement: float


def make_consistent(drive: Drive, track: Track) -> Straightened:
    """Makes a drive agree with itself, if it passes a place again.

    It can where it passes a place again.

    Raises:
        InputError: if a scan cannot be read.
    """
    submaps = Submaps(drive)
    worst = 0.0
    # Near places come first: their loops bring others within reach.
    for _ in range(_ROUNDS):
        loops = find_self_loops(submaps, _NUM_LOOPS, track)
        if len(loops) < _FEWEST_LOOPS:
            break
        distances, _ = loop_errors(loops, submaps.X_WK, submaps.X_WK)
        disagreement = float(np.quantile(distances, 0.75))
        if disagreement < _DRIFT:
            break
        worst = max(worst, disagreement)
        X_WS = submaps.bend(straighten(loops, submaps))
        submaps = Submaps(
            MovedDrive(drive, X_WS, drive.world_frame, drive.datum)
        )
    return Straightened(submaps, worst)
