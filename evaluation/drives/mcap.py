"""Recordings in MCAP files, as cns-drake and rosbag2 write them."""

from cns_drake.drives import McapDrive, holds_mcap
from evaluation.drives.data_set import DataSet

DATA_SET = DataSet(
    "MCAP",
    holds_mcap,
    McapDrive,
    (
        "the folder with the `.mcap` file, or the file: recordings of cns-"
        "drake, and other files with a `PointCloud2` topic, and `/odometry`"
        " at the same stamps"
    ),
    has_lidars=True,
)
