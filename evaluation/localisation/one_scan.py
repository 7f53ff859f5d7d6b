"""A single point cloud as a query drive."""

from pathlib import Path

import numpy as np

from evaluation.clouds import read_cloud
from evaluation.drives import FileDrive


class OneScan(FileDrive):
    """A point cloud that is read as a drive: one scan at the origin of W."""

    def __init__(self, path: Path, columns: int | None = None):
        """Opens the point cloud.

        Args:
            path: its file.
            columns: number of columns of a `.bin` file, see `read_cloud`.
        """
        notes: list[str] = []
        scan = read_cloud(path, columns, notes.append)
        super().__init__(
            name=path.name,
            world_frame="map",
            files=[path],
            stamps_ns=np.zeros(1, np.int64),
            X_WS=np.eye(4)[None],
            read=lambda path, stamp_ns: scan,
            notes=tuple(notes),
        )

    def scan(self, index: int) -> np.ndarray:
        """Returns all points of the cloud, including points at the origin.

        Other drives leave out points at the origin, which stand for beams
        without a return. In this cloud, such a point can be real.
        """
        return self._read(self._files[index], 0)
