"""The layout of KITTI odometry, with the labels of SemanticKITTI."""

from collections.abc import Iterator
from pathlib import PurePosixPath
import re

import numpy as np

from cns_drake.export.layout import (
    Layout,
    imu_files,
    scenario_files,
    seconds_text,
)
from evaluation.base import encode_bin, poses
from evaluation.drives import POSES_FRAME, Drive

# Pose of the LiDAR S in KITTI's camera frame C: x right, y down, z ahead.
_X_CS = np.array(
    [
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
# Projection matrix of each camera, of which there is none.
_PROJECTION = np.eye(4)


def _drive_number(drive: Drive) -> str:
    """Returns the number of a drive: the digits at the end of its name, or 00.

    The second LiDAR of a recording adds 100, and the third 200, since tools for
    KITTI expect numbers.
    """
    digits = re.findall(r"\d*$", drive.session)[0]
    return f"{100 * _lidar_number(drive) + int(digits or 0):02d}"


def _lidar_number(drive: Drive) -> int:
    """Returns the place of a drive's LiDAR among those of the recording."""
    names = drive.lidar_names
    return names.index(drive.lidar_name) if names else 0


def _inner_files(drive: Drive) -> dict[str, str]:
    elapsed_ns = drive.stamps_ns - drive.stamps_ns[0]
    # LiDARs after the first one add their own name.
    lidar = drive.lidar_name.strip("/").replace("/", "_")
    name = f"{drive.name}_{lidar}" if _lidar_number(drive) else drive.name
    calibration = {f"P{camera}": _PROJECTION for camera in range(4)}
    calibration["Tr"] = _X_CS
    return {
        # Readers of KITTI look for it in `poses`, and those of SemanticKITTI
        # here.
        "poses.txt": _poses_text(drive),
        "times.txt": "".join(
            f"{seconds_text(ns)}\n" for ns in elapsed_ns.tolist()
        ),
        "calib.txt": "".join(
            f"{key}: {_pose_rows(X[None])}" for key, X in calibration.items()
        ),
        # Without it, readers align the drive by its scans.
        **(
            {}
            if drive.is_local
            else {"first_pose.txt": _pose_rows(drive.X_WS[:1])}
        ),
        **imu_files(drive),
        **scenario_files(drive, name),
    }


def _with_kitti_intensities(drive: Drive, scan: np.ndarray) -> np.ndarray:
    """Returns a scan with its intensities in KITTI's scale, if known.

    A calibrated intensity from 0 to 255 is divided by 256, rounded to
    hundredths and limited to 0.99, as in the scans of KITTI odometry 00.
    Calibrated intensities of the preset `hdl-64e` already count hundredths.
    Ideal intensities, from 0 to 1, stay as they are. Intensities of other
    recorders, whose unit is not known, also stay as they are.
    """
    if drive.lidar_section.get("returns") != "calibrated":
        return scan
    # The intensities of this preset are fitted to KITTI's hundredths.
    is_kittis = drive.lidar_section.get("preset") == "hdl-64e"
    hundredths = scan["intensity"] * (1.0 if is_kittis else 100.0 / 256.0)
    scaled = scan.copy()
    scaled["intensity"] = np.minimum(np.rint(hundredths), 99.0) / 100.0
    return scaled


def _notes(drive: Drive) -> Iterator[str]:
    if drive.world_frame.startswith(f"{POSES_FRAME}/"):
        yield (
            f"{drive.name}: first_pose.txt says that drives with such a file"
            " share the frame of their poses; delete it if each has its own"
        )
    scan = drive.scan(0)
    if (
        not drive.lidar_section
        and "intensity" in (scan.dtype.names or ())
        and scan["intensity"].max(initial=0.0) > 1.0
    ):
        yield (
            f"{drive.name}: intensities above 1 are written as recorded; those"
            " of KITTI end at 0.99"
        )


def _scan_files(
    drive: Drive, frame: int, stamp_ns: int, scan: np.ndarray
) -> dict[str, bytes]:
    scan = _with_kitti_intensities(drive, scan)
    files = {f"velodyne/{frame:06d}.bin": encode_bin(scan)}
    if {"label", "instance"} <= set(scan.dtype.names or ()):
        files[f"labels/{frame:06d}.label"] = encode_labels(scan)
    return files


def _poses_text(drive: Drive) -> str:
    """Returns the poses X_C0C of all scans, one row of text each."""
    X_S0S = poses.inverse(drive.X_WS[0]) @ drive.X_WS
    return _pose_rows(_X_CS @ X_S0S @ poses.inverse(_X_CS))


def _pose_rows(X: np.ndarray) -> str:
    """Returns the upper 3 x 4 of poses (N, 4, 4), one row of text each."""
    rows = X[:, :3].reshape(-1, 12).tolist()
    return "".join(f"{' '.join(map(repr, row))}\n" for row in rows)


_EXPLAINED = {
    "<NN>": (
        "number of the drive, plus 100 for the second LiDAR of the "
        "recording or 200 for the third; or the number that --sequence "
        "gives"
    ),
    "poses/<NN>.txt": (
        "upper 3 x 4 of the camera's pose, in the camera's frame at the"
        " first scan; one row for each scan"
    ),
    "sequences/<NN>/poses.txt": (
        "copy of poses/<NN>.txt, which tools for SemanticKITTI read"
    ),
    "sequences/<NN>/calib.txt": (
        "Tr: upper 3 x 4 of the LiDAR's pose in the camera's frame. The"
        " drive has no camera: the camera's axes (right, down, forward)"
        " are placed in the LiDAR, and P0 to P3 are the identity"
    ),
    "sequences/<NN>/times.txt": ("seconds since the first scan"),
    "sequences/<NN>/velodyne/<frame>.bin": (
        "x, y, z [m] and intensity, float32, in the LiDAR's frame at "
        "the time of the scan. Calibrated intensities have KITTI's "
        "scale: a byte / 256 in hundredths, at most 0.99. Ideal "
        "intensities are from 0 to 1"
    ),
    "sequences/<NN>/labels/<frame>.label": (
        "one uint32 for each point: class (id of SemanticKITTI) + 65536"
        " * instance; 252 to 259 for structures that are absent in "
        "another stage (absent_in in structures.json)"
    ),
    "sequences/<NN>/first_pose.txt": (
        "upper 3 x 4 of the LiDAR's pose in the world at the first "
        "scan; all drives of a map have the same world"
    ),
    "sequences/<NN>/structures.json": (
        "table of the instances; with --absent-in, also the other stage"
        " from which an instance is absent"
    ),
    "sequences/<NN>/imu.yaml": (
        "noise of the IMU in Kalibr's format; missing for an IMU without noise"
    ),
    "sequences/<NN>/scenario.yaml": (
        "scenario of the drive, if it was simulated"
    ),
}


def _layout(number: str | None = None) -> Layout:
    """Returns the layout of KITTI odometry.

    Args:
        number: number of the sequence, as text. By default the digits at the
            end of the drive's name; the second LiDAR of a recording adds 100,
            the third 200.
    """

    def number_of(drive: Drive) -> str:
        return number or _drive_number(drive)

    return Layout(
        _EXPLAINED,
        lambda drive: PurePosixPath("sequences", number_of(drive)),
        _inner_files,
        outer_files=lambda drive: {
            f"poses/{number_of(drive)}.txt": _poses_text(drive)
        },
        scan_files=_scan_files,
        has_labels=True,
        notes=_notes,
        numbered=_layout,
    )


LAYOUT = _layout()


def encode_labels(scan: np.ndarray) -> bytes:
    """Returns a scan's labels as SemanticKITTI stores them.

    Each point is a uint32: label + 2^16 * instance.
    """
    label = scan["label"].astype("<u4")
    return (label | scan["instance"].astype("<u4") << 16).tobytes()
