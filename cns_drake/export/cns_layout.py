"""The layout in which the CNS data set was published.

Frames: world W, vehicle B on the ground, LiDAR S, IMU I.
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np
from scipy.spatial.transform import Rotation
import yaml

from cns_drake.base.cloud_writing import encode_pcd
from cns_drake.base.recordings.mcap_drive import McapDrive
from cns_drake.export.drive_layout import (
    Layout,
    checked_name,
    imu_files,
    join_rows,
    scenario_files,
    unit_quaternions,
)


def _drive_folder(drive: McapDrive) -> PurePosixPath:
    """Returns <Map>/<Sequence>, e.g. Metropolis/04 of metropolis_04."""
    scenario = drive.scenario or {}
    place = scenario.get("map") or scenario.get("world") or "world"
    name = Path(str(place)).stem
    number = drive.name.removeprefix(f"{name}_")
    return PurePosixPath(
        checked_name(drive, name.capitalize()),
        checked_name(drive, number),
    )


def _outer_files(drive: McapDrive) -> dict[str, str]:
    files = {"transformation_lidar.yaml": _mount(drive.X_BS)}
    if drive.X_BI is not None:
        files["transformation_imu.yaml"] = _mount(drive.X_BI)
    return files


def _inner_files(drive: McapDrive) -> dict[str, str]:
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


def _scan_files(
    frame: int, stamp_ns: int, scan: np.ndarray
) -> dict[str, bytes]:
    del frame
    return {f"pcd/{stamp_ns}.pcd": encode_pcd(scan)}


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
    drive_folder=_drive_folder,
    outer_files=_outer_files,
    inner_files=_inner_files,
    scan_files=_scan_files,
    shared_outer_files=True,
    has_labels=False,
)
