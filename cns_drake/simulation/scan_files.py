"""Files of a single scan: KITTI's format, NumPy arrays and PCD."""

import io
from pathlib import Path

import numpy as np

from cns_drake.base import (
    InputError,
    completing,
    encode_bin,
    encode_pcd,
    make_folder,
)


def check_ending(path: Path) -> None:
    """Checks that `save_scan` knows the format of a file from its ending.

    Raises:
        InputError: the ending is not .pcd, .bin or .npy.
    """
    if path.suffix not in _ENCODERS:
        raise InputError(
            f"{path}: unknown ending '{path.suffix}'; use one of "
            f"{', '.join(_ENCODERS)}"
        )


def save_scan(scan: np.ndarray, path: Path) -> None:
    """Saves x, y, z and intensity of a scan to a file.

    The ending of the file name sets the format: `.bin` is KITTI's format
    (float32 x y z intensity), `.npy` is an array (N, 4) of the same numbers,
    and `.pcd` is a binary PCD file.

    Args:
        scan: structured array (N,) with these four fields.
        path: the file.

    Raises:
        InputError: the file has another ending or cannot be written.
    """
    check_ending(path)
    make_folder(path.parent)
    with completing(path) as part:
        part.write_bytes(_ENCODERS[path.suffix](scan))


def _encode_npy(scan: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.frombuffer(encode_bin(scan), "<f4").reshape(-1, 4))
    return stream.getvalue()


_ENCODERS = {".bin": encode_bin, ".npy": _encode_npy, ".pcd": encode_pcd}
