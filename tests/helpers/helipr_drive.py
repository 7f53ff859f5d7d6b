"""Small drives in the format of HeLiPR."""

import numpy as np

from helpers.dataset_folders import (
    SCAN_PERIOD_NS,
    UTM,
    make_points,
    make_poses,
    pack,
    write_bytes,
    write_quaternions,
)

# The last stamp with short records of Aeva.
CHANGE_NS = 1691936557946849179
NUM_SCANS = 4
# Layout of struct, bytes, and the numbers of point i after x y z.
FORMATS = {
    "Ouster": (
        "ffffIHHH",
        26,
        lambda i: (0.5 * i, 97656 * i, 1000 + i, i % 128, 60000 + i),
    ),
    "Velodyne": ("ffffHf", 22, lambda i: (2.0 * i, i % 16, 0.25 * i)),
    "Avia": ("fffBBBI", 19, lambda i: (i, 16, i % 6, 4_000_000_000 + i)),
    "Aeva": (
        "fffffiBf",
        29,
        lambda i: (0.1 * i, -3.0, -500 + i, i % 64, 7.0 * i),
    ),
}
EARLY_AEVA = ("fffffiB", 25, lambda i: (0.1 * i, -3.0, -500 + i, i % 64))


def records(layout, points):
    shape, size, rest = layout
    rows = [(*p, *rest(i)) for i, p in enumerate(points.tolist())]
    data = pack(shape, rows)
    assert len(data) == size * len(points)
    return data, np.array([rest(i) for i in range(len(points))])


def stamps(start_ns=CHANGE_NS + 1):
    return [start_ns + i * SCAN_PERIOD_NS for i in range(NUM_SCANS)]


def write_drive(
    folder,
    lidars=tuple(FORMATS),
    *,
    stamps_ns=None,
    poses_stamps_ns=None,
    ground_truth=("local", "global"),
):
    """Writes a drive; returns stamps and poses in its local frame."""
    stamps_ns = stamps() if stamps_ns is None else stamps_ns
    pose_stamps = stamps_ns if poses_stamps_ns is None else poses_stamps_ns
    X_LS = make_poses(len(pose_stamps))
    X_US = X_LS.copy()
    X_US[:, :3, 3] += UTM
    for lidar in lidars:
        for i, stamp in enumerate(stamps_ns):
            layout = FORMATS[lidar]
            if lidar == "Aeva" and stamp <= CHANGE_NS:
                layout = EARLY_AEVA
            data, _ = records(layout, make_points(120, seed=i))
            write_bytes(folder / "LiDAR" / lidar / f"{stamp}.bin", data)
        for kind, X in (("local", X_LS), ("global", X_US)):
            prefix = "global_" if kind == "global" else ""
            if kind in ground_truth:
                path = folder / "LiDAR_GT" / f"{prefix}{lidar}_gt.txt"
                write_quaternions(path, pose_stamps, X)
    return stamps_ns, X_LS
