"""Drives of the NCLT data set (Carlevaris-Bianco et al., IJRR 2016).

    DATE/velodyne_sync/<us>.bin     uint16 x y z, uint8 intensity, uint8 laser
    groundtruth_DATE.csv            us, x y z [m], roll pitch yaw [rad] of X_NB

The table is in the drive's folder, next to the drive's folder, or in a folder
`ground_truth` next to the drive's folder. The axes of N point north, east and
down. B is the vehicle's body, with x forward, y right and z down. Points are
expressed in B and stored as multiples of 5 mm, counted from -100 m. All
sessions share N.
"""

from pathlib import Path

import numpy as np

from evaluation.base import InputError, poses
from evaluation.drives.data_set import DataSet
from evaluation.drives.drive import as_given
from evaluation.drives.scan_files import (
    FileDrive,
    OwnPoses,
    check_below,
    first_existing,
    list_stamped,
    posed,
    read_packed,
)
from evaluation.drives.text_tables import parse_microseconds
from evaluation.drives.trajectories import read_angles

_SCANS = "velodyne_sync"
_HITS = "velodyne_hits.bin"
_STORED = np.dtype(
    [(axis, "<u2") for axis in "xyz"] + [("intensity", "u1"), ("laser", "u1")]
)
_POINT = np.dtype(
    [
        *((axis, "<f4") for axis in "xyz"),
        ("intensity", "u1"),
        ("ring", "<u2"),
    ]
)
# Unit of stored coordinates [m].
_UNIT = 0.005
# Coordinate that is stored as 0 [m].
_LEAST_COORDINATE = -100.0
_NUM_LASERS = 32
# W has its axes east, north and up.
_X_WN = poses.make_pose(
    np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), np.zeros(3)
)
# The origin of S is the LiDAR's, from the data set's x_body_velodyne; its x is
# forward, y left and z up.
_X_BS = poses.make_pose(
    np.diag([1.0, -1.0, -1.0]), np.array([0.002, -0.004, -0.957])
)


class NcltDrive(FileDrive):
    """The scans of the HDL-32E in a session of NCLT.

    The unit hangs upside down, and its field of view reaches up to 30.67 deg.
    The files contain scans from which the motion during a revolution has been
    removed. The rings of the points are numbered from the lowest elevation
    upwards, unlike the lasers of the unit.
    """

    def __init__(
        self,
        path: Path,
        columns: int | None = None,
        poses: Path | None = None,
        pose_gap: float | None = None,
    ):
        """Opens a session.

        Args:
            path: its folder.
            columns: is ignored, because the layout is fixed.
            poses: file with poses of the LiDAR, which is read instead.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: there is no such session, or its poses cannot be used.
        """
        if not (path / _SCANS).is_dir():
            raise InputError(
                f"{path / _HITS}: packets as they came; {_SCANS}, the data"
                " set's scans, is needed beside it"
            )
        files, stamps_ns = list_stamped(
            path / _SCANS, ".bin", parse_microseconds
        )
        chosen: list[str] = []
        super().__init__(
            path,
            posed(
                files,
                stamps_ns,
                lambda: _own_poses(_poses_path(path, chosen)),
                poses,
                pose_gap,
            ),
            lambda path, stamp_ns: _read_scan(path),
            notes=chosen,
            unit="hdl-32e-upside-down",
        )


def _own_poses(table: Path) -> OwnPoses:
    """Returns the poses in a table of the data set."""
    return OwnPoses(
        read_angles(table),
        "nclt",
        (table,),
        X_WS=lambda X_NB: _X_WN @ X_NB @ _X_BS,
    )


def holds_nclt(path: Path) -> bool:
    """Returns whether a folder looks like a session of NCLT."""
    return (path / _SCANS).is_dir() or (path / _HITS).is_file()


DATA_SET = DataSet(
    "NCLT",
    holds_nclt,
    NcltDrive,
    (
        "the folder with `velodyne_sync`, such as `2012-01-08`; "
        "`groundtruth_2012-01-08.csv` must be in this folder, next to it, "
        "or in `../ground_truth`"
    ),
)


def _read_scan(path: Path) -> np.ndarray:
    """Returns the points (N,) of a `velodyne_sync` file, in the LiDAR's frame.

    Raises:
        ValueError: if the file does not have NCLT's format.
    """
    stored = read_packed(path, _STORED)
    check_below(stored, "laser", _NUM_LASERS)
    points = np.empty(len(stored), _POINT)
    for axis, origin, sign in zip(
        "xyz", _X_BS[:3, 3], _X_BS.diagonal(), strict=False
    ):
        points[axis] = sign * (
            stored[axis] * _UNIT + _LEAST_COORDINATE - origin
        )
    points["intensity"] = stored["intensity"]
    down = stored["laser"] // 2 + _NUM_LASERS // 2 * (stored["laser"] % 2)
    points["ring"] = _NUM_LASERS - 1 - down
    return points


def _poses_path(path: Path, notes: list[str]) -> Path:
    candidates = [
        folder / f"groundtruth_{place.name}.csv"
        for place in (as_given(path), path.resolve())
        for folder in (path, place.parent, place.parent / "ground_truth")
    ]
    found = first_existing(candidates, notes)
    if found is None:
        raise InputError(
            f"{path}: NCLT: no {candidates[0].name}, neither in it nor beside"
            " it nor in ../ground_truth"
        )
    return found
