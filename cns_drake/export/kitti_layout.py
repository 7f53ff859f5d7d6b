"""The layout of KITTI odometry, with labels as SemanticKITTI adds them.

Frames: world W, LiDAR S (S0 at the first scan), camera C. There is no camera;
C is the LiDAR's frame with a camera's axes (x right, y down, z forward), as
tools for KITTI expect.
"""

from __future__ import annotations

from pathlib import PurePosixPath
import re

import numpy as np

from cns_drake.base import poses
from cns_drake.base.cloud_writing import encode_bin, encode_labels
from cns_drake.base.recordings.mcap_drive import McapDrive
from cns_drake.export.drive_layout import (
    Layout,
    imu_files,
    join_rows,
    scenario_files,
    seconds,
    structure_files,
)

_X_CS = np.array(
    [
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
_PROJECTION = np.eye(4)


def _number(drive: McapDrive) -> str:
    """Returns the drive's number: the digits its name ends with, or 00.

    The second LiDAR of a recording adds 100, the third 200: tools for KITTI
    want numbers.
    """
    digits = re.findall(r"\d*$", drive.name)[0]
    lidar = drive.lidar_names.index(drive.lidar_name)
    return f"{100 * lidar + int(digits or 0):02d}"


def _name(drive: McapDrive) -> str:
    """Returns the drive's name; later LiDARs add their own name."""
    if drive.lidar_name == drive.lidar_names[0]:
        return drive.name
    return f"{drive.name}_{drive.lidar_name}"


def _drive_folder(drive: McapDrive) -> PurePosixPath:
    return PurePosixPath("sequences", _number(drive))


def _outer_files(drive: McapDrive) -> dict[str, str]:
    return {f"poses/{_number(drive)}.txt": _poses(drive)}


def _inner_files(drive: McapDrive) -> dict[str, str]:
    elapsed_ns = drive.stamps_ns - drive.stamps_ns[0]
    calibration = {f"P{camera}": _PROJECTION for camera in range(4)}
    calibration["Tr"] = _X_CS
    return {
        # Readers of KITTI look in `poses`, those of SemanticKITTI here.
        "poses.txt": _poses(drive),
        "times.txt": "".join(f"{seconds(ns)}\n" for ns in elapsed_ns.tolist()),
        "calib.txt": "".join(
            f"{name}: {_rows(X[None])}" for name, X in calibration.items()
        ),
        "first_pose.txt": _rows(drive.X_WS[:1]),
        **imu_files(drive),
        **structure_files(drive),
        **scenario_files(drive, _name(drive)),
    }


def _scan_files(
    frame: int, stamp_ns: int, scan: np.ndarray
) -> dict[str, bytes]:
    del stamp_ns
    files = {f"velodyne/{frame:06d}.bin": encode_bin(scan)}
    if {"label", "instance"} <= set(scan.dtype.names or ()):
        files[f"labels/{frame:06d}.label"] = encode_labels(scan)
    return files


def _poses(drive: McapDrive) -> str:
    """Returns X_C0C of each scan as a row of text."""
    X_S0S = poses.inverse(drive.X_WS[0]) @ drive.X_WS
    return _rows(_X_CS @ X_S0S @ poses.inverse(_X_CS))


def _rows(X: np.ndarray) -> str:
    """Returns the upper 3 x 4 of each pose (N, 4, 4) as a row of text."""
    return join_rows(X[:, :3].reshape(-1, 12).tolist(), " ")


KITTI = Layout(
    files={
        "<NN>": "the drive's number, plus 100 for the second LiDAR of its"
        " recording, plus 200 for the third",
        "poses/<NN>.txt": "upper 3 x 4 of the camera's pose in its frame at"
        " the first scan, a row a scan",
        "sequences/<NN>/poses.txt": "the same, at the place where tools for "
        "SemanticKITTI look",
        "sequences/<NN>/calib.txt": "Tr: upper 3 x 4 of the LiDAR's pose in"
        " the camera's frame. There is no camera: its axes (right, down,"
        " forward) are put into the LiDAR, and P0 to P3 are the identity",
        "sequences/<NN>/times.txt": "seconds since the first scan",
        "sequences/<NN>/velodyne/<frame>.bin": "x, y, z [m] and intensity,"
        " float32, in the LiDAR's frame",
        "sequences/<NN>/labels/<frame>.label": "uint32 a point: class (id of "
        "SemanticKITTI) + 65536 * "
        "instance; 252 to 259 for "
        "structures that are absent "
        "in another stage (absent_in "
        "in structures.json)",
        "sequences/<NN>/first_pose.txt": "upper 3 x 4 of the LiDAR's pose in"
        " the world at the first scan, the same world for all drives of a"
        " map",
        "sequences/<NN>/structures.json": "the table of instances, and the "
        "other stage in which they are "
        "absent, if asked for",
        "sequences/<NN>/imu.yaml": "noise of the IMU, if it has noise, as"
        " Kalibr has it",
        "sequences/<NN>/scenario.yaml": "what was simulated",
    },
    drive_folder=_drive_folder,
    outer_files=_outer_files,
    inner_files=_inner_files,
    scan_files=_scan_files,
    shared_outer_files=False,
    has_labels=True,
)
