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


TUM = Layout(
    lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    _inner_files,
)
