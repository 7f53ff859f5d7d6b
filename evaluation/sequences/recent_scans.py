"""A drive whose last scans stay in memory, for clouds of several scans."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping

import numpy as np

from cns_drake.base.recordings.sequence import Sequence


class RecentScans(Sequence):
    """A sequence that reads each scan once.

    That holds for a reader who asks in increasing order, give or take as many
    scans as are kept.
    """

    def __init__(self, sequence: Sequence, kept: int):
        """Starts with no scan.

        Args:
            sequence: the drive.
            kept: how many of the last scans stay in memory.
        """
        self.name = sequence.name
        self.world_frame = sequence.world_frame
        self._sequence = sequence
        self._kept = kept
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()

    def __len__(self) -> int:
        return len(self._sequence)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._sequence.stamps_ns

    @property
    def X_WS(self) -> np.ndarray:
        return self._sequence.X_WS

    @property
    def scenario(self) -> Mapping | None:
        return self._sequence.scenario

    def scan(self, index: int) -> np.ndarray:
        if index not in self._recent:
            self._recent[index] = self._sequence.scan(index)
            if len(self._recent) > self._kept:
                self._recent.popitem(last=False)
        return self._recent[index]
