"""Writes a drive of eight scans in the layout of each data set."""

import shutil

import numpy as np

from helpers import helipr_drive
from helpers.dataset_folders import (
    write_bytes,
    write_matrices,
    write_pcd,
    write_quaternions,
    xyzi,
)
from helpers.drive_files import make_scan, write_recording, yaw_pose

NUM_SCANS = 8
STAMPS_NS = 10**9 + 100_000_000 * np.arange(NUM_SCANS)
# Poses of the vehicle: 15 m/s, in a slight bend.
X_WB = np.array([yaw_pose(1.5 * k, 0.1 * k, 0.0, 0.04 * k) for k in range(8)])


def mcap(folder, scans):
    shutil.rmtree(folder, ignore_errors=True)
    write_recording(folder, [make_scan(one) for one in scans], list(X_WB))


def mulran(folder, scans):
    write_matrices(folder / "global_pose.csv", STAMPS_NS, X_WB)
    for stamp, points in zip(STAMPS_NS, scans, strict=True):
        write_bytes(folder / "Ouster" / f"{stamp}.bin", xyzi(points))


def helipr(folder, scans):
    write_quaternions(folder / "LiDAR_GT" / "Ouster_gt.txt", STAMPS_NS, X_WB)
    for stamp, points in zip(STAMPS_NS, scans, strict=True):
        data, _ = helipr_drive.records(
            helipr_drive.FORMATS["Ouster"], points.astype(np.float32)
        )
        write_bytes(folder / "LiDAR" / "Ouster" / f"{stamp}.bin", data)


def nclt(folder, scans):
    rows = [
        f"{stamp // 1000},{k * 1.5},0.0,-3.0,0.0,0.0,{0.03 * k}"
        for k, stamp in enumerate(STAMPS_NS)
    ]
    table = folder.parent / f"groundtruth_{folder.name}.csv"
    write_bytes(table, "\n".join(rows).encode())
    origin, sign = np.array([0.002, -0.004, -0.957]), [1.0, -1.0, -1.0]
    record = np.dtype([("p", "<u2", 3), ("intensity", "u1"), ("laser", "u1")])
    for stamp, points in zip(STAMPS_NS, scans, strict=True):
        stored = np.zeros(len(points), record)
        stored["p"] = np.rint((points * sign + origin + 100.0) / 0.005)
        name = f"{stamp // 1000}.bin"
        write_bytes(folder / "velodyne_sync" / name, stored.tobytes())


def boreas(folder, scans):
    rows = [
        ",".join(
            map(str, [stamp // 1000, 1.5 * k, *[0] * 7, -0.03 * k, 0, 0, 0])
        )
        for k, stamp in enumerate(STAMPS_NS)
    ]
    table = folder / "applanix" / "lidar_poses.csv"
    write_bytes(table, "\n".join(rows).encode())
    for stamp, points in zip(STAMPS_NS, scans, strict=True):
        stored = np.zeros((len(points), 6), "<f4")
        stored[:, :3] = points
        name = f"{stamp // 1000}.bin"
        write_bytes(folder / "lidar" / name, stored.tobytes())


def kitti(folder, scans, X_WS=X_WB, times=None):
    for k, points in enumerate(scans):
        write_bytes(folder / "velodyne" / f"{k:06d}.bin", xyzi(points))
    times = STAMPS_NS * 1e-9 if times is None else times
    (folder / "times.txt").write_text("".join(f"{t:.9f}\n" for t in times))
    write_matrices(folder / "poses.txt", None, X_WS, " ")


def cns(folder, scans):
    write_quaternions(folder / "gt.csv", STAMPS_NS, X_WB, ",")
    for stamp, points in zip(STAMPS_NS, scans, strict=True):
        path = folder / "pcd" / f"{stamp}.pcd"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_pcd(path, points)


WRITERS = {
    one.__name__: one
    for one in (boreas, cns, helipr, kitti, mcap, mulran, nclt)
}
