"""What the layouts of exported drives have in common.

Frames: world W, vehicle B on the ground, LiDAR S, IMU I.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
import json
from pathlib import PurePosixPath
import re
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.recording import to_yaml
from evaluation.base import InputError, poses
from evaluation.drives import Drive

# Text that may become the name of a folder; it cannot lead out of its parent.
_NAME = re.compile(r"\w[\w.-]*")
# A quaternion whose length differs from one by less is not changed.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Layout:
    """The files that an export in one format contains for a drive.

    A module NAME_layout of this package has the layout of the format NAME as
    its constant `LAYOUT`. Functions take the drive, and paths are relative to
    the folder that holds all exported drives, unless stated otherwise.

    Attributes:
        explained: what `export.yaml` says of each file: path -> content.
        drive_folder: function that returns the folder of the drive.
        inner_files: function that returns the text files inside this folder:
            path in the folder -> text. Scans are not included.
        outer_files: function that returns the text files outside this folder:
            path -> text.
        scan_files: function of the drive, a frame number, and the time [ns] and
            the scan of this frame. The function returns the files of the scan:
            path in the drive's folder -> content. None for formats without
            scans.
        shared_outer_files: whether the outer files belong to all drives
            together, and must therefore be the same for all drives.
        has_labels: whether points and structures have labels.
        notes: function that yields notes about how a drive is written.
        numbered: function that returns the layout for a drive with a given
            number, as text; None for formats without numbers.
    """

    explained: Mapping[str, str]
    drive_folder: Callable[[Drive], PurePosixPath]
    inner_files: Callable[[Drive], dict[str, str]]
    outer_files: Callable[[Drive], dict[str, str]] = lambda drive: {}
    scan_files: (
        Callable[[Drive, int, int, np.ndarray], dict[str, bytes]] | None
    ) = None
    shared_outer_files: bool = False
    has_labels: bool = False
    notes: Callable[[Drive], Iterable[str]] = lambda drive: ()
    numbered: Callable[[str], Layout] | None = None


def checked_name(drive: Drive, text: str) -> str:
    """Returns a name from a recording if it is safe as the name of a folder.

    Raises:
        InputError: if the name could lead to another folder.
    """
    if not _NAME.fullmatch(text):
        raise InputError(
            f"{drive.name}: {text!r} cannot be the name of a folder"
        )
    return text


def scenario_files(drive: Drive, name: str | None = None) -> dict[str, str]:
    """Returns the file `scenario.yaml`, the scenario of a drive.

    The result maps the file name to its text. The result is empty if the
    recording contains no scenario.

    Args:
        drive: the recording.
        name: name of the drive in the scenario; by default the name of the
            recording.
    """
    if drive.scenario is None:
        return {}
    scenario = {**drive.scenario, "name": name or drive.name}
    scenario.pop("columns", None)  # Those of the files that were read.
    return {"scenario.yaml": to_yaml(scenario)}


def imu_files(drive: Drive) -> dict[str, str]:
    """Returns the file `imu.yaml`, the IMU's noise in Kalibr's format.

    The result maps the file name to its text. The result is empty if the
    recording does not contain the noise.
    """
    return {} if drive.kalibr is None else {"imu.yaml": drive.kalibr}


def structure_files(table: Mapping[int, Mapping] | None) -> dict[str, str]:
    """Returns the file `structures.json`, the table of structures.

    The result maps the file name to its text. The result is empty if there is
    no such table.
    """
    if table is None:
        return {}
    text = json.dumps(list(table.values()), indent=1)
    return {"structures.json": text + "\n"}


class PoseColumns(NamedTuple):
    """Poses of a frame that carries the LiDAR.

    Attributes:
        stamps_ns: (M,) [ns].
        columns: positions (M, 3) [m] and unit quaternions (M, 4) x, y, z, w.
        X_BS: (4, 4) pose of the LiDAR in this frame.
    """

    stamps_ns: np.ndarray
    columns: list[np.ndarray]
    X_BS: np.ndarray


def vehicle_poses(drive: Drive) -> PoseColumns | None:
    """Returns the poses of a drive's vehicle; None if it has none.

    Quaternions in the recording may have any length.

    Raises:
        InputError: a quaternion has no direction, or a coordinate of a position
            is not finite, or not below `poses.FARTHEST`.
    """
    found = _vehicle(drive)
    if found is None:
        return None
    odometry, X_BS = found
    columns = _odometry_columns(drive.name, odometry)
    return PoseColumns(odometry["stamp_ns"], columns, X_BS)


def lidar_poses(drive: Drive) -> PoseColumns:
    """Returns the poses of a drive's LiDAR, as if it were the vehicle."""
    X_WS = drive.X_WS
    quat_WS = Rotation.from_matrix(X_WS[:, :3, :3]).as_quat(canonical=True)
    return PoseColumns(drive.stamps_ns, [X_WS[:, :3, 3], quat_WS], np.eye(4))


def world_notes(drive: Drive) -> Iterator[str]:
    """Yields a note if a format cannot say that a drive's world is its own."""
    if drive.is_local:
        yield (
            f"{drive.name}: its world frame is not that of other drives, which"
            " readers of this format will take it for"
        )


def vehicle_notes(drive: Drive) -> Iterator[str]:
    """Yields notes on the poses of a drive, as of `world_notes`."""
    yield from world_notes(drive)
    if _vehicle(drive) is None:
        yield (
            f"{drive.name}: has no poses of the vehicle; those of the LiDAR are"
            " written alone"
        )


def _vehicle(drive: Drive) -> tuple[np.ndarray, np.ndarray] | None:
    """Returns a drive's odometry and X_BS; None if it has no vehicle."""
    odometry, X_BS = drive.odometry, drive.X_BS
    if odometry is None or len(odometry) == 0 or X_BS is None:
        return None
    return odometry, X_BS


def _odometry_columns(name: str, odometry: np.ndarray) -> list[np.ndarray]:
    """Returns positions (M, 3) and unit quaternions (M, 4) of odometry."""
    _check_odometry(name, odometry)
    quat_xyzw = odometry["quat_xyzw"]
    length = np.linalg.norm(quat_xyzw, axis=1, keepdims=True)
    # A length that is one up to rounding is not changed.
    is_wrong = np.abs(length - 1.0) > _ROUNDING
    unit = np.where(is_wrong, quat_xyzw / length, quat_xyzw)
    return [odometry["position"], unit]


def _check_odometry(name: str, odometry: np.ndarray) -> None:
    """Checks the M odometry messages of the drive with a name."""
    quat_xyzw = odometry["quat_xyzw"]
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.linalg.norm(quat_xyzw, axis=1)
    position = odometry["position"]
    bad = ~(np.isfinite(length) & (length > 0.0))
    # NaN is False here.
    bad |= ~(np.abs(position) < poses.FARTHEST).all(axis=1)
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"{name}: the odometry at {odometry['stamp_ns'][row]} ns has the"
            f" position {position[row]} and the quaternion {quat_xyzw[row]}"
        )


def seconds_text(stamp_ns: int) -> str:
    """Returns a time stamp [ns] as text in seconds with nine decimals."""
    return f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d}"


def stamped_rows(
    stamps: Iterable[object], columns: Sequence[np.ndarray], separator: str
) -> str:
    """Returns a text table whose rows consist of a time and K numbers.

    Numbers are written with all digits.

    Args:
        stamps: the N times, as texts to write.
        columns: arrays (N, k) of numbers, whose columns are put side by side.
        separator: text between two values of a row.
    """
    rows = zip(stamps, np.hstack(columns).tolist(), strict=True)
    return "".join(
        f"{separator.join([str(stamp), *map(repr, row)])}\n"
        for stamp, row in rows
    )
