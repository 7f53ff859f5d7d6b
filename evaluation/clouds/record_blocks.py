"""Records of a file, read block by block into memory of our own.

A memory-mapped file would end the process without a message (SIGBUS) if another
program shortened it meanwhile.
"""

from collections.abc import Iterator
import itertools
import math
from pathlib import Path
from typing import BinaryIO

import numpy as np

from cns_drake.base.points import store

# Enough for rows of some tens of numbers with some tens of characters.
_LONGEST_LINE_BYTES = 1 << 16


def read_binary(
    path: Path, dtype: np.dtype, offset: int, count: int, block: int
) -> Iterator[np.ndarray]:
    """Yields the records of a file in blocks; at least one, maybe empty.

    Args:
        path: the file.
        dtype: type of a record.
        offset: where they begin [bytes].
        count: how many there are.
        block: how many to yield at once.

    Raises:
        ValueError: if the file ends too early.
        OSError: if it cannot be read.
    """
    with open(path, "rb") as stream:
        stream.seek(offset)
        for start in range(0, max(count, 1), block):
            wanted = min(block, count - start)
            records = np.fromfile(stream, dtype, wanted)
            if len(records) < wanted:
                raise ValueError(
                    f"cut off behind {start + len(records)} of {count} points"
                )
            yield records


def read_text(
    path: Path,
    offset: int,
    count: int,
    block: int,
    dtype: np.dtype,
    kind: str,
    more: bool = False,
) -> Iterator[np.ndarray]:
    """Yields rows of numbers as records; like `read_binary`.

    Args:
        path: the file.
        offset: where the rows begin [bytes].
        count: how many there are.
        block: how many to yield at once.
        dtype: type of a record.
        kind: the kind of file, for errors.
        more: whether something else follows.

    Raises:
        ValueError: if the file ends too early or goes on, or a row has another
            number of values than a record.
        OSError: if it cannot be read.
    """
    with open(path, "rb") as stream:
        stream.seek(offset)
        lines = _lines(stream)
        for start in range(0, count, block):
            wanted = min(block, count - start)
            texts = list(itertools.islice(lines, wanted))
            if len(texts) < wanted:
                raise ValueError(
                    f"{start + len(texts)} instead of {count} rows of numbers"
                )
            values = np.loadtxt(texts, np.float64, ndmin=2)
            yield _to_records(values, dtype, kind)
        if not more and next(lines, None) is not None:
            raise ValueError(f"more than the {count} rows of the header")
    if count == 0:
        yield np.empty(0, dtype)


def check_size(path: Path, needed: int, exactly: bool) -> None:
    """Refuses a file whose size does not match its header.

    Args:
        path: the file.
        needed: its size [bytes].
        exactly: whether that is the exact size; else it is the least.

    Raises:
        ValueError: if it is not.
    """
    size = path.stat().st_size
    if size < needed:
        raise ValueError(f"cut off at {size} of {needed} bytes")
    if exactly and size > needed:
        raise ValueError(
            f"{size - needed} bytes more than the points of the header"
        )


def _lines(stream: BinaryIO) -> Iterator[bytes]:
    """Yields the lines that are not blank."""
    while line := stream.readline(_LONGEST_LINE_BYTES):
        if len(line) == _LONGEST_LINE_BYTES:
            raise ValueError("a line is too long for a row of numbers")
        if line.strip() and not line.lstrip().startswith(b"#"):
            yield line


def _to_records(values: np.ndarray, dtype: np.dtype, kind: str) -> np.ndarray:
    """Returns (N,) records of a type from rows of numbers (N, K)."""
    names = dtype.names or ()
    widths = [math.prod(dtype[name].shape) for name in names]
    if values.shape[1] != sum(widths):
        raise ValueError(
            f"{kind}: {values.shape[1]} numbers in a row instead of"
            f" {sum(widths)}"
        )
    records = np.empty(len(values), dtype)
    columns = np.split(values, np.cumsum(widths)[:-1], axis=1)
    for name, column in zip(names, columns, strict=True):
        store(records, name, column.reshape(records[name].shape))
    return records
