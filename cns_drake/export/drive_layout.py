"""The common part of all exporters."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
import json
from pathlib import PurePosixPath
import re

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.poses import FARTHEST
from cns_drake.base.recordings.mcap_drive import McapDrive
from cns_drake.recording.rosbag2_metadata import to_yaml

# Text that may become the name of a folder: it cannot lead out of it.
_NAME = re.compile(r"\w[\w.-]*")
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Layout:
    """How one format lays out a drive.

    Paths are relative to the folder of all drives.

    Attributes:
        files: path (with `<place holders>`) -> its content in words.
        drive_folder: drive -> its folder.
        outer_files: drive -> path -> text of the files outside that folder.
        inner_files: likewise inside that folder, relative to it, without the
            scans.
        scan_files: frame number, stamp [ns] and scan -> its files: path in the
            drive's folder -> content. None for layouts without scans.
        shared_outer_files: whether all drives share the outer files, which must
            then agree.
        has_labels: whether points have labels.
    """

    files: dict[str, str]
    drive_folder: Callable[[McapDrive], PurePosixPath]
    outer_files: Callable[[McapDrive], dict[str, str]]
    inner_files: Callable[[McapDrive], dict[str, str]]
    scan_files: Callable[[int, int, np.ndarray], dict[str, bytes]] | None
    shared_outer_files: bool
    has_labels: bool


def checked_name(drive: McapDrive, text: str) -> str:
    """Returns a name from a recording as a part of a path.

    Raises:
        InputError: if the name could lead elsewhere.
    """
    if not _NAME.fullmatch(text):
        raise InputError(
            f"{drive.name}: {text!r} cannot be the name of a folder"
        )
    return text


def scenario_files(drive: McapDrive, name: str | None = None) -> dict[str, str]:
    """Returns `scenario.yaml`, if the recording has a scenario.

    Args:
        drive: the recording.
        name: of the drive; by default the recording's.
    """
    if drive.scenario is None:
        return {}
    scenario = {**drive.scenario, "name": name or drive.name}
    return {"scenario.yaml": to_yaml(scenario)}


def imu_files(drive: McapDrive) -> dict[str, str]:
    """Returns `imu.yaml`, the IMU's noise for Kalibr, if it has noise."""
    return {} if drive.kalibr is None else {"imu.yaml": drive.kalibr}


def structure_files(drive: McapDrive) -> dict[str, str]:
    """Returns `structures.json`, the table of instances, if recorded."""
    if drive.instances is None:
        return {}
    table = list(drive.instances.values())
    return {"structures.json": json.dumps(table, indent=1) + "\n"}


def unit_quaternions(drive: McapDrive) -> np.ndarray:
    """Returns the orientations of the odometry, (M, 4) of unit length.

    Quaternions of a recording may have any length; readers of text need unit
    length.

    Raises:
        InputError: if a quaternion has no direction, or a position is not
            finite.
    """
    quat_xyzw = drive.odometry["quat_xyzw"]
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.linalg.norm(quat_xyzw, axis=1, keepdims=True)
    position = drive.odometry["position"]
    bad = ~(np.isfinite(length[:, 0]) & (length[:, 0] > 0.0))
    bad |= ~(np.abs(position) < FARTHEST).all(axis=1)  # NaN is not.
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"{drive.name}: the odometry at"
            f" {drive.odometry['stamp_ns'][row]} ns has the position"
            f" {position[row]} and the quaternion {quat_xyzw[row]}"
        )
    # A length of one, up to rounding, stays as it is.
    is_wrong = np.abs(length - 1.0) > _ROUNDING
    return np.where(is_wrong, quat_xyzw / length, quat_xyzw)


def seconds(stamp_ns: int) -> str:
    """Returns a stamp in seconds with all its nanoseconds."""
    return f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d}"


def join_rows(rows: Iterable[Iterable[object]], separator: str) -> str:
    """Returns a table as text; floats keep all their digits."""
    return "".join(f"{separator.join(map(repr, row))}\n" for row in rows)
