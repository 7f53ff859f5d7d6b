"""Single point clouds: map files, and scans with a file each."""

from collections.abc import Callable, Iterator
import functools
from pathlib import Path
import sys

import numpy as np

from evaluation.base import (
    InputError,
    check_range,
    check_regular,
    poses,
    reading,
    user_errors,
    value_errors,
)
from evaluation.clouds.notes import OnNote, no_note
from evaluation.clouds.npy_files import read_npy_blocks
from evaluation.clouds.pcd_files import read_pcd
from evaluation.clouds.ply_files import read_ply
from evaluation.clouds.record_reading import read_records

# Least rounding step of coordinates at which surfaces look blurred [m].
_COARSE_STEP = 0.03
# A function that reads a file; its second argument is the number of points per
# block.
_Reader = Callable[[Path, int, OnNote], Iterator[np.ndarray]]
# Columns of a `.bin` file, and ending of the names that nuScenes gives its own.
_COLUMNS = ("x", "y", "z", "intensity")
_NUSCENES = ".pcd.bin"
_NUSCENES_COLUMNS = 5
# Number of points of a map that are read at a time.
_BLOCK = 1 << 18


def read_cloud(
    path: Path, columns: int | None = None, on_note: OnNote = no_note
) -> np.ndarray:
    """Returns the points of a point cloud file.

    The ending of the file's name gives the format: `.pcd` and `.ply` in all
    their encodings; `.npy` with an N x 3 or N x 4 array or a structured array;
    `.bin` with float32 numbers: x, y, z and intensity of each point, as in
    KITTI, and the ring, as in nuScenes, whose files are named `*.pcd.bin`.

    Args:
        path: an existing file of a scan; see `read_blocks` for maps.
        columns: number of float32 numbers for each point in a `.bin`; by
            default four, or five if the name ends in `.pcd.bin`.
        on_note: is called with notes on how the file was read.

    Returns:
        Structured array of shape (N,) with floating-point fields `x`, `y`, `z`
        and all other fields of the file.

    Raises:
        InputError: if there is no such file, or its content does not match its
            ending.
    """
    (points,) = read_blocks(path, columns, on_note, block=sys.maxsize)
    return points


def read_blocks(
    path: Path,
    columns: int | None = None,
    on_note: OnNote = no_note,
    block: int = _BLOCK,
) -> Iterator[np.ndarray]:
    """Reads a point cloud of any size in parts; see `read_cloud`.

    Args:
        path: an existing file.
        columns: see `read_cloud`.
        on_note: see `read_cloud`.
        block: number of points in a part.

    Yields:
        At least one part, maybe empty.

    Raises:
        InputError: see `read_cloud`; raised also between parts, e.g. if the
            file is cut off meanwhile.
    """
    path = Path(path)
    reader = _find_reader(path)
    if reader is _read_bin:
        reader = functools.partial(_read_bin, columns=columns)
    with user_errors(path), value_errors(path):
        check_regular(path)
        read = 0
        is_noted = False
        blocks = reader(path, block, on_note)
        while True:
            with reading(path):
                points = next(blocks, None)
            if points is None:
                return
            check_range(points, poses.FARTHEST, first=read)
            read += len(points)
            if not is_noted and (step_note := coarse_note(points)):
                is_noted = True
                on_note(f"{path}: {step_note}")
            yield points


def coarse_note(points: np.ndarray) -> str:
    """Returns a note on coordinates whose type is coarse; "" if it is not.

    A type is coarse if the step between its numbers is, at the farthest point.
    """
    steps = {}
    for axis in "xyz":
        values = points[axis]
        farthest = np.abs(values).max(where=np.isfinite(values), initial=0)
        steps[axis] = float(np.spacing(farthest))
    axis = max(steps, key=lambda axis: steps[axis])
    if steps[axis] < _COARSE_STEP:
        return ""
    return (
        f"so far from the origin {points.dtype[axis].name} has steps of"
        f" {steps[axis]:.2g} m; write float64, or from a nearer origin"
    )


def bin_dtype(path: Path, columns: int | None = None) -> np.dtype:
    """Returns the type of the points in a `.bin` file, which has no header.

    Args:
        path: an existing file.
        columns: number of columns, see `read_cloud`.

    Returns:
        Float32 `x`, `y`, `z`, `intensity`, `column_5`, `column_6` ...

    Raises:
        ValueError: the file does not contain a whole number of such points.
    """
    usual = len(_COLUMNS)
    if path.name.lower().endswith(_NUSCENES):
        usual = _NUSCENES_COLUMNS
    number = usual if columns is None else columns
    if number < 3:
        raise ValueError(f"columns: {number} is less than 3")
    more = [f"column_{k + 1}" for k in range(len(_COLUMNS), number)]
    names = [*_COLUMNS[:number], *more]
    dtype = np.dtype([(name, "<f4") for name in names])
    size = path.stat().st_size
    if size % dtype.itemsize:
        raise ValueError(
            f"{size} bytes is not a whole number of points of {number} float32"
            " (cut off, or other columns: --columns N)"
        )
    return dtype


def is_cloud(path: Path) -> bool:
    """Returns whether a file name has the ending of a point cloud file."""
    return path.suffix.lower() in _READERS


def _find_reader(path: Path) -> _Reader:
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path}: unknown kind of point cloud (there are: "
            f"{' '.join(_READERS)})"
        )
    return reader


def _read_bin(
    path: Path, block: int, on_note: OnNote, columns: int | None = None
) -> Iterator[np.ndarray]:
    dtype = bin_dtype(path, columns)
    number = path.stat().st_size // dtype.itemsize
    return read_records(path, dtype, 0, number, block)


_READERS: dict[str, _Reader] = {
    ".pcd": read_pcd,
    ".ply": read_ply,
    ".npy": read_npy_blocks,
    ".bin": _read_bin,
}
