"""A drive whose poses have been corrected."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cns_drake.base.recordings.sequence import Sequence
from evaluation.sequences.sequence_view import SequenceView


class MovedSequence(SequenceView):
    """The scans of another sequence at corrected poses."""

    def __init__(
        self,
        sequence: Sequence,
        X_WS: np.ndarray,
        world_frame: str,
        datum: str | None,
    ):
        """Gives a drive other poses.

        Args:
            sequence: of N scans.
            X_WS: (N, 4, 4).
            world_frame: name of W.
            datum: see `Sequence.datum`.
        """
        super().__init__(sequence)
        self.world_frame = world_frame
        self._X_WS = X_WS
        self._datum = datum

    @property
    def X_WS(self) -> np.ndarray:
        return self._X_WS

    def scan(self, index: int) -> np.ndarray:
        return self._sequence.scan(index)

    @property
    def datum(self) -> str | None:
        return self._datum

    @property
    def notes(self) -> tuple[str, ...]:
        return self._sequence.notes

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        return self._sequence.instances
