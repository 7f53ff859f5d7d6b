"""A drive with the times, poses and scenario of another one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cns_drake.base.recordings.sequence import Sequence


class SequenceView(Sequence):
    """Has the length, times, poses and scenario of another sequence."""

    def __init__(self, sequence: Sequence):
        """Begins with the other sequence.

        Args:
            sequence: the drive.
        """
        self.name = sequence.name
        self._sequence = sequence

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
