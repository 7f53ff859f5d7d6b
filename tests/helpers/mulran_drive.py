"""Small drives in the format of MulRan."""

from helpers.dataset_folders import (
    SCAN_PERIOD_NS,
    T0_NS,
    UTM,
    make_points,
    make_poses,
    write_bytes,
    write_matrices,
    xyzi,
)

NUM_SCANS = 5
POSE_PERIOD_NS = 10_000_001


def scan_stamps(number=NUM_SCANS):
    return [T0_NS + i * SCAN_PERIOD_NS for i in range(number)]


def pose_table(start_ns=-3 * POSE_PERIOD_NS, number=60):
    stamps_ns = [T0_NS + start_ns + i * POSE_PERIOD_NS for i in range(number)]
    X_UB = make_poses(number, step=0.02)
    X_UB[:, :3, 3] += UTM
    return stamps_ns, X_UB


def write_drive(folder, *, parent="sensor_data", table=None, points=100):
    """Writes a drive; returns the coordinates of its scans."""
    stamps_ns, X_UB = pose_table() if table is None else table
    write_matrices(folder / "global_pose.csv", stamps_ns, X_UB)
    scans = [make_points(points, seed=i) for i in range(NUM_SCANS)]
    for stamp, scan in zip(scan_stamps(), scans, strict=True):
        write_bytes(folder / parent / "Ouster" / f"{stamp}.bin", xyzi(scan))
    return scans
