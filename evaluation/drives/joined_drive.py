"""Several drives through one world as a single drive."""

from collections.abc import Callable, Sequence

import numpy as np

from evaluation.base import InputError
from evaluation.drives.drive import Drive
from evaluation.drives.same_world import check_same_world
from evaluation.drives.sampling import sample_frames


class JoinedDrive(Drive):
    """The scans of several drives, one drive after the other.

    Only one drive at a time is open, because a simulated drive keeps its world
    in memory.

    Attributes:
        starts: (P + 1,) first frame of each of the P drives; the last entry is
            the number of frames of all drives.
    """

    has_own_world = False  # It is that of the first drive.

    def __init__(self, sources: Sequence[Callable[[], Drive]]):
        """Opens each drive once, for its poses.

        Args:
            sources: functions that open the drives, from older to newer.

        Raises:
            InputError: there is no drive, one cannot be opened, or they are
                in different worlds.
        """
        if not sources:
            raise InputError("no drive is given to be joined")
        self._sources = sources
        stamps, poses = [], []
        for number in range(len(sources)):
            drive = self._open(number)
            if number == 0:
                self.name = drive.name
                self.world_frame = drive.world
            else:
                check_same_world(self, drive, across_maps=True)
            stamps.append(drive.stamps_ns)
            poses.append(drive.X_WS)
        self.starts = np.cumsum([0, *map(len, stamps)])
        # Drives of different years have the same times; a frame has one stamp.
        ends = np.cumsum([0, *(int(of_drive[-1]) + 1 for of_drive in stamps)])
        self._stamps_ns = np.concatenate(
            [
                of_drive + end
                for of_drive, end in zip(stamps, ends[:-1], strict=True)
            ]
        )
        self._X_WS = np.concatenate(poses)

    def __len__(self) -> int:
        return len(self._X_WS)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._stamps_ns

    @property
    def X_WS(self) -> np.ndarray:
        return self._X_WS

    def scan(self, index: int) -> np.ndarray:
        number = int(self.drive_of(np.array(index)))
        if number != self._number:
            self._open(number)
        return self._drive.scan(index - int(self.starts[number]))

    def drive_of(self, frames: np.ndarray) -> np.ndarray:
        """Returns the number of the drive to which each frame belongs."""
        return np.searchsorted(self.starts, frames, side="right") - 1

    def sampled(self, spacing: float) -> np.ndarray:
        """Returns frames (K,) of each drive at equal distances along its path.

        Args:
            spacing: distance driven between two frames [m].
        """
        ends = zip(self.starts[:-1], self.starts[1:], strict=True)
        return np.concatenate(
            [
                start + sample_frames(self._X_WS[start:end, :3, 3], spacing)
                for start, end in ends
            ]
        )

    def _open(self, number: int) -> Drive:
        self._number = number
        self._drive = self._sources[number]()
        return self._drive
