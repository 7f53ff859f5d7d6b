"""The layout of the CNS data set."""

from pathlib import Path, PurePosixPath

import numpy as np
from scipy.spatial.transform import Rotation
import yaml

from cns_drake.export.layout import (
    Layout,
    PoseColumns,
    checked_name,
    imu_files,
    lidar_poses,
    scenario_files,
    stamped_rows,
    vehicle_notes,
    vehicle_poses,
)
from evaluation.base import InputError, encode_pcd
from evaluation.drives import Drive


def _drive_folder(drive: Drive) -> PurePosixPath:
    """Returns <Map>/<Sequence>, e.g. Metropolis/04 for metropolis_04."""
    scenario = drive.scenario or {}
    place = scenario.get("map") or scenario.get("world") or "world"
    name = Path(str(place)).stem
    number = drive.name.removeprefix(f"{name}_")
    return PurePosixPath(
        checked_name(drive, name.capitalize()), checked_name(drive, number)
    )


def _outer_files(drive: Drive) -> dict[str, str]:
    X_BS = _poses(drive).X_BS
    height = X_BS[2, 3]
    if height < 0.0:
        # Readers would take the mounting pose for its inverse.
        raise InputError(
            f"{drive.name}: the LiDAR is mounted at z = {height:g} m, below the"
            " vehicle, which this format does not have; use another one"
        )
    files = {"transformation_lidar.yaml": _mount_yaml(X_BS)}
    if drive.X_BI is not None:
        files["transformation_imu.yaml"] = _mount_yaml(drive.X_BI)
    return files


def _inner_files(drive: Drive) -> dict[str, str]:
    imu = drive.imu
    poses = _poses(drive)
    files = {"gt.csv": stamped_rows(poses.stamps_ns, poses.columns, ",")}
    if imu is not None:
        names = ("quat_xyzw", "angular_velocity", "specific_force")
        columns = [imu[name] for name in names]
        files["imu.csv"] = stamped_rows(imu["stamp_ns"], columns, ",")
    return files | imu_files(drive) | scenario_files(drive)


def _poses(drive: Drive) -> PoseColumns:
    """Returns the poses of the vehicle; without them, those of the LiDAR."""
    return vehicle_poses(drive) or lidar_poses(drive)


def _mount_yaml(X_BC: np.ndarray) -> str:
    """Returns X_BC, the pose of a sensor C on the vehicle B, as YAML."""
    quat_xyzw = Rotation.from_matrix(X_BC[:3, :3]).as_quat(canonical=True)
    p_BC, rotation = X_BC[:3, 3].tolist(), quat_xyzw.tolist()
    values = {"translation": p_BC, "rotation": rotation}
    return yaml.safe_dump(values, sort_keys=False)


LAYOUT = Layout(
    {
        "transformation_lidar.yaml": (
            "pose of the LiDAR in the vehicle's frame: translation [m] and "
            "rotation (quaternion x y z w)"
        ),
        "transformation_imu.yaml": (
            "pose of the IMU in the vehicle's frame: translation [m] and "
            "rotation (quaternion x y z w)"
        ),
        "<Map>/<Sequence>/gt.csv": (
            "t, x, y, z, qx, qy, qz, qw: pose of the vehicle's frame (on "
            "the ground, under the LiDAR; forward, left, up) in the world; "
            "t in nanoseconds; pose of the LiDAR for a drive without odometry"
        ),
        "<Map>/<Sequence>/imu.csv": (
            "t, qx, qy, qz, qw, wx, wy, wz, ax, ay, az: orientation of the "
            "IMU in the world; angular velocity [rad/s] and specific force "
            "[m/s^2] along the axes of the IMU"
        ),
        "<Map>/<Sequence>/pcd/<t>.pcd": (
            "x, y, z [m] and intensity, float32, in the LiDAR's frame at "
            "the time t; intensities have the unit of the recording"
        ),
        "<Map>/<Sequence>/imu.yaml": (
            "noise of the IMU in Kalibr's format; missing for an IMU "
            "without noise"
        ),
        "<Map>/<Sequence>/scenario.yaml": (
            "scenario of the drive, if it was simulated"
        ),
    },
    _drive_folder,
    _inner_files,
    outer_files=_outer_files,
    scan_files=lambda _, frame, stamp_ns, scan: {
        f"pcd/{stamp_ns}.pcd": encode_pcd(scan)
    },
    shared_outer_files=True,
    notes=vehicle_notes,
)
