"""Sources of drives: what opens a drive in the process of a job.

A job that works on a drive may run in another process, or on another machine,
before or after the drive is recorded. The job therefore gets the source of the
drive, a function that opens the drive, instead of the drive.
"""

from dataclasses import dataclass, field
import hashlib
from pathlib import Path
from typing import Protocol

import numpy as np

from evaluation.base import file_digests
from evaluation.drives.drive import Drive
from evaluation.drives.drive_views import MovedDrive
from evaluation.drives.joined_drive import JoinedDrive
from evaluation.drives.opening import Reading


class DriveSource(Protocol):
    """A picklable function that opens a drive.

    A job in another process gets this function instead of the drive.
    """

    def __call__(self) -> Drive:
        """Opens the drive.

        Jobs read its scans in increasing order, each once. A drive can
        therefore be simulated while it is read.

        Raises:
            InputError: if the drive cannot be opened.
        """

    def identity(self) -> object:
        """Returns the identity of the drive, ready for JSON.

        If the identity of a drive has not changed, its results are not computed
        again.

        Raises:
            InputError: if there is no drive.
        """


@dataclass(frozen=True)
class Placement:
    """Poses of a drive that was aligned to another.

    Attributes:
        X_WS: (N, 4, 4) poses of the LiDAR in the common world.
        world_frame: name of the common world.
        digest: digest of the poses.
    """

    X_WS: np.ndarray = field(compare=False)
    world_frame: str
    digest: str

    @classmethod
    def of(cls, drive: Drive) -> "Placement":
        """Returns where a drive is."""
        digest = hashlib.sha256(drive.X_WS.tobytes()).hexdigest()
        return cls(drive.X_WS, drive.world, digest)


@dataclass(frozen=True)
class RecordingSource:
    """The source of a recorded drive, in any format that `open_drive` reads.

    An object is called without arguments, and returns the opened `Drive`.

    Attributes:
        path: file or folder of the recording.
        reading: how it is read.
        placement: where the drive is, if it was aligned to another.
    """

    path: Path
    reading: Reading = field(default_factory=Reading)
    placement: Placement | None = None

    def __call__(self) -> Drive:
        drive = self.reading.open(self.path)
        to = self.placement
        if to is None:
            return drive
        return MovedDrive(drive, to.X_WS, to.world_frame, drive.datum)

    def identity(self) -> list[list]:
        """Returns what identifies the recording: its options and its files.

        The reader of the recording names the files. Each file is identified by
        its name and its content.
        """
        drive = self()
        names = [file.name for file in drive.files]
        how = {k: v for k, v in vars(self.reading).items() if v is not None}
        if self.placement is not None:
            how["placement"] = self.placement.digest
        # A file of poses counts by its content, as all files.
        how.pop("poses", None)
        # Behind a slash, local frames name their file.
        frame = drive.world_frame.partition("/")[0]
        return [
            [drive.name, frame, how],
            *map(list, zip(names, file_digests(drive.files), strict=True)),
        ]


@dataclass(frozen=True)
class JoinedSource:
    """The source of a database of several drives, as one drive.

    Attributes:
        sources: the sources of the drives, from older to newer.
        keep: which frames are kept in a map of the database, see
            `evaluation.recognition.place_selection.kept_places`.
    """

    sources: tuple[DriveSource, ...]
    keep: str | int

    def __call__(self) -> JoinedDrive:
        return JoinedDrive(self.sources)

    def identity(self) -> list[object]:
        """Returns the identities of the drives, and what is kept."""
        return [*(one.identity() for one in self.sources), self.keep]
