"""What the layouts of exported drives have in common.

Frames: world W, vehicle B on the ground, LiDAR S, IMU I.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import json
from pathlib import PurePosixPath
import re

import numpy as np

from cns_drake.base import InputError, poses
from cns_drake.drives import McapDrive
from cns_drake.recording import to_yaml

# Text that may become the name of a folder; it cannot lead out of its parent.
_NAME = re.compile(r"\w[\w.-]*")
# A quaternion whose length differs from one by less is not changed.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Layout:
    """The files that an export in one format contains for a drive.

    A module NAME_layout of this package has the layout of the format NAME as
    its constant `LAYOUT`. Functions take the drive, and
    paths are relative to the folder that holds all exported drives, unless
    stated otherwise.

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
        has_labels: whether points have labels.
        numbered: function that returns the layout for a drive with a given
            number, as text; None for formats without numbers.
    """

    explained: Mapping[str, str]
    drive_folder: Callable[[McapDrive], PurePosixPath]
    inner_files: Callable[[McapDrive], dict[str, str]]
    outer_files: Callable[[McapDrive], dict[str, str]] = lambda drive: {}
    scan_files: (
        Callable[[McapDrive, int, int, np.ndarray], dict[str, bytes]] | None
    ) = None
    shared_outer_files: bool = False
    has_labels: bool = False
    numbered: Callable[[str], Layout] | None = None


def checked_name(drive: McapDrive, text: str) -> str:
    """Returns a name from a recording if it is safe as the name of a folder.

    Args:
        drive: the recording, for the error message.
        text: the name.

    Raises:
        InputError: if the name could lead to another folder.
    """
    if not _NAME.fullmatch(text):
        raise InputError(
            f"{drive.name}: {text!r} cannot be the name of a folder"
        )
    return text


def scenario_files(drive: McapDrive, name: str | None = None) -> dict[str, str]:
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
    return {"scenario.yaml": to_yaml(scenario)}


def imu_files(drive: McapDrive) -> dict[str, str]:
    """Returns the file `imu.yaml`, the IMU's noise in Kalibr's format.

    The result maps the file name to its text. The result is empty if the
    recording does not contain the noise.
    """
    return {} if drive.kalibr is None else {"imu.yaml": drive.kalibr}


def structure_files(drive: McapDrive) -> dict[str, str]:
    """Returns the file `structures.json`, the table of structures.

    The result maps the file name to its text. The result is empty if the
    recording contains no such table.
    """
    if drive.instances is None:
        return {}
    table = list(drive.instances.values())
    return {"structures.json": json.dumps(table, indent=1) + "\n"}


def odometry_columns(drive: McapDrive) -> list[np.ndarray]:
    """Returns positions (M, 3) and orientations (M, 4) of a drive's odometry.

    The orientations are unit quaternions x, y, z, w of R_WB. Quaternions in the
    recording may have any length.

    Raises:
        InputError: see `check_odometry`.
    """
    check_odometry(drive)
    quat_xyzw = drive.odometry["quat_xyzw"]
    length = np.linalg.norm(quat_xyzw, axis=1, keepdims=True)
    # A length that is one up to rounding is not changed.
    is_wrong = np.abs(length - 1.0) > _ROUNDING
    unit = np.where(is_wrong, quat_xyzw / length, quat_xyzw)
    return [drive.odometry["position"], unit]


def check_odometry(drive: McapDrive) -> None:
    """Checks the M odometry messages of a drive.

    Raises:
        InputError: a quaternion has no direction, or a coordinate of a position
            is not finite, or not below `poses.FARTHEST`.
    """
    quat_xyzw = drive.odometry["quat_xyzw"]
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.linalg.norm(quat_xyzw, axis=1)
    position = drive.odometry["position"]
    bad = ~(np.isfinite(length) & (length > 0.0))
    # NaN is False here.
    bad |= ~(np.abs(position) < poses.FARTHEST).all(axis=1)
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"{drive.name}: the odometry at"
            f" {drive.odometry['stamp_ns'][row]} ns has the position"
            f" {position[row]} and the quaternion {quat_xyzw[row]}"
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
