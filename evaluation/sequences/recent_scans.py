"""A drive whose last scans stay in memory, for clouds of several scans."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from cns_drake.base.recordings.sequence import Sequence
from evaluation.sequences.sequence_view import SequenceView


class RecentScans(SequenceView):
    """A sequence that reads each scan once.

    This holds for a program that reads scans in increasing order, or goes back
    by at most as many scans as are kept.
    """

    def __init__(self, sequence: Sequence, kept: int):
        """Starts without a scan in memory.

        Args:
            sequence: the drive.
            kept: number of the last scans that stay in memory.
        """
        super().__init__(sequence)
        self.world_frame = sequence.world_frame
        self._kept = kept
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()

    def scan(self, index: int) -> np.ndarray:
        if index not in self._recent:
            self._recent[index] = self._sequence.scan(index)
            if len(self._recent) > self._kept:
                self._recent.popitem(last=False)
        return self._recent[index]
