"""Drives in the layout in which the CNS data set was published.

    transformation_lidar.yaml        pose of the LiDAR on the vehicle
    transformation_imu.yaml
    <Map>/<Sequence>/gt.csv          time, x y z, qx qy qz qw of X_WB
    <Map>/<Sequence>/imu.csv
    <Map>/<Sequence>/pcd/<time>.pcd  x y z intensity

B is the vehicle at the ground. Times are whole nanoseconds, or seconds with
a decimal point. A row of `imu.csv` is time, quat_xyzw of R_WI, angular
velocity, specific force. A drive that cns-drake exported also has a
`scenario.yaml`.
"""

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.base import (
    InputError,
    YamlLoader,
    is_there,
    parse_yaml,
    poses,
    read_text,
    value_errors,
)
from evaluation.clouds import read_cloud
from evaluation.drives.data_set import DataSet
from evaluation.drives.drive import IMU_DTYPE, as_given
from evaluation.drives.drive_scenario import SCENARIO
from evaluation.drives.scan_files import (
    FileDrive,
    OwnPoses,
    first_existing,
    list_stamped,
    posed,
)
from evaluation.drives.text_tables import read_stamped_rows
from evaluation.drives.trajectories import pose_matrices, read_quaternions

_POSES = "gt.csv"
_IMU = "imu.csv"
_IMU_COLUMNS = (
    "time",
    "qx",
    "qy",
    "qz",
    "qw",
    "wx",
    "wy",
    "wz",
    "ax",
    "ay",
    "az",
)
# Names of the folder in the paper and in the download.
_FOLDERS = ("pcd", "LiDAR")
_MOUNT = "transformation_lidar.yaml"
# Height of the LiDAR above the vehicle's origin, from the data set's drawing
# [m].
_LIDAR_HEIGHT = 1.6


class CnsFolderDrive(FileDrive):
    """A drive in the published layout of CNS.

    The pose X_BS of the LiDAR in the vehicle's frame is read from
    `transformation_lidar.yaml`, next to the drive or up to two folders above
    it. Without such a file, the LiDAR is 1.6 m above the origin of the
    vehicle's frame, as in the data set.
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
            path: its folder.
            columns: has no effect, because PCD files name their columns.
            poses: file with poses of the LiDAR, which is read instead.
            pose_gap: see `StampedPoses.at_scans`.

        Raises:
            InputError: there is no such drive, or its poses cannot be used.
        """
        chosen: list[str] = []
        folders = [path / name for name in _FOLDERS if (path / name).is_dir()]
        folder = first_existing(folders, chosen)
        if folder is None:
            raise InputError(
                f"{path}: CNS: neither {' nor '.join(_FOLDERS)} in it"
            )
        files, stamps_ns = list_stamped(folder, ".pcd")
        self._imu_path = path / _IMU
        mount = _find_mount(path, chosen)
        place = as_given(path)
        name, scenario = place.name, None
        has_scenario = is_there(path / SCENARIO)
        if mount is not None and mount.parent.samefile(place.parent.parent):
            name = f"{place.parent.name}_{place.name}".lower()
            scenario = {"map": place.parent.name.lower(), "stage": place.name}
        if mount is None and not has_scenario:
            chosen.append(
                f"{path}: no {_MOUNT} in it or up to two folders above, and no"
                f" {SCENARIO}: the name of its map is unknown, and the LiDAR is"
                f" taken as {_LIDAR_HEIGHT:g} m above the vehicle's origin"
            )
        super().__init__(
            path,
            posed(
                files,
                stamps_ns,
                lambda: _own_poses(path / _POSES, mount),
                poses,
                pose_gap,
            ),
            lambda path, stamp_ns: read_cloud(path),
            name=name,
            tables=[self._imu_path],
            notes=chosen,
            scenario=scenario,
            unit="cns",
        )

    @cached_property
    def notes(self) -> tuple[str, ...]:
        notes = list(super().notes)
        read_cloud(self._files[0], on_note=notes.append)
        return tuple(notes)

    @cached_property
    def imu(self) -> np.ndarray | None:
        if not is_there(self._imu_path):
            return None
        stamps_ns, values = read_stamped_rows(
            self._imu_path, 10, ",", _IMU_COLUMNS
        )
        imu = np.empty(len(values), dtype=IMU_DTYPE)
        imu["stamp_ns"] = stamps_ns
        imu["quat_xyzw"] = values[:, :4]
        imu["angular_velocity"] = values[:, 4:7]
        imu["specific_force"] = values[:, 7:]
        return imu


def _own_poses(table: Path, mount: Path | None) -> OwnPoses:
    """Returns the poses of the vehicle in a table of the data set."""
    X_BS = _read_mount(mount)
    return OwnPoses(
        read_quaternions(table, ","),
        "map",
        (table, *([] if mount is None else [mount])),
        X_WS=lambda X_WB: X_WB @ X_BS,
    )


def holds_cns(path: Path) -> bool:
    """Returns whether a folder looks like a drive in CNS' layout."""
    return (path / _POSES).is_file() or (path / _FOLDERS[0]).is_dir()


DATA_SET = DataSet(
    "CNS",
    holds_cns,
    CnsFolderDrive,
    ("`<Map>/<NN>`, as published or exported"),
    is_nested=True,
)


def _find_mount(path: Path, notes: list[str]) -> Path | None:
    folders = [
        folder
        for place in (as_given(path), path.resolve())
        for folder in (place, place.parent, place.parent.parent)
    ]
    return first_existing(
        [folder / _MOUNT for folder in folders if is_there(folder / _MOUNT)],
        notes,
    )


def _read_mount(path: Path | None) -> np.ndarray:
    """Returns X_BS (4, 4), the pose of the LiDAR on the vehicle."""
    if path is None:
        return poses.make_pose(np.eye(3), np.array([0.0, 0.0, _LIDAR_HEIGHT]))
    with value_errors(path):
        # OpenCV's files begin with a directive that is not valid YAML.
        lines = [
            x for x in read_text(path).splitlines() if not x.startswith("%")
        ]
        X_BS = _first_pose(parse_yaml("\n".join(lines), _OpenCvLoader), path)
    if X_BS is None:
        raise InputError(
            f"{path}: no transformation (a matrix of 4 x 4 or 3 x 4 numbers,"
            " or translation and rotation)"
        )
    if X_BS[2, 3] < 0.0:
        raise InputError(
            f"{path}: translation: puts the LiDAR at z = {X_BS[2, 3]:g} m,"
            " below the vehicle (the inverse transformation?)"
        )
    return X_BS


class _OpenCvLoader(YamlLoader):
    """Loads YAML and ignores custom tags, such as OpenCV's for matrices."""


_OpenCvLoader.add_multi_constructor(
    "tag:yaml.org,2002:opencv",
    lambda loader, suffix, node: loader.construct_mapping(node, deep=True),
)


def _first_pose(node: Any, path: Path) -> np.ndarray | None:
    """Returns the first transformation in a YAML tree, as (4, 4)."""
    numbers = _number_array(node)
    if numbers is not None and len(numbers) in (12, 16):
        if len(numbers) == 16 and not np.array_equal(
            numbers[12:], [0.0, 0.0, 0.0, 1.0]
        ):
            raise ValueError("the last row of the matrix is not 0 0 0 1")
        return pose_matrices(path, numbers[None, :12])[0]
    if isinstance(node, dict):
        lowered = {str(key).lower(): value for key, value in node.items()}
        p = _number_array(lowered.get("translation"))
        rotation = _number_array(lowered.get("rotation"))
        if p is not None and rotation is not None and len(p) == 3:
            return _composed_pose(p, rotation, path)
        children = list(node.values())
    else:
        children = node if isinstance(node, list) else []
    for child in children:
        X = _first_pose(child, path)
        if X is not None:
            return X
    return None


def _composed_pose(
    p: np.ndarray, rotation: np.ndarray, path: Path
) -> np.ndarray:
    """Returns a pose made of a position and of a quat_xyzw or 3 x 3 matrix."""
    if len(rotation) == 4:
        R = poses.rotation_from_quaternion(rotation)
    elif len(rotation) == 9:
        R = rotation.reshape(3, 3)
    else:
        raise ValueError(
            f"rotation: {len(rotation)} numbers instead of 4 (x y z w) or 9"
        )
    return pose_matrices(path, np.c_[R, p].reshape(1, 12))[0]


def _number_array(node: Any) -> np.ndarray | None:
    """Returns numbers from a list (flat or nested) or from keys x, y, z, w."""
    if isinstance(node, dict):
        keys = [key for key in "xyzw" if key in node]
        node = [node[key] for key in keys] if len(keys) >= 3 else None
    try:
        numbers = np.array(node, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        return None
    return numbers if node is not None and len(numbers) > 1 else None
