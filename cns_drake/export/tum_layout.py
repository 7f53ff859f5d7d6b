"""The TUM format, which contains only trajectories."""

from pathlib import PurePosixPath

from cns_drake.export.layout import (
    Layout,
    checked_name,
    imu_files,
    lidar_poses,
    seconds_text,
    stamped_rows,
    vehicle_notes,
    vehicle_poses,
)
from evaluation.drives import Drive


def _inner_files(drive: Drive) -> dict[str, str]:
    trajectories = {
        "base_link.tum": vehicle_poses(drive),
        "lidar.tum": lidar_poses(drive),
    }
    files = {
        name: stamped_rows(
            map(seconds_text, one.stamps_ns.tolist()), one.columns, " "
        )
        for name, one in trajectories.items()
        if one is not None
    }
    return files | imu_files(drive)


LAYOUT = Layout(
    {
        "<drive>/base_link.tum": (
            "timestamp tx ty tz qx qy qz qw: pose of the vehicle's frame "
            "(on the ground, under the LiDAR; forward, left, up) in the "
            "world, one row for each message of the odometry; seconds and "
            "metres; missing for a drive without odometry"
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
    notes=vehicle_notes,
)
