"""The source of a drive, which opens and identifies it.

A job that works on a drive may run in another process, or on another
machine, before or after the drive is recorded. The job therefore has the source
of the drive, not the drive.
"""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path
from typing import Protocol

from cns_drake.base.errors import InputError
from evaluation.drives import Drive, open_drive


class DriveSource(Protocol):
    """Opens a drive; can be pickled."""

    def __call__(self) -> Drive:
        """Opens the drive.

        Its scans are read in increasing order, each once; a drive may thus
        be made while it is read.

        Raises:
            InputError: if it cannot be opened.
        """

    def identity(self) -> object:
        """Returns the identity of the drive, ready for JSON.

        Results of a drive with an equal identity are not computed again.

        Raises:
            InputError: if there is no drive.
        """


@dataclass(frozen=True)
class RecordedDrive:
    """A drive on disk, in any format that can be read.

    Attributes:
        path: of the drive.
        lidar: name of the LiDAR, for a drive with several.
    """

    path: Path
    lidar: str | None = None

    def __call__(self) -> Drive:
        return open_drive(self.path, self.lidar)

    def identity(self) -> list[list]:
        """Returns LiDAR, and name, size and time of change of each file.

        The content of the files would be the surest identity, but reading it
        takes as long as evaluating it.
        """
        try:
            path = self.path.resolve(strict=True)
            files = [path]
            if path.is_dir():
                files = sorted(p for p in path.rglob("*") if p.is_file())
            stats = [os.stat(file) for file in files]
        except OSError as error:
            raise InputError(
                f"{self.path}: {error.strerror or error}"
            ) from error
        chosen: list[list] = [] if self.lidar is None else [[self.lidar]]
        return chosen + [
            [
                path.name,
                file.relative_to(path).as_posix(),
                stat.st_size,
                stat.st_mtime_ns,
            ]
            for file, stat in zip(files, stats, strict=True)
        ]
