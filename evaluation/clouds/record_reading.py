"""Reads records of points from binary files and rows of text, in blocks."""

import codecs
from collections.abc import Iterator
import itertools
import math
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from evaluation.base import parse_rows, repeated

BYTE_ORDER_MARK = codecs.BOM_UTF8
# The end of a header is searched up to here; a header takes some hundred bytes.
HEADER_LIMIT_BYTES = 1 << 16


def read_records(
    path: Path, dtype: np.dtype, offset: int, count: int, block: int
) -> Iterator[np.ndarray]:
    """Yields the records of a file in blocks; at least one, maybe empty.

    The file is not memory-mapped: if another program shortened it, the process
    would end without a message (SIGBUS).
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


def read_text_records(
    path: Path,
    offset: int,
    count: int,
    block: int,
    dtype: np.dtype,
    kind: str,
    more: bool = False,
) -> Iterator[np.ndarray]:
    """Yields rows of numbers as records, like `read_records`.

    Args:
        kind: the kind of file, for errors.
        more: whether the file continues after these rows.
    """
    with open(path, "rb") as stream:
        stream.seek(offset)
        lines = content_lines(stream)
        for start in range(0, count, block):
            wanted = min(block, count - start)
            texts = list(itertools.islice(lines, wanted))
            if len(texts) < wanted:
                raise ValueError(
                    f"{start + len(texts)} instead of {count} rows of numbers"
                )
            yield _to_records(texts, dtype, kind, start)
        if not more and next(lines, None) is not None:
            raise ValueError(f"more than the {count} rows of the header")
    if count == 0:
        yield np.empty(0, dtype)


def check_size(path: Path, needed: int, exactly: bool) -> None:
    """Refuses a file shorter or, if `exactly`, longer than `needed` [bytes]."""
    size = path.stat().st_size
    if size < needed:
        raise ValueError(f"cut off at {size} of {needed} bytes")
    if exactly and size > needed:
        raise ValueError(
            f"{size - needed} bytes more than the points of the header"
        )


def content_lines(stream: BinaryIO) -> Iterator[bytes]:
    """Yields the lines that are neither blank nor comments."""
    for line in stream:
        if line.strip() and not line.lstrip().startswith(b"#"):
            yield line


def _to_records(
    texts: list[bytes], dtype: np.dtype, kind: str, first: int
) -> np.ndarray:
    """Returns (N,) records of a type from rows of numbers."""
    names = dtype.names or ()
    # A float64 rounds whole numbers above 2^53.
    exact = [
        (
            name,
            dtype[name].base if dtype[name].base.itemsize == 8 else float,
            dtype[name].shape,
        )
        for name in names
    ]
    columns: Any
    try:
        columns = parse_rows(texts, np.dtype(exact), first=first)
    except ValueError:
        # A whole number may be written as 5.0.
        values = parse_rows(texts, np.dtype(float), first=first)
        widths = [math.prod(dtype[name].shape) for name in names]
        if values.shape[1] != sum(widths):
            raise ValueError(
                f"{kind}: {values.shape[1]} numbers in a row instead of"
                f" {sum(widths)}"
            ) from None
        parts = np.split(values, np.cumsum(widths)[:-1], axis=1)
        columns = dict(zip(names, parts, strict=True))
    records = np.empty(len(texts), dtype)
    for name in names:
        store(records, name, columns[name].reshape(records[name].shape))
    return records


def record_type(fields: list[tuple], where: str) -> np.dtype:
    """Returns a type of records.

    Raises:
        ValueError: a field is there twice, or larger than any.
    """
    names = [field[0] for field in fields]
    for name in repeated(names):
        raise ValueError(f"{where} {name} is there twice")
    return np.dtype(fields)


def store(points: np.ndarray, name: str, values: np.ndarray) -> None:
    """Writes values to a field of points, after checking that they fit.

    Args:
        points: (N,) structured array, changed in place.
        name: name of the field.
        values: (N,) or, for a field of K numbers, (N, K); float64, or integers
            of 8 bytes for a field of such integers.

    Raises:
        ValueError: if a number does not fit the field's type: it is out of
            range, or not whole for a field of integers.
    """
    dtype = points.dtype[name].base
    fault = f"{name}: a number does not fit {dtype}"
    # NumPy notices only some numbers that are out of range: as a byte, 300.0
    # would become 44.
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        fits = (values >= limits.min) & (values <= limits.max)
        if not (fits & (values == np.trunc(values))).all():
            raise ValueError(fault)
    with np.errstate(over="raise", invalid="raise"):
        try:
            points[name] = values
        except FloatingPointError as error:
            raise ValueError(fault) from error
