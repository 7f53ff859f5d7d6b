"""Scans in file formats that hold one scan a file."""

from __future__ import annotations

import numpy as np

_XYZI = ("x", "y", "z", "intensity")


def to_xyzi(scan: np.ndarray) -> np.ndarray:
    """Returns x, y, z and intensity of a scan as (N, 4) little-endian float32.

    Raises:
        ValueError: if the scan lacks one of these fields.
    """
    xyzi = np.empty((len(scan), 4), dtype="<f4")
    for column, name in enumerate(_XYZI):
        xyzi[:, column] = scan[name]
    return xyzi


def encode_bin(scan: np.ndarray) -> bytes:
    """Returns a scan as KITTI stores it: float32 x y z intensity."""
    return to_xyzi(scan).tobytes()


def encode_pcd(scan: np.ndarray) -> bytes:
    """Returns a scan as a binary PCD file of float32 x y z intensity."""
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\n"
        "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
        f"COUNT 1 1 1 1\nWIDTH {len(scan)}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(scan)}\nDATA binary\n"
    )
    return header.encode() + encode_bin(scan)


def encode_labels(scan: np.ndarray) -> bytes:
    """Returns a scan's labels as SemanticKITTI stores them.

    A point is a uint32: its label, and 2^16 times its instance.
    """
    label = scan["label"].astype("<u4")
    return (label | scan["instance"].astype("<u4") << 16).tobytes()
