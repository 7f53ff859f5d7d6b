"""The layout of the CNS data set."""

from pathlib import Path, PurePosixPath

import numpy as np
from scipy.spatial.transform import Rotation
import yaml

from cns_drake.base import encode_pcd
from cns_drake.drives import McapDrive
from cns_drake.export.layout import (
    Layout,
    checked_name,
    imu_files,
    odometry_columns,
    scenario_files,
    stamped_rows,
)


def _drive_folder(drive: McapDrive) -> PurePosixPath:
    """Returns <Map>/<Sequence>, e.g. Metropolis/04 for metropolis_04."""
    scenario = drive.scenario or {}
    place = scenario.get("map") or scenario.get("world") or "world"
    name = Path(str(place)).stem
    number = drive.name.removeprefix(f"{name}_")
    return PurePosixPath(
        checked_name(drive, name.capitalize()), checked_name(drive, number)
    )


def _outer_files(drive: McapDrive) -> dict[str, str]:
    files = {"transformation_lidar.yaml": _mount_yaml(drive.X_BS)}
    if drive.X_BI is not None:
        files["transformation_imu.yaml"] = _mount_yaml(drive.X_BI)
    return files


def _inner_files(drive: McapDrive) -> dict[str, str]:
    odometry, imu = drive.odometry, drive.imu
    columns = odometry_columns(drive)
    files = {"gt.csv": stamped_rows(odometry["stamp_ns"], columns, ",")}
    if imu is not None:
        names = ("quat_xyzw", "angular_velocity", "specific_force")
        columns = [imu[name] for name in names]
        files["imu.csv"] = stamped_rows(imu["stamp_ns"], columns, ",")
    return files | imu_files(drive) | scenario_files(drive)


def _mount_yaml(X_BC: np.ndarray) -> str:
    """Returns X_BC, the pose of a sensor C on the vehicle B, as YAML."""
    quat_xyzw = Rotation.from_matrix(X_BC[:3, :3]).as_quat(canonical=True)
    p_BC, rotation = X_BC[:3, 3].tolist(), quat_xyzw.tolist()
    values = {"translation": p_BC, "rotation": rotation}
    return yaml.safe_dump(values, sort_keys=False)


CNS = Layout(
    _drive_folder,
    _inner_files,
    outer_files=_outer_files,
    scan_files=lambda _, frame, stamp_ns, scan: {
        f"pcd/{stamp_ns}.pcd": encode_pcd(scan)
    },
    shared_outer_files=True,
)
