"""A drive that is mapped while it is read."""

import numpy as np

from evaluation.base import track
from evaluation.drives import Drive, RecentScans
from evaluation.maps.voxel_maps import CELL_SIZE, VoxelAccumulator, VoxelMap

# Divisions of a cell's side for pictures, with a point in each 0.5 m.
PICTURE_DIVISIONS = 2


class MappedDrive(RecentScans):
    """A drive that makes a map of its scans while they are read.

    If scans are requested in nearly increasing order, each scan is read only
    once.
    """

    def __init__(self, drive: Drive, kept: int):
        super().__init__(drive, kept)
        self._accumulator = VoxelAccumulator(CELL_SIZE, PICTURE_DIVISIONS)
        self._num_mapped = 0

    def scan(self, index: int) -> np.ndarray:
        while self._num_mapped <= index:
            self._map_next()
        return super().scan(index)

    def finish(self) -> tuple[VoxelMap, np.ndarray]:
        """Reads the remaining scans, so that the map is complete.

        Returns:
            The map of all scans, in voxels of 1 m from which the change ratio
            (TCR) is computed; and a finer cloud (K, 3) for pictures, in W [m].
        """
        left = range(self._num_mapped, len(self))
        for _ in track(left, f"mapping {self.name}", len(left), "scans"):
            self._map_next()
        return self._accumulator.to_map(), self._accumulator.samples()

    def _map_next(self) -> None:
        scan = super().scan(self._num_mapped)
        self._accumulator.add(scan, self.X_WS[self._num_mapped])
        self._num_mapped += 1
