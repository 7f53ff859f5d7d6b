"""Reads .npy files: clouds of points, and arrays of numbers."""

from collections.abc import Iterator
import math
from pathlib import Path
import warnings

import numpy as np

from evaluation.base import check_regular, from_xyz, user_errors, value_errors
from evaluation.clouds.notes import OnNote
from evaluation.clouds.record_reading import check_size, read_records


def read_npy_blocks(
    path: Path, block: int, on_note: OnNote
) -> Iterator[np.ndarray]:
    dtype, shape, by_column, offset = _read_npy_header(path)
    count = math.prod(shape)
    check_size(path, offset + count * dtype.itemsize, exactly=True)
    if dtype.names is not None:
        for name in "xyz":
            if name not in dtype.names or dtype[name].kind not in "fiu":
                raise ValueError(f"the records have no number {name}")
        return read_records(path, dtype, offset, count, block)
    if len(shape) != 2 or shape[1] not in (3, 4):
        raise ValueError(f"an array of shape {shape} instead of N x 3 or N x 4")
    if dtype.kind not in "fiu":
        raise ValueError(f"{dtype} is not a type of coordinates")
    if by_column:
        return _read_columns(path, dtype, shape, offset, block)
    rows = np.dtype((dtype, shape[1:]))
    return (
        _to_cloud(part)
        for part in read_records(path, rows, offset, shape[0], block)
    )


def _read_npy_header(
    path: Path,
) -> tuple[np.dtype, tuple[int, ...], bool, int]:
    """Returns type, shape, whether in Fortran order, and offset of the data."""
    try:
        with warnings.catch_warnings():
            # A damaged header can overflow the size of the array.
            warnings.simplefilter("ignore")
            values = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError:
        raise
    except Exception as error:
        # NumPy evaluates the header as Python, and can raise any error.
        raise ValueError(
            "not an array of numbers as NumPy saves it (.npy), or cut off"
        ) from error
    if not isinstance(values, np.memmap):
        values.close()
        raise ValueError("an archive instead of one array")
    # The file is mapped but never read: reading could end the process.
    by_column = not values.flags.c_contiguous
    return values.dtype, values.shape, by_column, values.offset


def read_npy(path: Path) -> np.ndarray:
    """Returns the array of a .npy file, in C order.

    Raises:
        InputError: the file cannot be read, or its size does not fit its
            header.
    """
    with user_errors(path), value_errors(path):
        check_regular(path)
        dtype, shape, _, offset = _read_npy_header(path)
        count = math.prod(shape)
        check_size(path, offset + count * dtype.itemsize, exactly=True)
        (values,) = read_records(path, dtype, offset, count, max(count, 1))
    return values.reshape(shape)


def _read_columns(
    path: Path, dtype: np.dtype, shape: tuple[int, ...], offset: int, block: int
) -> Iterator[np.ndarray]:
    count, width = shape
    columns = [
        read_records(
            path, dtype, offset + k * count * dtype.itemsize, count, block
        )
        for k in range(width)
    ]
    for parts in zip(*columns, strict=True):
        yield _to_cloud(np.stack(parts, axis=1))


def _to_cloud(values: np.ndarray) -> np.ndarray:
    if values.dtype.kind != "f":
        values = values.astype(np.float64)
    return from_xyz(values)
