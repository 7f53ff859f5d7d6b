"""Views of another drive: at other poses, or with scans kept in memory."""

from collections import OrderedDict
from collections.abc import Mapping

import numpy as np

from evaluation.base import xyz
from evaluation.drives.drive import Drive
from evaluation.drives.lidar_fields import LidarField


class DriveView(Drive):
    """Base of drives that wrap another drive and change some of its data."""

    def __init__(self, drive: Drive):
        """Wraps another drive."""
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
    def image_stamps_ns(self) -> np.ndarray:
        return self._drive.image_stamps_ns

    def image(self, index: int) -> bytes:
        return self._drive.image(index)

    @property
    def scenario(self) -> Mapping | None:
        return self._drive.scenario

    @property
    def lidar_field(self) -> LidarField | None:
        return self._drive.lidar_field


class MovedDrive(DriveView):
    """The scans of another drive at corrected poses."""

    has_own_world = False  # Its world is that which its maker names.

    def __init__(
        self,
        drive: Drive,
        X_WS: np.ndarray,
        world_frame: str,
        datum: str | None,
    ):
        """Wraps a drive and replaces its poses.

        Args:
            drive: drive of N scans.
            X_WS: (N, 4, 4) new poses of the LiDAR in the world.
            world_frame: name of W.
            datum: name of the survey grid in which W lies; None if there is
                none.
        """
        super().__init__(drive)
        self.world_frame = world_frame
        self._X_WS = X_WS
        self._datum = datum

    @property
    def X_WS(self) -> np.ndarray:
        return self._X_WS

    def scan(self, index: int) -> np.ndarray:
        return self._drive.scan(index)

    @property
    def datum(self) -> str | None:
        return self._datum

    @property
    def notes(self) -> tuple[str, ...]:
        return self._drive.notes

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        return self._drive.instances


# Note on scans or a cloud, after the number of points.
NOT_FINITE = "points are not finite, and left out"


class CountedDrive(MovedDrive):
    """A view of a drive that counts the points that are not finite.

    Attributes:
        num_ignored: number of points that are not finite, in the scans that
            were read.
    """

    def __init__(self, drive: Drive):
        super().__init__(drive, drive.X_WS, drive.world, drive.datum)
        self._ignored: dict[int, int] = {}

    def scan(self, index: int) -> np.ndarray:
        scan = super().scan(index)
        finite = np.isfinite(xyz(scan)).all(axis=1)
        self._ignored[index] = len(scan) - int(finite.sum())
        return scan

    @property
    def num_ignored(self) -> int:
        return sum(self._ignored.values())


class RecentScans(DriveView):
    """A view of a drive that keeps recently read scans in memory.

    Each scan is read from the drive only once if a program asks for scans in
    increasing order, or goes back by fewer scans than are kept.
    """

    def __init__(self, drive: Drive, kept: int):
        """Wraps a drive; no scan is in memory yet.

        Args:
            drive: the drive.
            kept: number of scans that stay in memory; older scans are read
                again if needed.
        """
        super().__init__(drive)
        self._kept = kept
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()

    @property
    def world_frame(self) -> str:  # type: ignore[override]  # Read late.
        return self._drive.world_frame

    @property
    def world(self) -> str:
        return self._drive.world

    def scan(self, index: int) -> np.ndarray:
        if index not in self._recent:
            self._recent[index] = self._drive.scan(index)
            if len(self._recent) > self._kept:
                self._recent.popitem(last=False)
        return self._recent[index]
