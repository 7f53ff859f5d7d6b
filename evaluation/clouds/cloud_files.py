"""Single point clouds: map files, and scans with a file each."""

from collections.abc import Callable, Iterator
import functools
from pathlib import Path

import numpy as np

from cns_drake.base import (
    InputError,
    check_range,
    check_regular,
    poses,
    user_errors,
    value_errors,
)
from evaluation.clouds.bin_columns import find_layout
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
# Number of points of a map that are read at a time.
_BLOCK = 1 << 18
# Largest file of a scan [bytes]; a revolution of a LiDAR makes a smaller one.
SCAN_LIMIT_BYTES = 1 << 27


def read_cloud(
    path: Path, columns: int | None = None, on_note: OnNote = no_note
) -> np.ndarray:
    """Returns the points of a point cloud file.

    The ending of the file's name gives the format: `.pcd` and `.ply` in all
    their encodings; `.npy` with an N x 3 or N x 4 array or a structured array;
    `.bin` with float32 numbers, such as x, y, z and intensity of each point in
    KITTI.

    Args:
        path: an existing file of a scan; see `read_blocks` for maps.
        columns: number of float32 numbers for each point in a `.bin`; by
            default guessed from the values.
        on_note: is called with notes on how the file was read.

    Returns:
        Structured array of shape (N,) with floating-point fields `x`, `y`, `z`
        and all other fields of the file.

    Raises:
        InputError: if there is no such file, its content does not match its
            ending, or it is too large for a scan.
    """
    path = Path(path)
    _find_reader(path)
    with user_errors(path), value_errors(path):
        size = path.stat().st_size
        if size > SCAN_LIMIT_BYTES:
            raise ValueError(f"{size} bytes is too large for a scan")
    # One block holds the whole file.
    (points,) = read_blocks(path, columns, on_note, block=SCAN_LIMIT_BYTES)
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
        for points in reader(path, block, on_note):
            check_range(points, poses.FARTHEST, first=read)
            read += len(points)
            if not is_noted and (step_note := _coarse_note(points)):
                is_noted = True
                on_note(f"{path}: {step_note}")
            yield points


def _coarse_note(points: np.ndarray) -> str:
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
    layout = find_layout([path], columns)
    if layout.note:
        on_note(layout.note)
    dtype = layout.dtype
    size = path.stat().st_size
    if size % dtype.itemsize:
        raise ValueError(
            f"{size} bytes is not a whole number of points of"
            f" {layout.columns} float32"
        )
    return read_records(path, dtype, 0, size // dtype.itemsize, block)


_READERS: dict[str, _Reader] = {
    ".pcd": read_pcd,
    ".ply": read_ply,
    ".npy": read_npy_blocks,
    ".bin": _read_bin,
}
