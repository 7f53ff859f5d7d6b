"""The layouts of existing data sets, and the common part of their exporters.

Frames: world W, vehicle B on the ground, LiDAR S, IMU I."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
import json
from pathlib import Path, PurePosixPath
import re

import numpy as np
from scipy.spatial.transform import Rotation
import yaml

from cns_drake.base import poses
from cns_drake.base.drives.mcap_drive import McapDrive
from cns_drake.base.errors import InputError
from cns_drake.base.points import encode_bin, encode_labels, encode_pcd
from cns_drake.base.poses import FARTHEST
from cns_drake.recording.rosbag2_metadata import to_yaml

# Text that may become the name of a folder: it cannot lead out of it.
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
        name: the drive's name; by default the recording's.
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


def _cns_folder(drive: McapDrive) -> PurePosixPath:
    """Returns <Map>/<Sequence>, e.g. Metropolis/04 of metropolis_04."""
    scenario = drive.scenario or {}
    place = scenario.get("map") or scenario.get("world") or "world"
    name = Path(str(place)).stem
    number = drive.name.removeprefix(f"{name}_")
    return PurePosixPath(
        checked_name(drive, name.capitalize()),
        checked_name(drive, number),
    )


def _cns_outer_files(drive: McapDrive) -> dict[str, str]:
    files = {"transformation_lidar.yaml": _mount(drive.X_BS)}
    if drive.X_BI is not None:
        files["transformation_imu.yaml"] = _mount(drive.X_BI)
    return files


def _cns_inner_files(drive: McapDrive) -> dict[str, str]:
    poses = drive.odometry
    files = {
        "gt.csv": join_rows(
            zip(
                poses["stamp_ns"].tolist(),
                *poses["position"].T.tolist(),
                *unit_quaternions(drive).T.tolist(),
                strict=True,
            ),
            ",",
        )
    }
    imu = drive.imu
    if imu is not None:
        files["imu.csv"] = join_rows(
            zip(
                imu["stamp_ns"].tolist(),
                *imu["quat_xyzw"].T.tolist(),
                *imu["angular_velocity"].T.tolist(),
                *imu["specific_force"].T.tolist(),
                strict=True,
            ),
            ",",
        )
    return files | imu_files(drive) | scenario_files(drive)


def _mount(X_BC: np.ndarray) -> str:
    """Returns the pose of a sensor C on the vehicle as YAML."""
    quat_xyzw = Rotation.from_matrix(X_BC[:3, :3]).as_quat(canonical=True)
    values = {
        "translation": X_BC[:3, 3].tolist(),
        "rotation": quat_xyzw.tolist(),
    }
    return yaml.safe_dump(values, sort_keys=False)


CNS = Layout(
    files={
        "transformation_lidar.yaml": "pose of the LiDAR in the vehicle's"
        " frame: translation [m] and rotation (quaternion x y z w)",
        "transformation_imu.yaml": "pose of the IMU, likewise",
        "<Map>/<Sequence>/gt.csv": "t, x, y, z, qx, qy, qz, qw: pose of the"
        " vehicle's frame (on the ground, under the LiDAR; forward, left,"
        " up) in the world; t in nanoseconds",
        "<Map>/<Sequence>/imu.csv": "t, qx, qy, qz, qw, wx, wy, wz, ax, ay,"
        " az: orientation of the IMU in the world, angular velocity [rad/s]"
        " and specific force [m/s^2] in its own axes",
        "<Map>/<Sequence>/pcd/<t>.pcd": "x, y, z [m] and intensity, float32,"
        " in the LiDAR's frame",
        "<Map>/<Sequence>/imu.yaml": "noise of the IMU, if it has noise, as"
        " Kalibr has it",
        "<Map>/<Sequence>/scenario.yaml": "what was simulated",
    },
    drive_folder=_cns_folder,
    outer_files=_cns_outer_files,
    inner_files=_cns_inner_files,
    scan_files=lambda _, stamp_ns, scan: {
        f"pcd/{stamp_ns}.pcd": encode_pcd(scan)
    },
    shared_outer_files=True,
    has_labels=False,
)


def _kitti_number(drive: McapDrive) -> str:
    """Returns the drive's number: the digits its name ends with, or 00.

    The second LiDAR of a recording adds 100, the third 200: tools for KITTI
    want numbers.
    """
    digits = re.findall(r"\d*$", drive.name)[0]
    lidar = drive.lidar_names.index(drive.lidar_name)
    return f"{100 * lidar + int(digits or 0):02d}"


def _kitti_name(drive: McapDrive) -> str:
    """Returns the drive's name; later LiDARs add their own name."""
    if drive.lidar_name == drive.lidar_names[0]:
        return drive.name
    return f"{drive.name}_{drive.lidar_name}"


def _kitti_inner_files(drive: McapDrive) -> dict[str, str]:
    elapsed_ns = drive.stamps_ns - drive.stamps_ns[0]
    calibration = {f"P{camera}": _PROJECTION for camera in range(4)}
    calibration["Tr"] = _X_CS
    return {
        # Readers of KITTI look in `poses`, those of SemanticKITTI here.
        "poses.txt": _kitti_poses(drive),
        "times.txt": "".join(f"{seconds(ns)}\n" for ns in elapsed_ns.tolist()),
        "calib.txt": "".join(
            f"{name}: {_kitti_rows(X[None])}" for name, X in calibration.items()
        ),
        "first_pose.txt": _kitti_rows(drive.X_WS[:1]),
        **imu_files(drive),
        **structure_files(drive),
        **scenario_files(drive, _kitti_name(drive)),
    }


def _kitti_scan_files(
    frame: int, stamp_ns: int, scan: np.ndarray
) -> dict[str, bytes]:
    del stamp_ns
    files = {f"velodyne/{frame:06d}.bin": encode_bin(scan)}
    if {"label", "instance"} <= set(scan.dtype.names or ()):
        files[f"labels/{frame:06d}.label"] = encode_labels(scan)
    return files


def _kitti_poses(drive: McapDrive) -> str:
    """Returns X_C0C of each scan as a row of text."""
    X_S0S = poses.inverse(drive.X_WS[0]) @ drive.X_WS
    return _kitti_rows(_X_CS @ X_S0S @ poses.inverse(_X_CS))


def _kitti_rows(X: np.ndarray) -> str:
    """Returns the upper 3 x 4 of each pose (N, 4, 4) as a row of text."""
    return join_rows(X[:, :3].reshape(-1, 12).tolist(), " ")


KITTI = Layout(
    files={
        "<NN>": "the drive's number, plus 100 for the second LiDAR of its"
        " recording, plus 200 for the third",
        "poses/<NN>.txt": "upper 3 x 4 of the camera's pose in its frame at"
        " the first scan, a row a scan",
        "sequences/<NN>/poses.txt": "the same, at the place where tools for "
        "SemanticKITTI look",
        "sequences/<NN>/calib.txt": "Tr: upper 3 x 4 of the LiDAR's pose in"
        " the camera's frame. There is no camera: its axes (right, down,"
        " forward) are put into the LiDAR, and P0 to P3 are the identity",
        "sequences/<NN>/times.txt": "seconds since the first scan",
        "sequences/<NN>/velodyne/<frame>.bin": "x, y, z [m] and intensity,"
        " float32, in the LiDAR's frame",
        "sequences/<NN>/labels/<frame>.label": "uint32 a point: class (id of "
        "SemanticKITTI) + 65536 * "
        "instance; 252 to 259 for "
        "structures that are absent "
        "in another stage (absent_in "
        "in structures.json)",
        "sequences/<NN>/first_pose.txt": "upper 3 x 4 of the LiDAR's pose in"
        " the world at the first scan, the same world for all drives of a"
        " map",
        "sequences/<NN>/structures.json": "the table of instances, and the "
        "other stage in which they are "
        "absent, if asked for",
        "sequences/<NN>/imu.yaml": "noise of the IMU, if it has noise, as"
        " Kalibr has it",
        "sequences/<NN>/scenario.yaml": "what was simulated",
    },
    drive_folder=lambda drive: PurePosixPath("sequences", _kitti_number(drive)),
    outer_files=lambda drive: {
        f"poses/{_kitti_number(drive)}.txt": _kitti_poses(drive)
    },
    inner_files=_kitti_inner_files,
    scan_files=_kitti_scan_files,
    shared_outer_files=False,
    has_labels=True,
)


def _tum_inner_files(drive: McapDrive) -> dict[str, str]:
    X_WB = drive.odometry
    X_WS = drive.X_WS
    R_WS = Rotation.from_matrix(X_WS[:, :3, :3])
    return {
        "base_link.tum": _tum_rows(
            X_WB["stamp_ns"], X_WB["position"], unit_quaternions(drive)
        ),
        "lidar.tum": _tum_rows(
            drive.stamps_ns, X_WS[:, :3, 3], R_WS.as_quat(canonical=True)
        ),
        **imu_files(drive),
    }


def _tum_rows(
    stamps_ns: np.ndarray, position: np.ndarray, quat_xyzw: np.ndarray
) -> str:
    """Returns N poses as rows; (N,) [ns], (N, 3) [m] and (N, 4)."""
    numbers = np.hstack([position, quat_xyzw]).tolist()
    return "".join(
        f"{seconds(stamp_ns)} {' '.join(map(repr, row))}\n"
        for stamp_ns, row in zip(stamps_ns.tolist(), numbers, strict=True)
    )


TUM = Layout(
    files={
        "<drive>/base_link.tum": "timestamp tx ty tz qx qy qz qw: pose of"
        " the vehicle's frame (on the ground, under the LiDAR; forward, left,"
        " up) in the world, a row for each message of the odometry; seconds"
        " and metres",
        "<drive>/lidar.tum": "pose of the LiDAR in the world, likewise, a"
        " row a scan",
        "<drive>/imu.yaml": "noise of the IMU, if it has noise, as Kalibr"
        " has it",
    },
    drive_folder=lambda drive: PurePosixPath(checked_name(drive, drive.name)),
    outer_files=lambda drive: {},
    inner_files=_tum_inner_files,
    scan_files=None,
    shared_outer_files=False,
    has_labels=False,
)
