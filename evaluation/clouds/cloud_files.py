"""Single point clouds: map files, and scans stored one a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from evaluation.clouds.pcd import read_pcd
from evaluation.clouds.ply import read_ply
from evaluation.geometry import points as point_arrays
from evaluation.geometry.poses import FARTHEST
from evaluation.support.errors import InputError


def read_cloud(path: Path) -> np.ndarray:
    """Reads one point cloud; its name's ending tells the format.

    `.pcd` and `.ply` in all their encodings; `.npy` holds N x 3 or N x 4
    numbers or a structured array; `.bin` is KITTI's sequence of float32
    x y z intensity.

    Args:
        path: an existing file.

    Returns:
        Structured array of shape (N,) with fields `x`, `y`, `z` of floating
        point and whatever else the file holds. It may be mapped from the
        file rather than read, so that its size is no matter.

    Raises:
        InputError: if there is no such file, or it is not what its name
            says.
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path}: unknown kind of point cloud (known: {' '.join(_READERS)})"
        )
    try:
        points = reader(path)
        _check_coordinates(points)
        return points
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    except (ValueError, EOFError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {error}") from error


def is_cloud(path: Path) -> bool:
    """Returns whether a file of this name is read by `read_cloud`."""
    return path.suffix.lower() in _READERS


def _check_coordinates(points: np.ndarray) -> None:
    """Refuses coordinates that are none: bytes of something else.

    What is not finite passes: many sensors say so of a beam that met nothing.

    Raises:
        ValueError: if a coordinate is out of this world.
    """
    for name in "xyz":
        far = (np.abs(points[name]) >= FARTHEST) & np.isfinite(points[name])
        if far.any():
            first = int(far.argmax())
            raise ValueError(
                f"{name}: point {first} of {len(points)} is at"
                f" {points[name][first]:g} m"
            )


def _read_npy(path: Path) -> np.ndarray:
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError:
        raise
    except Exception as error:
        # NumPy evaluates the header as Python, and fails in as many ways.
        raise ValueError(
            f"no NumPy array ({type(error).__name__}: {error})"
        ) from error
    if not isinstance(values, np.ndarray):
        values.close()
        raise ValueError("an archive instead of one array")
    if values.dtype.names is not None:
        for name in "xyz":
            field = values.dtype.fields.get(name)
            if field is None or field[0].kind not in "fiu":
                raise ValueError(f"the records have no number {name}")
        return values.reshape(-1)
    if values.ndim != 2 or values.shape[1] not in (3, 4):
        raise ValueError(
            f"an array of shape {values.shape} instead of N x 3 or N x 4"
        )
    if values.dtype.kind not in "fiu":
        raise ValueError(f"{values.dtype} is no type of coordinates")
    if values.dtype.kind != "f":
        values = values.astype(np.float64)
    return point_arrays.from_xyz(values)


def _read_bin(path: Path) -> np.ndarray:
    size = path.stat().st_size
    if size % 16:
        raise ValueError(
            f"{size} bytes is no whole number of points of four float32"
        )
    if size == 0:
        return point_arrays.from_xyz(np.empty((0, 4), dtype="<f4"))
    values = np.memmap(path, dtype="<f4", mode="r").reshape(-1, 4)
    return point_arrays.from_xyz(values)


_READERS: dict[str, Callable[[Path], np.ndarray]] = {
    ".pcd": read_pcd,
    ".ply": read_ply,
    ".npy": _read_npy,
    ".bin": _read_bin,
}
