"""The layout of MulRan."""

from pathlib import PurePosixPath

from cns_drake.base import encode_bin, poses
from cns_drake.drives import ORIGIN, X_BS, McapDrive
from cns_drake.export.layout import (
    Layout,
    checked_name,
    imu_files,
    scenario_files,
    stamped_rows,
)


def _inner_files(drive: McapDrive) -> dict[str, str]:
    # The vehicle is where MulRan's mount of the LiDAR has it below this LiDAR.
    X_UB = drive.X_WS @ poses.inverse(X_BS)
    X_UB[:, :3, 3] += ORIGIN
    rows = X_UB[:, :3].reshape(-1, 12)
    return {
        "global_pose.csv": stamped_rows(drive.stamps_ns.tolist(), [rows], ","),
        **imu_files(drive),
        **scenario_files(drive),
    }


MULRAN = Layout(
    lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    _inner_files,
    scan_files=lambda _, frame, stamp_ns, scan: {
        f"Ouster/{stamp_ns}.bin": encode_bin(scan)
    },
)
