"""Single point clouds: map files, and scans with a file each."""

from collections.abc import Callable, Iterator
import contextlib
import math
from pathlib import Path

import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular
from cns_drake.base.points import check_range
from cns_drake.base.poses import FARTHEST
from evaluation.clouds.pcd import read_pcd
from evaluation.clouds.ply import read_ply
from evaluation.clouds.record_blocks import check_size, read_binary

# Reads a file; the second argument is the number of points in a block.
_Reader = Callable[[Path, int], Iterator[np.ndarray]]
_BIN = np.dtype([(name, "<f4") for name in ("x", "y", "z", "intensity")])
# Number of points of a map that are read at a time.
_BLOCK = 1 << 18
# More than a LiDAR's turn can fill [bytes].
SCAN_LIMIT_BYTES = 1 << 27


def read_cloud(path: Path) -> np.ndarray:
    """Reads one point cloud, in the format of its name's ending, into memory.

    `.pcd` and `.ply` in all their encodings; `.npy` holds N x 3 or N x 4
    numbers or a structured array; `.bin` is KITTI's sequence of float32
    x y z intensity.

    Args:
        path: an existing file, of a scan rather than a map.

    Returns:
        Structured array of shape (N,) with floating-point fields `x`, `y`, `z`
        and all other fields of the file.

    Raises:
        InputError: if there is no such file, its content does not match its
            ending, or it is too large for a scan.
    """
    path = Path(path)
    _find_reader(path)
    with _faults(path):
        size = path.stat().st_size
        if size > SCAN_LIMIT_BYTES:
            raise ValueError(f"{size} bytes is too large for a scan")
    # One block holds the whole file.
    (points,) = read_blocks(path, block=SCAN_LIMIT_BYTES)
    return points


def read_blocks(path: Path, block: int = _BLOCK) -> Iterator[np.ndarray]:
    """Reads a point cloud of any size in parts; see `read_cloud`.

    Args:
        path: an existing file.
        block: number of points in a part.

    Yields:
        At least one part, maybe empty.

    Raises:
        InputError: as `read_cloud`; also later, e.g. if the file is cut off
            meanwhile.
    """
    path = Path(path)
    reader = _find_reader(path)
    with _faults(path):
        check_regular(path)
        read = 0
        for points in reader(path, block):
            check_range(points, FARTHEST, first=read)
            read += len(points)
            yield points


def is_cloud(path: Path) -> bool:
    """Returns whether a file of this name is read by `read_cloud`."""
    return path.suffix.lower() in _READERS


def _find_reader(path: Path) -> _Reader:
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path}: unknown kind of point cloud (there are: "
            f"{' '.join(_READERS)})"
        )
    return reader


@contextlib.contextmanager
def _faults(path: Path) -> Iterator[None]:
    """Turns errors of readers into one line that names the file."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    except (ValueError, EOFError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {error}") from error


def _read_npy(path: Path, block: int) -> Iterator[np.ndarray]:
    dtype, shape, by_column, offset = _read_npy_header(path)
    count = math.prod(shape)
    check_size(path, offset + count * dtype.itemsize, exactly=True)
    if dtype.names is not None:
        for name in "xyz":
            if name not in dtype.names or dtype[name].kind not in "fiu":
                raise ValueError(f"the records have no number {name}")
        return read_binary(path, dtype, offset, count, block)
    if len(shape) != 2 or shape[1] not in (3, 4):
        raise ValueError(f"an array of shape {shape} instead of N x 3 or N x 4")
    if dtype.kind not in "fiu":
        raise ValueError(f"{dtype} is not a type of coordinates")
    if by_column:
        return _read_columns(path, dtype, shape, offset, block)
    rows = np.dtype((dtype, shape[1:]))
    return (
        _to_cloud(part)
        for part in read_binary(path, rows, offset, shape[0], block)
    )


def _read_npy_header(
    path: Path,
) -> tuple[np.dtype, tuple[int, ...], bool, int]:
    """Returns type, shape, whether stored by columns, and the offset."""
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError:
        raise
    except Exception as error:
        # NumPy evaluates the header as Python, and can raise any error.
        raise ValueError(
            f"not a NumPy array ({type(error).__name__}: {error})"
        ) from error
    if not isinstance(values, np.memmap):
        values.close()
        raise ValueError("an archive instead of one array")
    # The file is mapped but never read: reading could end the process.
    by_column = not values.flags.c_contiguous
    return values.dtype, values.shape, by_column, values.offset


def _read_columns(
    path: Path, dtype: np.dtype, shape: tuple[int, ...], offset: int, block: int
) -> Iterator[np.ndarray]:
    count, width = shape
    columns = [
        read_binary(
            path, dtype, offset + k * count * dtype.itemsize, count, block
        )
        for k in range(width)
    ]
    for parts in zip(*columns, strict=True):
        yield _to_cloud(np.stack(parts, axis=1))


def _to_cloud(values: np.ndarray) -> np.ndarray:
    if values.dtype.kind != "f":
        values = values.astype(np.float64)
    return point_arrays.from_xyz(values)


def _read_bin(path: Path, block: int) -> Iterator[np.ndarray]:
    size = path.stat().st_size
    if size % _BIN.itemsize:
        raise ValueError(
            f"{size} bytes is not a whole number of points of four float32"
        )
    return read_binary(path, _BIN, 0, size // _BIN.itemsize, block)


_READERS: dict[str, _Reader] = {
    ".pcd": read_pcd,
    ".ply": read_ply,
    ".npy": _read_npy,
    ".bin": _read_bin,
}
