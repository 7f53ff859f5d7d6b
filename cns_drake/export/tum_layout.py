"""Trajectories as the TUM RGB-D benchmark has them, without the scans.

A row is `timestamp tx ty tz qx qy qz qw`: seconds, metres, and the unit
quaternion of the orientation. Frames: world W, vehicle B, LiDAR S.
"""

from __future__ import annotations

from pathlib import PurePosixPath

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base.recordings.mcap_drive import McapDrive
from cns_drake.export.drive_layout import (
    Layout,
    checked_name,
    imu_files,
    seconds,
    unit_quaternions,
)


def _drive_folder(drive: McapDrive) -> PurePosixPath:
    return PurePosixPath(checked_name(drive, drive.name))


def _inner_files(drive: McapDrive) -> dict[str, str]:
    X_WB = drive.odometry
    X_WS = drive.X_WS
    R_WS = Rotation.from_matrix(X_WS[:, :3, :3])
    return {
        "base_link.tum": _rows(
            X_WB["stamp_ns"], X_WB["position"], unit_quaternions(drive)
        ),
        "lidar.tum": _rows(
            drive.stamps_ns, X_WS[:, :3, 3], R_WS.as_quat(canonical=True)
        ),
        **imu_files(drive),
    }


def _rows(
    stamps_ns: np.ndarray, position: np.ndarray, quat_xyzw: np.ndarray
) -> str:
    """Returns N poses as rows; (N,) [ns], (N, 3) [m] and (N, 4)."""
    numbers = np.hstack([position, quat_xyzw]).tolist()
    return "".join(
        f"{seconds(stamp_ns)} {' '.join(map(repr, row))}\n"
        for stamp_ns, row in zip(stamps_ns.tolist(), numbers, strict=True)
    )


TUM = Layout(
    files={
        "<drive>/base_link.tum": "timestamp tx ty tz qx qy qz qw: pose of"
        " the vehicle's frame (on the ground, under the LiDAR; forward, left,"
        " up) in the world, a row for each message of the odometry; seconds"
        " and metres",
        "<drive>/lidar.tum": "pose of the LiDAR in the world, likewise, a"
        " row a scan",
        "<drive>/imu.yaml": "noise of the IMU, if it has noise, as Kalibr"
        " has it",
    },
    drive_folder=_drive_folder,
    outer_files=lambda drive: {},
    inner_files=_inner_files,
    scan_files=None,
    shared_outer_files=False,
    has_labels=False,
)
