"""Recordings in bags of ROS, as cns-drake and robots write them."""

from functools import partial
from pathlib import Path

from evaluation.drives.data_set import DataSet
from evaluation.drives.mcap_drive import (
    McapDrive,
    holds_mcap,
)
from evaluation.drives.trajectories import read_trajectory


def open_bag(
    path: Path,
    lidar: str | None = None,
    odometry: str | None = None,
    poses: Path | None = None,
) -> McapDrive:
    """Opens a bag; the arguments are those of `open_drive`."""
    given = None if poses is None else partial(read_trajectory, Path(poses))
    return McapDrive(path, lidar, odometry, given)


DATA_SET = DataSet(
    "MCAP",
    holds_mcap,
    open_bag,
    (
        "the bag: an `.mcap`, `.db3` or `.bag` file, or the folder with it:"
        " recordings of cns-drake, and others with a topic of `PointCloud2`"
        " and one of poses"
    ),
    has_lidars=True,
)
