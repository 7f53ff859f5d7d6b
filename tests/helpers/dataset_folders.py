"""Writes small drives in the formats of public data sets, for tests.

Written from the formats' descriptions with struct and plain text, so that
the readers are tested against a second hand.
"""

import struct

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

# Nanoseconds that a double cannot represent.
T0_NS = 1_561_000_444_390_857_631
SCAN_PERIOD_NS = 100_000_003
UTM = np.array([355_123.25, 4_026_987.75, 61.5])


def make_poses(number, seed=1, step=0.1):
    """Returns poses (N, 4, 4) along a winding drive, tilted at random."""
    rng = np.random.default_rng([seed, number])
    s = step * np.arange(number)
    angles = np.stack(
        [0.05 * np.sin(s), 0.03 * np.cos(2.0 * s), 2.0 + 0.1 * s], axis=1
    )
    X = np.tile(np.eye(4), (number, 1, 1))
    X[:, :3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    X[:, :3, 3] = np.stack([4.0 * s, np.sin(s), 0.1 * s], axis=1)
    X[:, :3, 3] += rng.uniform(-0.01, 0.01, (number, 3))
    return X


def make_points(number, seed=2):
    """Returns coordinates (N, 3) in single precision, none of them zero."""
    rng = np.random.default_rng([seed, number])
    points = rng.uniform(0.5, 80.0, (number, 3))
    return (points * rng.choice([-1, 1], points.shape)).astype(np.float32)


def write_matrices(path, stamps_ns, X, separator=","):
    """Writes rows of a time and the upper 3 x 4 of a pose."""
    lines = []
    for i, pose in enumerate(X):
        words = [] if stamps_ns is None else [str(stamps_ns[i])]
        words += [repr(float(value)) for value in pose[:3].ravel()]
        lines.append(separator.join(words))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def write_quaternions(path, stamps, X, separator=" ", header=""):
    """Writes rows of a time, a position and a quat_xyzw."""
    lines = [header] if header else []
    for stamp, pose in zip(stamps, X, strict=True):
        quat = Rotation.from_matrix(pose[:3, :3]).as_quat()
        values = [*pose[:3, 3], *quat]
        words = [str(stamp), *(repr(float(value)) for value in values)]
        lines.append(separator.join(words))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def pack(layout, rows):
    """Returns rows of numbers packed, little-endian, without padding."""
    return b"".join(struct.pack(f"<{layout}", *row) for row in rows)


def write_bytes(path, data):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def xyzi(points):
    """Returns points as float32 x y z intensity."""
    return pack("ffff", [(*p, i % 100) for i, p in enumerate(points.tolist())])


def write_pcd(path, points):
    """Writes a binary PCD file of x y z intensity."""
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
        "FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {len(points)}\nDATA binary\n"
    )
    return write_bytes(path, header.encode() + xyzi(points))


def stored(points, *names):
    """Returns fields of a scan as columns of doubles."""
    return np.stack([points[name].astype(float) for name in names], axis=1)


def interpolated(stamps_ns, X, at_ns):
    """Returns the pose at a time by scipy's SLERP, as an oracle."""
    t = (np.asarray(stamps_ns) - T0_NS) * 1e-9
    now = (at_ns - T0_NS) * 1e-9
    pose = np.eye(4)
    pose[:3, :3] = Slerp(t, Rotation.from_matrix(X[:, :3, :3]))(now).as_matrix()
    for axis in range(3):
        pose[axis, 3] = np.interp(now, t, X[:, axis, 3])
    return pose
