"""The TUM format, which contains only trajectories."""

from pathlib import PurePosixPath

from scipy.spatial.transform import Rotation

from cns_drake.drives import McapDrive
from cns_drake.export.layout import (
    Layout,
    checked_name,
    imu_files,
    odometry_columns,
    seconds_text,
    stamped_rows,
)


def _inner_files(drive: McapDrive) -> dict[str, str]:
    X_WB, X_WS = drive.odometry, drive.X_WS
    quat_WS = Rotation.from_matrix(X_WS[:, :3, :3]).as_quat(canonical=True)
    return {
        "base_link.tum": stamped_rows(
            map(seconds_text, X_WB["stamp_ns"].tolist()),
            odometry_columns(drive),
            " ",
        ),
        "lidar.tum": stamped_rows(
            map(seconds_text, drive.stamps_ns.tolist()),
            [X_WS[:, :3, 3], quat_WS],
            " ",
        ),
        **imu_files(drive),
    }


LAYOUT = Layout(
    {
        "<drive>/base_link.tum": (
            "timestamp tx ty tz qx qy qz qw: pose of the vehicle's frame "
            "(on the ground, under the LiDAR; forward, left, up) in the "
            "world, one row for each message of the odometry; seconds and "
            "metres"
        ),
        "<drive>/lidar.tum": (
            "timestamp tx ty tz qx qy qz qw: pose of the LiDAR in the "
            "world, one row for each scan; seconds and metres"
        ),
        "<drive>/imu.yaml": (
            "noise of the IMU in Kalibr's format; missing for an IMU "
            "without noise"
        ),
    },
    lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    _inner_files,
)
