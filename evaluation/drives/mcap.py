"""Recordings in MCAP files, as cns-drake and rosbag2 write them."""

from cns_drake.drives import McapDrive, holds_mcap
from evaluation.drives.data_set import DataSet

DATA_SET = DataSet("MCAP", holds_mcap, McapDrive, has_lidars=True)
