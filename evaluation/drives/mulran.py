"""Drives of the MulRan data set (Kim et al., ICRA 2020), with its OS1-64.

    SEQ/global_pose.csv              ns, then the upper 3 x 4 of X_UB
    SEQ/[sensor_data/]Ouster/<ns>.bin     float32 x y z intensity

X_UB is the pose of the vehicle's base in the UTM grid, at 100 Hz; the origin of
the base is on the ground. Times are whole nanoseconds.
"""

from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import InputError, is_there, poses
from evaluation.drives.data_set import DataSet
from evaluation.drives.drive import as_given
from evaluation.drives.drive_scenario import SCENARIO
from evaluation.drives.scan_files import (
    BinDrive,
    OwnPoses,
    first_existing,
    list_stamped,
    posed,
)
from evaluation.drives.trajectories import read_matrices
from evaluation.drives.utm_poses import DATUM, is_local, to_world

# Pose of the LiDAR on the vehicle, from the data set's calib_base2ouster. Read
# as its name says, it puts the LiDAR above the base. Other programs apply its
# inverse. Since it turns by almost 180 degrees, the inverse puts the LiDAR
# within a centimetre of the same horizontal position, but 1.8 m below the
# ground.
X_BS = poses.make_pose(
    Rotation.from_euler(
        "xyz", [0.0001, 0.0003, 179.6654], degrees=True
    ).as_matrix(),
    np.array([1.7042, -0.021, 1.8047]),
)

_POSES = "global_pose.csv"
_FOLDERS = ("sensor_data/Ouster", "Ouster")

# Fields that follow from the index of a point in a complete scan.
_FOUND = [("ring", "<u2"), ("t", "<u4")]

# A complete scan: rings, columns, and its duration [ns].
_NUM_RINGS = 64
_NUM_COLUMNS = 1024
_SWEEP_NS = 100_000_000


class MulranDrive(BinDrive):
    """A drive of MulRan.

    W is the UTM grid with an origin near the drives (see
    `evaluation.drives.utm_poses.to_world`). If the poses are in local
    coordinates, W is the drive's own frame. The pose of a scan is interpolated
    at its stamp. Points without a return, which are stored as (0, 0, 0), are
    left out. A complete scan has two fields in addition to the stored fields:
    `ring` and `t` [ns since the stamp]. An incomplete scan lacks `ring` and
    `t`, because its file does not show which points are missing.
    """

    def __init__(
        self,
        path: Path,
        columns: int | None = None,
        poses: Path | None = None,
        pose_gap: float | None = None,
    ):
        """Opens a drive.

        Args:
            path: its folder, with or without a `sensor_data`.
            columns: number of columns of a scan, see `BinDrive`.
            poses: file with poses of the LiDAR, which is read instead.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: there is no such drive, or its poses cannot be used.
        """
        chosen: list[str] = []
        folder = _scan_folder(path, chosen)
        if folder is None:
            raise InputError(
                f"{path}: MulRan: neither {' nor '.join(_FOLDERS)} in it"
            )
        files, stamps_ns = list_stamped(folder, ".bin")
        super().__init__(
            columns,
            path=path,
            scans=posed(
                files, stamps_ns, partial(_own_poses, path), poses, pose_gap
            ),
            notes=chosen,
            # Exports of cns-drake are of any LiDAR.
            unit=None if is_there(path / SCENARIO) else "os1-64-33",
        )

    def _read_bin(self, path: Path, stamp_ns: int) -> np.ndarray:
        stored = super()._read_bin(path, stamp_ns)
        if len(stored) != _NUM_RINGS * _NUM_COLUMNS:
            return stored
        # Points are stored column by column, and within a column ring by ring.
        points = np.empty(len(stored), dtype=[*stored.dtype.descr, *_FOUND])
        for name in stored.dtype.names or ():
            points[name] = stored[name]
        number = np.arange(len(stored))
        points["ring"] = number % _NUM_RINGS
        column = number // _NUM_RINGS
        points["t"] = np.rint(column * (_SWEEP_NS / _NUM_COLUMNS))
        return points


def holds_mulran(path: Path) -> bool:
    """Returns whether a folder looks like a drive of MulRan."""
    return (path / _POSES).is_file() or _scan_folder(path, []) is not None


DATA_SET = DataSet(
    "MulRan",
    holds_mulran,
    MulranDrive,
    (
        "the folder with `global_pose.csv` (UTM or local coordinates) and "
        "`Ouster`"
    ),
)


def _own_poses(path: Path) -> OwnPoses:
    """Returns the poses of a drive, which are at its base."""
    table = path / _POSES
    trajectory = read_matrices(table)
    if is_local(trajectory.X_WB):
        return OwnPoses(
            trajectory,
            f"mulran{path.resolve()}",
            (table,),
            has_own_world=True,
            X_WS=lambda X_LB: X_LB @ X_BS,
            note=f"{table}: no UTM coordinates; taken for those of a frame of"
            f" {as_given(path).name} alone",
        )
    return OwnPoses(
        trajectory,
        f"mulran/{DATUM}",
        (table,),
        DATUM,
        X_WS=lambda X_UB: to_world(X_UB, table) @ X_BS,
    )


def _scan_folder(path: Path, notes: list[str]) -> Path | None:
    folders = [path / name for name in _FOLDERS if (path / name).is_dir()]
    return first_existing(folders, notes)
