"""Drives of the HeLiPR data set (Jung et al., IJRR 2024), with any LiDAR.

    SEQ/LiDAR/{Ouster,Velodyne,Avia,Aeva}/<ns>.bin   packed records
    SEQ/LiDAR_GT/{LiDAR}_gt.txt           ns x y z qx qy qz qw of X_LS
    SEQ/LiDAR_GT/global_{LiDAR}_gt.txt    the same in the UTM grid

Each scan has a pose of the LiDAR itself.
"""

from functools import partial
from pathlib import Path

import numpy as np

from evaluation.base import InputError
from evaluation.drives.data_set import DataSet
from evaluation.drives.drive import as_given
from evaluation.drives.lidar_fields import LidarField
from evaluation.drives.scan_files import (
    FileDrive,
    OwnPoses,
    check_below,
    list_stamped,
    posed,
    read_packed,
)
from evaluation.drives.trajectories import read_quaternions
from evaluation.drives.utm_poses import DATUM, to_world

_SCANS = "LiDAR"
_POSES = "LiDAR_GT"

_XYZ = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
_AEVA_EARLY = [
    *_XYZ,
    ("reflectivity", "<f4"),
    ("velocity", "<f4"),
    ("time_offset_ns", "<i4"),
    ("line_index", "u1"),
]
# Sizes of the unpadded records: 26, 22, 19, 29 and 25 bytes.
_RECORDS = {
    "Ouster": np.dtype(
        [
            *_XYZ,
            ("intensity", "<f4"),
            ("t", "<u4"),
            ("reflectivity", "<u2"),
            ("ring", "<u2"),
            ("ambient", "<u2"),
        ]
    ),
    "Velodyne": np.dtype(
        [*_XYZ, ("intensity", "<f4"), ("ring", "<u2"), ("time", "<f4")]
    ),
    "Avia": np.dtype(
        [
            *_XYZ,
            ("reflectivity", "u1"),
            ("tag", "u1"),
            ("line", "u1"),
            ("offset_time", "<u4"),
        ]
    ),
    "Aeva": np.dtype([*_AEVA_EARLY, ("intensity", "<f4")]),
}
# Records of Aeva up to this time have no intensity [ns].
_AEVA_CHANGE_NS = 1691936557946849179
# The Ouster is an OS2 with 128 channels over 22.5 deg (its data sheet).
_UNITS: dict[str, str | LidarField] = {
    "Ouster": LidarField(128, -11.25, 11.25),
    "Velodyne": "vlp-16",
    "Avia": "avia",
}
_NUM_RINGS = {"Ouster": 128, "Velodyne": 16}


class HeliprDrive(FileDrive):
    """The scans of one LiDAR of HeLiPR on a drive.

    If there is a file `LiDAR_GT/global_<lidar>_gt.txt`, the poses come from
    this file, and W has the axes of the UTM grid but an origin near the drives
    (see `evaluation.drives.utm_poses.to_world`). Otherwise the poses come from
    `LiDAR_GT/<lidar>_gt.txt`, and W is the frame of this file. Points without a
    return are left out.
    """

    def __init__(
        self,
        path: Path,
        lidar: str | None = None,
        poses: Path | None = None,
        pose_gap: float | None = None,
    ):
        """Opens a drive.

        Args:
            path: the folder of the drive, or `LiDAR/<name>` in it.
            lidar: name of the LiDAR, if `path` does not contain it. By default
                the Ouster or, in a folder without the Ouster, the only LiDAR.
            poses: file with poses of the LiDAR, which is read instead.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: there is no such drive, or its poses cannot be used.
        """
        is_chosen = lidar is not None or _lidar_folder(path) is not None
        drive, lidar = _choose(path, lidar)
        there = _lidars(drive)
        chosen: tuple[str, ...] = ()
        if not is_chosen and len(there) > 1:
            chosen = (
                f"{path}: the scans of {lidar} are read (--lidar reads those of"
                f" another: {', '.join(n for n in there if n != lidar)})",
            )
        files, stamps_ns = list_stamped(drive / _SCANS / lidar, ".bin")
        super().__init__(
            drive,
            posed(
                files,
                stamps_ns,
                partial(_own_poses, drive, lidar),
                poses,
                pose_gap,
            ),
            partial(_read_scan, lidar),
            lidar=lidar,
            notes=chosen,
            unit=_UNITS.get(lidar),
        )


def _own_poses(drive: Path, lidar: str) -> OwnPoses:
    """Returns the poses of a LiDAR."""
    table = drive / _POSES / f"global_{lidar}_gt.txt"
    if table.is_file():
        return OwnPoses(
            read_quaternions(table, None),
            f"helipr/{DATUM}",
            (table,),
            DATUM,
            X_WS=lambda X_US: to_world(X_US, table),
        )
    own = drive / _POSES / f"{lidar}_gt.txt"
    return OwnPoses(
        read_quaternions(own, None),
        f"helipr{drive.resolve()}",
        (own,),
        has_own_world=True,
    )


def _read_scan(lidar: str, path: Path, stamp_ns: int) -> np.ndarray:
    """Returns the points of a scan file as a structured array (N,).

    Args:
        lidar: name of the LiDAR: `Ouster`, `Velodyne`, `Avia` or `Aeva`.
        stamp_ns: time of the scan [ns], on which the format of the Aeva
            depends.

    Raises:
        ValueError: if the file does not have the format of that LiDAR.
    """
    dtype = _RECORDS[lidar]
    if lidar == "Aeva" and stamp_ns <= _AEVA_CHANGE_NS:
        dtype = np.dtype(_AEVA_EARLY)
    points = read_packed(path, dtype)
    if lidar in _NUM_RINGS:
        check_below(points, "ring", _NUM_RINGS[lidar])
    return points


def holds_helipr(path: Path) -> bool:
    """Returns whether a folder is a drive of HeLiPR, or one LiDAR of it."""
    return _lidar_folder(path) is not None or bool(_lidars(path))


DATA_SET = DataSet(
    "HeLiPR",
    holds_helipr,
    HeliprDrive,
    (
        "the folder with `LiDAR` and `LiDAR_GT`; to choose one of its "
        "LiDARs, the LiDAR's folder, such as `LiDAR/Avia`"
    ),
    has_lidars=True,
)


def _lidar_folder(path: Path) -> Path | None:
    """Returns the folder of one LiDAR with its drive above it, if it is one."""
    for place in (as_given(path), path.resolve()):
        of_lidar = place.parent.name == _SCANS and place.name in _RECORDS
        if of_lidar and place.is_dir():
            return place
    return None


def _lidars(drive: Path) -> list[str]:
    return [name for name in _RECORDS if (drive / _SCANS / name).is_dir()]


def _choose(path: Path, lidar: str | None) -> tuple[Path, str]:
    """Returns the folder of the drive and the name of the LiDAR."""
    folder = _lidar_folder(path)
    if folder is not None:
        return folder.parent.parent, folder.name
    there = _lidars(path)
    if lidar is None:
        lidar = there[0] if len(there) == 1 else "Ouster"
    if lidar not in there:
        raise InputError(
            f"{path}: HeLiPR: no {_SCANS}/{lidar} in it (there:"
            f" {' '.join(there) or 'none'})"
        )
    return path, lidar
