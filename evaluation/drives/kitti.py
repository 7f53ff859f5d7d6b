"""Drives of the KITTI odometry benchmark, and others in its layout.

    sequences/NN/velodyne/%06d.bin   float32 x y z reflectance
    sequences/NN/times.txt           seconds
    sequences/NN/calib.txt           Tr: upper 3 x 4 of X_CS
    poses/NN.txt                     upper 3 x 4 of X_C0C, a row a scan

C is the frame of the left grey camera (x right, y down, z forward), C0 is C at
the first scan, and S is the frame of the LiDAR. Without a `calib.txt` the files
contain poses of the LiDAR, X_S0S. If scans are missing, the numbers in the
names of the remaining files select the rows of the tables. If scans were
renumbered, `frames.txt` contains the old number of each scan.

There may also be labels, in SemanticKITTI's form,

    sequences/NN/labels/%06d.label   uint32 label | instance << 16, a point

and, in drives exported by cns-drake,

    sequences/NN/first_pose.txt      upper 3 x 4 of X_WS at the first scan
    sequences/NN/scenario.yaml
    sequences/NN/structures.json     what the instances are
"""

from collections.abc import Mapping
import itertools
from pathlib import Path
import re

import numpy as np
from numpy.lib.recfunctions import append_fields

from evaluation.base import (
    InputError,
    is_there,
    listed,
    parse_json,
    parse_rows,
    poses,
    read_bytes,
    read_text,
    value_errors,
)
from evaluation.drives.data_set import DataSet
from evaluation.drives.drive import as_given, index_instances
from evaluation.drives.scan_files import (
    BinDrive,
    OwnPoses,
    first_existing,
    posed,
    read_packed,
)
from evaluation.drives.stamped_poses import StampedPoses
from evaluation.drives.text_tables import (
    check_increasing,
    parse_seconds,
    read_numbers,
)
from evaluation.drives.trajectories import pose_matrices, read_poses

_SCANS = "velodyne"
_LABELS = "labels"
_FRAMES = "frames.txt"
_FIRST_POSE = "first_pose.txt"
_CALIBRATION = "calib.txt"
_STRUCTURES = "structures.json"
# Least focal length of a camera [pixels]. KITTI's cameras have 707 or more; in
# other files the projection is the identity.
_KITTIS_FOCAL_LENGTH = 100.0
_LABEL = np.dtype([("label", "<u2"), ("instance", "<u2")])


class KittiDrive(BinDrive):
    """A drive of KITTI odometry.

    The files contain poses X_C0C of camera C, relative to the pose at the first
    scan. These poses are converted to poses of the LiDAR S, X_S0S =
    inverse(X_CS) X_C0C X_CS; `calib.txt` contains X_CS under the name `Tr`.
    Without `calib.txt`, the files are taken to contain poses of the LiDAR.

    The world frame W is S0, the LiDAR's frame at the first scan, with z up. If
    there is a file `first_pose.txt`, as in exports of cns-drake, W is the world
    frame of the recording. With a folder `labels`, points have the fields
    `label` and `instance`.

    Attributes:
        X_CS: (4, 4) the `Tr` that is applied; the identity without one.
    """

    placing = (
        " (a first_pose.txt in a drive's folder says where in the map its first"
        " scan was taken)"
    )

    def __init__(
        self,
        path: Path,
        columns: int | None = None,
        poses: Path | None = None,
        pose_gap: float | None = None,
    ):
        """Opens a drive.

        Args:
            path: its folder; the poses lie in `../../poses/<name>.txt`, or
                as `poses.txt` beside the scans.
            columns: number of columns of a scan, see `BinDrive`.
            poses: file with poses of the LiDAR, which is read instead.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: there is no such drive, its files do not fit together,
                or it has no poses, like KITTI's sequences 11 to 21.
        """
        files, numbers = _numbered_files(path)
        times_path = path / "times.txt"
        times = read_numbers(times_path, [("time", "U40")])["time"]
        with value_errors(times_path):
            stamps_ns = parse_seconds(times)
        check_increasing(times_path, stamps_ns, "row")
        notes: list[str] = []
        poses_path = poses or _poses_path(path, notes)
        calibration, first_pose = path / _CALIBRATION, path / _FIRST_POSE
        X_CS, unit = np.eye(4), None
        if is_there(calibration):
            X_CS, unit = _calibrated(calibration)
        elif poses is None:
            notes.append(
                f"{calibration}: not there; the poses in {poses_path.name} are"
                " taken as those of the LiDAR"
            )
        # Drives of one name in two folders have two world frames.
        world_frame = f"kitti{path.resolve()}"
        counts = len(stamps_ns), len(stamps_ns)
        stamps_ns = _rows_of_scans(times_path, stamps_ns, numbers, notes)
        if poses is None:
            X_C0C = read_poses(poses_path)
            counts = counts[0], len(X_C0C)
            X_C0C = _rows_of_scans(poses_path, X_C0C, numbers, notes)
            X_WS = _lidar_poses(X_C0C, X_CS)
            if is_there(first_pose):
                X_WS = _read_first_pose(first_pose) @ X_WS
                world_frame = "map"
        # If scans are missing, one table may have a row for each number and the
        # other table a row for each existing scan.
        gaps = numbers != list(range(len(files)))
        if counts[0] != counts[1] and not gaps:
            raise InputError(
                f"{poses_path}: {counts[1]} rows, but {counts[0]} in"
                f" {times_path}"
            )
        self.X_CS = X_CS if poses is None else np.eye(4)
        self._structures = path / _STRUCTURES
        labels = path / _LABELS
        self._labels = labels if labels.is_dir() else None
        super().__init__(
            columns,
            path=path,
            scans=posed(
                files,
                stamps_ns,
                lambda: OwnPoses(
                    StampedPoses(poses_path, stamps_ns, X_WS),
                    world_frame,
                    (poses_path,),
                    has_own_world=not is_there(first_pose),
                ),
                poses,
                pose_gap,
                numbers,
            ),
            tables=[
                times_path,
                calibration,
                first_pose,
                path / _FRAMES,
                self._structures,
            ],
            notes=notes,
            unit=unit,
        )

    @property
    def files(self) -> tuple[Path, ...]:
        if self._labels is None:
            return super().files
        labels = (
            _label_path(self._labels, scan_file) for scan_file in self._files
        )
        return (*super().files, *labels)

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        path = self._structures
        if not is_there(path):
            return None
        with value_errors(path):
            table = parse_json(read_bytes(path))
        return index_instances(table, str(path))

    def _read_bin(self, path: Path, stamp_ns: int) -> np.ndarray:
        stored = super()._read_bin(path, stamp_ns)
        if self._labels is None:
            return stored
        labels_path = _label_path(self._labels, path)
        labels = read_packed(labels_path, _LABEL)
        if len(labels) != len(stored):
            raise ValueError(
                f"{len(stored)} points, but {len(labels)} in {labels_path}"
            )
        names = list(_LABEL.names or ())
        columns = [labels[name] for name in names]
        return append_fields(stored, names, columns, usemask=False)


def _lidar_poses(X_C0C: np.ndarray, X_CS: np.ndarray) -> np.ndarray:
    """Returns poses of the LiDAR (N, 4, 4) from poses of the camera."""
    return poses.inverse(X_CS) @ X_C0C @ X_CS


def _label_path(labels: Path, scan: Path) -> Path:
    return labels / f"{scan.stem}.label"


def holds_kitti(path: Path) -> bool:
    """Returns whether a folder looks like a drive in KITTI's layout."""
    return (path / _SCANS).is_dir()


DATA_SET = DataSet(
    "KITTI odometry",
    holds_kitti,
    KittiDrive,
    (
        "`sequences/NN` of KITTI odometry or SemanticKITTI; the poses must "
        "be in `poses/NN.txt` next to `sequences`, or in `poses.txt` next "
        "to `velodyne`"
    ),
    is_nested=True,
    needs_scenario=True,
)


def _numbered_files(path: Path) -> tuple[list[Path], list[int]]:
    """Returns the scan files of a drive in order, and the scans' numbers."""
    folder = path / _SCANS
    files = listed(folder, "*.bin")
    if not files:
        raise InputError(f"{folder}: no scan (*.bin) in it")
    for file in files:
        if re.fullmatch("[0-9]{6}", file.stem) is None:
            raise InputError(f"{file}: the name is no number of six digits")
    numbers = [int(file.stem) for file in files]
    frames = path / _FRAMES
    if not is_there(frames):
        return files, numbers
    rows = read_numbers(frames, [("number", "U40")])["number"]
    if len(rows) != len(files):
        raise InputError(f"{frames}: {len(rows)} rows for {len(files)} scans")
    for row, text in enumerate(rows.tolist()):
        # No drive has a frame whose number has ten digits.
        if re.fullmatch("[0-9]{1,9}", text) is None:
            raise InputError(f"{frames}: row {row + 1}: {text!r} is no number")
    renumbered = numbers == list(range(len(files)))
    found = numbers
    numbers = list(map(int, rows))
    for row, (before, number) in enumerate(itertools.pairwise(numbers)):
        if number <= before:
            raise InputError(
                f"{frames}: row {row + 2}: {number} does not follow {before}"
            )
    if numbers != found and not renumbered:
        raise InputError(
            f"{frames}: other numbers than those of the files in {folder}"
        )
    return files, numbers


def _rows_of_scans(
    path: Path, rows: np.ndarray, numbers: list[int], notes: list[str]
) -> np.ndarray:
    """Returns the rows of a table that belong to the scans.

    The table must have a row for each scan, or a row for each number up to the
    greatest number of a scan. In the second case a note is added to `notes`.
    """
    if len(rows) == len(numbers):
        return rows
    if len(rows) < len(numbers):
        raise InputError(f"{path}: {len(rows)} rows for {len(numbers)} scans")
    if numbers[-1] >= len(rows):
        raise InputError(
            f"{path}: {len(rows)} rows, none for scan {numbers[-1]}"
        )
    notes.append(
        f"{path}: {len(rows)} rows for {len(numbers)} scans; the rows of the"
        " scans' numbers are used"
    )
    return rows[numbers]


def _poses_path(path: Path, notes: list[str]) -> Path:
    given, resolved = (
        one.parent.parent / "poses" / f"{one.name}.txt"
        for one in (as_given(path), path.resolve())
    )
    found = first_existing([given, path / "poses.txt", resolved], notes)
    if found is None:
        raise InputError(
            f"{path}: KITTI: no poses, neither ../../poses/{given.name}"
            " nor poses.txt; --poses FILE gives those of the LiDAR"
        )
    return found


def _read_first_pose(path: Path) -> np.ndarray:
    """Returns X_WS (4, 4) at the first scan."""
    rows = read_poses(path)
    if len(rows) != 1:
        raise InputError(f"{path}: {len(rows)} rows instead of one")
    return rows[0]


def _calibrated(path: Path) -> tuple[np.ndarray, str | None]:
    """Returns what the file of a drive's calibration says about its LiDAR.

    Returns:
        X_CS (4, 4), the pose of the LiDAR in the camera's frame; and the model
        of the LiDAR, None if it is unknown.
    """
    rows = _read_calibration(path)
    is_kitti = "P0" in rows and rows["P0"][0, 0] > _KITTIS_FOCAL_LENGTH
    return pose_matrices(path, rows["Tr"])[0], "hdl-64e" if is_kitti else None


def _read_calibration(path: Path) -> dict[str, np.ndarray]:
    """Returns the row Tr of `calib.txt`, and the row P0 if present, (1, 12).

    Tr is the upper 3 x 4 of X_CS, the pose of the LiDAR in the camera's frame.
    """
    rows = {}
    for line in read_text(path).splitlines():
        key, colon, text = line.partition(":")
        key = key.strip()
        if colon and key in ("P0", "Tr"):
            try:
                values = parse_rows([text], np.dtype(float))
            except ValueError as error:
                fault = str(error).removeprefix("row 1: ")
                raise InputError(f"{path}: {key}: {fault}") from error
            if values.shape[1] != 12:
                raise InputError(
                    f"{path}: {key}: {values.shape[1]} numbers instead of 12"
                )
            if key in rows:
                raise InputError(f"{path}: {key}: is there twice")
            rows[key] = values
    if "Tr" not in rows:
        raise InputError(f"{path}: Tr: missing")
    return rows
