"""The layout of MulRan."""

from pathlib import PurePosixPath

from cns_drake.export.layout import (
    Layout,
    checked_name,
    imu_files,
    scenario_files,
    stamped_rows,
    world_notes,
)
from evaluation.base import encode_bin, poses
from evaluation.drives import ORIGIN, X_BS, Drive


def _inner_files(drive: Drive) -> dict[str, str]:
    # The vehicle is where MulRan's mount of the LiDAR has it below this LiDAR.
    X_UB = drive.X_WS @ poses.inverse(X_BS)
    X_UB[:, :3, 3] += ORIGIN
    rows = X_UB[:, :3].reshape(-1, 12)
    return {
        "global_pose.csv": stamped_rows(drive.stamps_ns.tolist(), [rows], ","),
        **imu_files(drive),
        **scenario_files(drive),
    }


LAYOUT = Layout(
    {
        "<drive>/global_pose.csv": (
            "t, then the upper 3 x 4 of the pose of MulRan's vehicle, one "
            "row for each scan; t in nanoseconds. The pose follows from the"
            " LiDAR's pose by MulRan's calibration, which readers of MulRan"
            " apply. Coordinates are those of the map, with easting 350,000"
            " m and northing 4,020,000 m added (UTM, zone 52N)"
        ),
        "<drive>/Ouster/<t>.bin": (
            "x, y, z [m] and intensity, float32, in the LiDAR's frame at "
            "the time t; only returns; intensities have the unit of the "
            "recording"
        ),
        "<drive>/imu.yaml": (
            "noise of the IMU in Kalibr's format; missing for an IMU "
            "without noise"
        ),
        "<drive>/scenario.yaml": ("scenario of the drive, if it was simulated"),
    },
    lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    _inner_files,
    scan_files=lambda _, frame, stamp_ns, scan: {
        f"Ouster/{stamp_ns}.bin": encode_bin(scan)
    },
    notes=world_notes,
)
