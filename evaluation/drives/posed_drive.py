"""The scans of a drive, at poses from a file."""

from pathlib import Path

import numpy as np

from evaluation.drives.drive import Drive, poses_frame
from evaluation.drives.drive_views import MovedDrive
from evaluation.drives.trajectories import read_trajectory


class PosedDrive(MovedDrive):
    """The scans of a drive that a file of poses spans, at these poses.

    It is for data sets of plug-ins, whose readers take no file of poses.
    """

    def __init__(self, drive: Drive, path: Path, pose_gap: float | None = None):
        """Reads the poses.

        Args:
            drive: the drive.
            path: file with poses of the LiDAR, see `read_trajectory`.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: the file cannot be read, or has no pose for a scan.
        """
        path = Path(path)
        trajectory = read_trajectory(path, drive.stamps_ns)
        self._kept, X_WS, self._told = trajectory.at_scans(
            drive.stamps_ns, pose_gap
        )
        self._path = path
        super().__init__(drive, X_WS, poses_frame(path), None)

    def __len__(self) -> int:
        return len(self._X_WS)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._drive.stamps_ns[self._kept]

    def scan(self, index: int) -> np.ndarray:
        if not 0 <= index < len(self):
            raise IndexError(f"scan {index} of {len(self)}")
        return self._drive.scan(self._kept.start + index)

    @property
    def files(self) -> tuple[Path, ...]:
        return (*self._drive.files, self._path)

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self._drive.notes, *self._told)
