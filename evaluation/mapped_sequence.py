"""A drive that is mapped while its scans are read for another purpose."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping

import numpy as np

from evaluation.maps import VoxelAccumulator, VoxelMap
from evaluation.progress import Track, silent
from evaluation.sequences.sequence import Sequence


class MappedSequence(Sequence):
    """A sequence whose scans enter a map as they are read for the first time.

    Reading and unpacking scans takes longer than mapping them. Who asks for
    scans in increasing order, give or take a few, has each read once.
    """

    def __init__(self, sequence: Sequence, voxel_size: float, kept: int):
        """Starts an empty map.

        Args:
            sequence: the drive.
            voxel_size: of the map [m].
            kept: how many of the last scans stay in memory; older ones are
                read again.
        """
        self.name = sequence.name
        self._sequence = sequence
        self._accumulator = VoxelAccumulator(voxel_size)
        self._kept = kept
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()
        self._num_mapped = 0

    def __len__(self) -> int:
        return len(self._sequence)

    @property
    def world_frame(self) -> str:
        return self._sequence.world_frame

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
        while self._num_mapped <= index:
            self._map_next()
        if index in self._recent:
            return self._recent[index]
        return self._sequence.scan(index)

    def finish(self, track: Track = silent) -> VoxelMap:
        """Reads what nobody asked for; returns the map of all scans.

        Args:
            track: reports progress.
        """
        left = range(self._num_mapped, len(self))
        for _ in track(left, f"mapping {self.name}", len(left)):
            self._map_next()
        return self._accumulator.to_map()

    def _map_next(self) -> None:
        index = self._num_mapped
        scan = self._sequence.scan(index)
        self._accumulator.add(scan, self.X_WS[index])
        self._recent[index] = scan
        if len(self._recent) > self._kept:
            self._recent.popitem(last=False)
        self._num_mapped += 1
