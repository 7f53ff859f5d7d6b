"""A drive with the times, poses and scenario of another one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cns_drake.base.drives.drive import Drive


class DriveView(Drive):
    """Has the length, times, poses and scenario of another drive."""

    def __init__(self, drive: Drive):
        """Begins with the other drive.

        Args:
            drive: the drive.
        """
        self.name = drive.name
        self._drive = drive

    def __len__(self) -> int:
        return len(self._drive)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._drive.stamps_ns

    @property
    def X_WS(self) -> np.ndarray:
        return self._drive.X_WS

    @property
    def scenario(self) -> Mapping | None:
        return self._drive.scenario
