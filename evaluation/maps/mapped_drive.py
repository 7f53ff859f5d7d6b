"""Maps a drive while its scans are read for another purpose."""

from collections import OrderedDict

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.progress import Track, silent
from evaluation.drives.drive_views import DriveView
from evaluation.maps.voxel_maps import VOXEL_SIZE, VoxelAccumulator, VoxelMap

# Divisions of a voxel's side for pictures, with a point in each 0.5 m.
PICTURE_DIVISIONS = 10


class MappedDrive(DriveView):
    """A drive whose scans enter a map as they are read for the first time.

    Reading and unpacking scans takes longer than mapping them. In nearly
    increasing order, each scan is read only once.
    """

    def __init__(self, drive: Drive, kept: int):
        """Starts an empty map.

        Args:
            drive: the drive.
            kept: number of latest scans in memory; older ones are read again.
        """
        super().__init__(drive)
        self._accumulator = VoxelAccumulator(VOXEL_SIZE, PICTURE_DIVISIONS)
        self._kept = kept
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()
        self._num_mapped = 0

    @property
    def world_frame(self) -> str:  # type: ignore[override]  # Read late.
        return self._drive.world_frame

    def scan(self, index: int) -> np.ndarray:
        while self._num_mapped <= index:
            self._map_next()
        if index in self._recent:
            return self._recent[index]
        return self._drive.scan(index)

    def finish(self, track: Track = silent) -> tuple[VoxelMap, np.ndarray]:
        """Reads the scans that have not been read yet.

        Returns:
            The map of all scans on the grid of the TCR, as `map_drive`
            makes it; a finer cloud of them for pictures (K, 3) in W [m].
        """
        left = range(self._num_mapped, len(self))
        for _ in track(left, f"mapping {self.name}", len(left)):
            self._map_next()
        return self._accumulator.to_map(), self._accumulator.samples()

    def _map_next(self) -> None:
        index = self._num_mapped
        scan = self._drive.scan(index)
        self._accumulator.add(scan, self.X_WS[index])
        self._recent[index] = scan
        if len(self._recent) > self._kept:
            self._recent.popitem(last=False)
        self._num_mapped += 1
