"""The file layouts of existing data sets, and what their exporters share.

Frames: world W, vehicle B on the ground, LiDAR S, IMU I.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import json
from pathlib import Path, PurePosixPath
import re

import numpy as np
from scipy.spatial.transform import Rotation
import yaml

from cns_drake.base import poses
from cns_drake.base.drives import mulran_frames
from cns_drake.base.drives.mcap_drive import McapDrive
from cns_drake.base.errors import InputError
from cns_drake.base.points import encode_bin, encode_labels, encode_pcd
from cns_drake.base.poses import FARTHEST
from cns_drake.recording.rosbag2_metadata import to_yaml

# Text that may become the name of a folder; it cannot lead out of its parent.
_NAME = re.compile(r"\w[\w.-]*")
_ROUNDING = 1e-9
_X_CS = np.array(
    [
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
_PROJECTION = np.eye(4)


@dataclass(frozen=True)
class Layout:
    """The files that an export in one format contains for a drive.

    All attributes except the last two are functions that take the drive. Paths
    are relative to the folder that holds all exported drives, unless stated
    otherwise.

    Attributes:
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
    """

    drive_folder: Callable[[McapDrive], PurePosixPath]
    inner_files: Callable[[McapDrive], dict[str, str]]
    outer_files: Callable[[McapDrive], dict[str, str]] = lambda drive: {}
    scan_files: (
        Callable[[McapDrive, int, int, np.ndarray], dict[str, bytes]] | None
    ) = None
    shared_outer_files: bool = False
    has_labels: bool = False


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
    """Returns the file `scenario.yaml` of a drive: file name -> text.

    The result is empty if the recording contains no scenario.

    Args:
        drive: the recording.
        name: name of the drive in the scenario; by default the recording's.
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
    bad |= ~(np.abs(position) < FARTHEST).all(axis=1)  # NaN is False here.
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"{drive.name}: the odometry at"
            f" {drive.odometry['stamp_ns'][row]} ns has the position"
            f" {position[row]} and the quaternion {quat_xyzw[row]}"
        )


def seconds(stamp_ns: int) -> str:
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


def _cns_folder(drive: McapDrive) -> PurePosixPath:
    """Returns <Map>/<Sequence>, e.g. Metropolis/04 for metropolis_04."""
    scenario = drive.scenario or {}
    place = scenario.get("map") or scenario.get("world") or "world"
    name = Path(str(place)).stem
    number = drive.name.removeprefix(f"{name}_")
    return PurePosixPath(
        checked_name(drive, name.capitalize()), checked_name(drive, number)
    )


def _cns_outer_files(drive: McapDrive) -> dict[str, str]:
    files = {"transformation_lidar.yaml": _mount(drive.X_BS)}
    if drive.X_BI is not None:
        files["transformation_imu.yaml"] = _mount(drive.X_BI)
    return files


def _cns_inner_files(drive: McapDrive) -> dict[str, str]:
    odometry, imu = drive.odometry, drive.imu
    columns = odometry_columns(drive)
    files = {"gt.csv": stamped_rows(odometry["stamp_ns"], columns, ",")}
    if imu is not None:
        names = ("quat_xyzw", "angular_velocity", "specific_force")
        columns = [imu[name] for name in names]
        files["imu.csv"] = stamped_rows(imu["stamp_ns"], columns, ",")
    return files | imu_files(drive) | scenario_files(drive)


def _mount(X_BC: np.ndarray) -> str:
    """Returns X_BC, the pose of a sensor C on the vehicle B, as YAML."""
    quat_xyzw = Rotation.from_matrix(X_BC[:3, :3]).as_quat(canonical=True)
    p_BC, rotation = X_BC[:3, 3].tolist(), quat_xyzw.tolist()
    values = {"translation": p_BC, "rotation": rotation}
    return yaml.safe_dump(values, sort_keys=False)


CNS = Layout(
    _cns_folder,
    _cns_inner_files,
    outer_files=_cns_outer_files,
    scan_files=lambda _, frame, stamp_ns, scan: {
        f"pcd/{stamp_ns}.pcd": encode_pcd(scan)
    },
    shared_outer_files=True,
)


def _kitti_number(drive: McapDrive) -> str:
    """Returns the number of a drive: the digits at the end of its name, or 00.

    The second LiDAR of a recording adds 100, and the third 200, since tools for
    KITTI expect numbers.
    """
    digits = re.findall(r"\d*$", drive.name)[0]
    lidar = drive.lidar_names.index(drive.lidar_name)
    return f"{100 * lidar + int(digits or 0):02d}"


def _kitti_inner_files(drive: McapDrive) -> dict[str, str]:
    elapsed_ns = drive.stamps_ns - drive.stamps_ns[0]
    # LiDARs after the first one add their own name.
    is_first = drive.lidar_name == drive.lidar_names[0]
    lidar = drive.lidar_name.strip("/").replace("/", "_")
    name = drive.name if is_first else f"{drive.name}_{lidar}"
    calibration = {f"P{camera}": _PROJECTION for camera in range(4)}
    calibration["Tr"] = _X_CS
    return {
        # Readers of KITTI look for it in `poses`, and those of SemanticKITTI
        # here.
        "poses.txt": _kitti_poses(drive),
        "times.txt": "".join(f"{seconds(ns)}\n" for ns in elapsed_ns.tolist()),
        "calib.txt": "".join(
            f"{key}: {_kitti_rows(X[None])}" for key, X in calibration.items()
        ),
        "first_pose.txt": _kitti_rows(drive.X_WS[:1]),
        **imu_files(drive),
        **structure_files(drive),
        **scenario_files(drive, name),
    }


def _in_kittis_scale(drive: McapDrive, scan: np.ndarray) -> np.ndarray:
    """Returns a scan with its intensities in KITTI's scale, if known.

    Calibrated intensities become a byte / 256 in hundredths, at most 0.99, as
    in the scans of KITTI odometry 00. Ideal intensities, from 0 to 1, stay as
    they are, and so do those of other recorders, whose unit is not known.
    """
    if drive.lidar_section.get("returns") != "calibrated":
        return scan
    # The intensities of this preset are fitted to KITTI's hundredths.
    is_kittis = drive.lidar_section.get("preset") == "hdl-64e"
    hundredths = scan["intensity"] * (1.0 if is_kittis else 100.0 / 256.0)
    scaled = scan.copy()
    scaled["intensity"] = np.minimum(np.rint(hundredths), 99.0) / 100.0
    return scaled


def _kitti_scan_files(
    drive: McapDrive, frame: int, stamp_ns: int, scan: np.ndarray
) -> dict[str, bytes]:
    scan = _in_kittis_scale(drive, scan)
    files = {f"velodyne/{frame:06d}.bin": encode_bin(scan)}
    if {"label", "instance"} <= set(scan.dtype.names or ()):
        files[f"labels/{frame:06d}.label"] = encode_labels(scan)
    return files


def _kitti_poses(drive: McapDrive) -> str:
    """Returns the poses X_C0C of all scans, one row of text each."""
    X_S0S = poses.inverse(drive.X_WS[0]) @ drive.X_WS
    return _kitti_rows(_X_CS @ X_S0S @ poses.inverse(_X_CS))


def _kitti_rows(X: np.ndarray) -> str:
    """Returns the upper 3 x 4 of poses (N, 4, 4), one row of text each."""
    rows = X[:, :3].reshape(-1, 12).tolist()
    return "".join(f"{' '.join(map(repr, row))}\n" for row in rows)


def kitti_layout(number: str | None = None) -> Layout:
    """Returns the layout of KITTI odometry.

    Args:
        number: number of the sequence, as text. By default the digits at the
            end of the drive's name; the second LiDAR of a recording adds 100,
            the third 200.
    """

    def of(drive: McapDrive) -> str:
        return number or _kitti_number(drive)

    return Layout(
        lambda drive: PurePosixPath("sequences", of(drive)),
        _kitti_inner_files,
        outer_files=lambda drive: {
            f"poses/{of(drive)}.txt": _kitti_poses(drive)
        },
        scan_files=_kitti_scan_files,
        has_labels=True,
    )


KITTI = kitti_layout()


def _tum_inner_files(drive: McapDrive) -> dict[str, str]:
    X_WB, X_WS = drive.odometry, drive.X_WS
    quat_WS = Rotation.from_matrix(X_WS[:, :3, :3]).as_quat(canonical=True)
    return {
        "base_link.tum": stamped_rows(
            map(seconds, X_WB["stamp_ns"].tolist()),
            odometry_columns(drive),
            " ",
        ),
        "lidar.tum": stamped_rows(
            map(seconds, drive.stamps_ns.tolist()),
            [X_WS[:, :3, 3], quat_WS],
            " ",
        ),
        **imu_files(drive),
    }


TUM = Layout(
    lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    _tum_inner_files,
)


def _mulran_inner_files(drive: McapDrive) -> dict[str, str]:
    # The vehicle is where MulRan's mount of the LiDAR has it below this LiDAR.
    X_UB = drive.X_WS @ poses.inverse(mulran_frames.X_BS)
    X_UB[:, :3, 3] += mulran_frames.ORIGIN
    rows = X_UB[:, :3].reshape(-1, 12)
    return {
        "global_pose.csv": stamped_rows(drive.stamps_ns.tolist(), [rows], ","),
        **imu_files(drive),
        **scenario_files(drive),
    }


MULRAN = Layout(
    lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    _mulran_inner_files,
    scan_files=lambda _, frame, stamp_ns, scan: {
        f"Ouster/{stamp_ns}.bin": encode_bin(scan)
    },
)
