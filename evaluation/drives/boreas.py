"""Drives of the Boreas data set (Burnett et al., IJRR 2023).

    SEQ/lidar/<us>.bin               float32 x y z intensity laser time
    SEQ/applanix/lidar_poses.csv     us, x y z [m], velocity, roll pitch yaw
                                     [rad], angular velocity

The time of a scan is the middle of the scan; the time of a point is relative to
this time, in seconds. Angles describe the rotation of the world in the LiDAR's
frame S, as in the data set's development kit: Rz(yaw) Ry(pitch) Rx(roll) is
R_SW. All drives share W, whose axes point east, north and up. In the first
releases W was the UTM grid.
"""

from functools import partial
from pathlib import Path

import numpy as np

from evaluation.drives.data_set import DataSet
from evaluation.drives.scan_files import (
    FileDrive,
    OwnPoses,
    check_below,
    list_stamped,
    posed,
    read_packed,
)
from evaluation.drives.text_tables import parse_microseconds
from evaluation.drives.trajectories import read_angles
from evaluation.drives.utm_poses import is_local

_SCANS = "lidar"
_POSES = "applanix/lidar_poses.csv"
_NUM_LASERS = 128
_STORED = np.dtype(
    [(n, "<f4") for n in ("x", "y", "z", "intensity", "laser", "time")]
)
_POINT = np.dtype(
    [
        *((n, "<f4") for n in ("x", "y", "z", "intensity")),
        ("laser", "<u2"),
        ("t", "<i4"),
    ]
)
# Origin of W on the UTM grid, in Toronto [m]; chosen like the origin in
# `evaluation.drives.utm_poses.to_world`.
_ORIGIN = (620_000.0, 4_845_000.0, 0.0)


class BoreasDrive(FileDrive):
    """A drive of Boreas, with the scans of its LiDAR, an Alpha Prime."""

    def __init__(
        self,
        path: Path,
        columns: int | None = None,
        poses: Path | None = None,
        pose_gap: float | None = None,
    ):
        """Opens a drive.

        Args:
            path: its folder.
            columns: is ignored, because the layout is fixed.
            poses: file with poses of the LiDAR, which is read instead.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: there is no such drive, or its poses cannot be used.
        """
        files, stamps_ns = list_stamped(
            path / _SCANS, ".bin", parse_microseconds
        )
        super().__init__(
            path,
            posed(
                files,
                stamps_ns,
                partial(_own_poses, path / _POSES),
                poses,
                pose_gap,
            ),
            _read_scan,
            unit="alpha-prime",
        )


def _own_poses(path: Path) -> OwnPoses:
    """Returns the poses in a table of the data set."""
    trajectory = read_angles(path, num_velocities=3)
    X_WS = trajectory.X_WB
    X_WS[:, :3, :3] = np.swapaxes(X_WS[:, :3, :3], 1, 2)
    local = is_local(X_WS)
    if not local:
        X_WS[:, :3, 3] -= _ORIGIN
    frame = f"boreas/{'enu' if local else 'utm-17n'}"
    return OwnPoses(trajectory, frame, (path,))


def _read_scan(path: Path, stamp_ns: int) -> np.ndarray:
    stored = read_packed(path, _STORED)
    check_below(stored, "laser", _NUM_LASERS)
    points = np.empty(len(stored), _POINT)
    for name in ("x", "y", "z", "intensity", "laser"):
        points[name] = stored[name]
    points["t"] = np.rint(stored["time"] * 1e9)
    return points


def holds_boreas(path: Path) -> bool:
    """Returns whether a folder looks like a drive of Boreas."""
    # A drive of the benchmark has no poses.
    return (path / _POSES).parent.is_dir()


DATA_SET = DataSet(
    "Boreas",
    holds_boreas,
    BoreasDrive,
    ("the folder with `lidar` and `applanix`"),
)
