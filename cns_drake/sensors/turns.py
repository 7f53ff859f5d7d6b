"""The beams of each turn of a LiDAR."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cns_drake.sensors.beam_pattern import BeamPattern, Beams
from cns_drake.sensors.point_assembly import BeamTable
from cns_drake.sensors.returns.calibrated import CalibratedTurn


class Turn:
    """The beams of a turn, ready for casting and assembling.

    Attributes:
        frame: number of the turn.
        beams: in firing order.
        d_Sset_cast: (N, 3) directions in the order of casting.
        table: what beams add to points.
    """

    def __init__(self, frame: int, beams: Beams):
        self.frame = frame
        self.beams = beams
        self.d_Sset_cast = beams.d_Sset[beams.packet_order]
        self.table = BeamTable(
            beams.d_Sset.astype(np.float32),
            beams.ring,
            beams.t_ns,
            np.argsort(beams.packet_order),
        )

    @cached_property
    def calibrated(self) -> CalibratedTurn:
        """The same for calibrated returns."""
        return CalibratedTurn(self.beams)


class Turns:
    """The turns of a pattern.

    Attributes:
        pattern: of the beams.
        first: the turn of frame 0.
        times: (T,) firing time of each column, as a part of a turn.
    """

    def __init__(self, pattern: BeamPattern):
        self.pattern = pattern
        self.first = self._latest = Turn(0, pattern.beams(0))
        self.times = self.first.beams.column_t_ns / (pattern.period * 1e9)

    def at(self, time: float) -> tuple[int, Turn]:
        """Returns the number and the beams of the turn that starts at a time.

        Args:
            time: of the start [s].
        """
        frame = round(time / self.pattern.period)
        if self.pattern.repeats:
            return frame, self.first
        if self._latest.frame != frame:
            self._latest = Turn(frame, self.pattern.beams(frame))
        return frame, self._latest
