"""A drive whose last scans stay in memory, for clouds of several scans."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from cns_drake.base.drives.drive import Drive
from evaluation.drives.drive_view import DriveView


class RecentScans(DriveView):
    """A drive that reads each scan once.

    This holds for a program that reads scans in increasing order, or goes back
    by at most as many scans as are kept.
    """

    def __init__(self, drive: Drive, kept: int):
        """Starts without a scan in memory.

        Args:
            drive: the drive.
            kept: number of the last scans that stay in memory.
        """
        super().__init__(drive)
        self.world_frame = drive.world_frame
        self._kept = kept
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()

    def scan(self, index: int) -> np.ndarray:
        if index not in self._recent:
            self._recent[index] = self._drive.scan(index)
            if len(self._recent) > self._kept:
                self._recent.popitem(last=False)
        return self._recent[index]
