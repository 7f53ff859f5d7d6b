"""Point clouds in PCL's PCD format, version 0.7 and its predecessors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evaluation.geometry.points import store
from evaluation.support.compiled import compiled

_KINDS = {"F": "f", "I": "i", "U": "u"}
# A header is some hundred bytes; a file without one is not searched further.
_HEADER_LIMIT_BYTES = 1 << 16


def read_pcd(path: Path) -> np.ndarray:
    """Reads an ascii, binary or binary_compressed PCD file.

    Returns:
        Structured array of shape (N,) under the file's field names; padding
        fields (named `_`) are left out.

    Raises:
        ValueError: if the file is not PCD, contradicts itself or is cut off.
        OSError: if it cannot be read.
    """
    header, offset = _read_header(path)
    dtype, count = _describe(header)
    encoding = header["DATA"][0].lower() if header["DATA"] else ""
    if encoding == "ascii":
        return _read_ascii(path, offset, dtype, count)
    if encoding == "binary":
        _check_size(path, offset + count * dtype.itemsize)
        if count == 0:
            return np.empty(0, dtype=dtype)
        return np.memmap(path, dtype, mode="r", offset=offset, shape=count)
    if encoding == "binary_compressed":
        return _read_compressed(path, offset, dtype, count)
    raise ValueError(f"unknown PCD encoding {encoding!r}")


def _read_header(path: Path) -> tuple[dict[str, list[str]], int]:
    """Returns keyword -> values, and where the points begin [bytes]."""
    header = {}
    with open(path, "rb") as stream:
        while stream.tell() < _HEADER_LIMIT_BYTES:
            raw = stream.readline(_HEADER_LIMIT_BYTES)
            words = raw.split(b"#")[0].decode("ascii", "replace").split()
            if words:
                header[words[0].upper()] = words[1:]
            if "DATA" in header:
                return header, stream.tell()
            if not raw:
                break
    raise ValueError("not a PCD file: no DATA line in the header")


def _describe(header: dict[str, list[str]]) -> tuple[np.dtype, int]:
    """Returns the type of a point and the number of points."""
    try:
        names = header["FIELDS"]
        sizes = [int(size) for size in header["SIZE"]]
        kinds = [_KINDS[kind.upper()] for kind in header["TYPE"]]
        counts = [int(n) for n in header.get("COUNT", ["1"] * len(names))]
        if "POINTS" in header:
            number = int(header["POINTS"][0])
        else:
            number = int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
    except (KeyError, IndexError, ValueError) as error:
        raise ValueError(f"PCD header: {error} is missing or wrong") from error
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ValueError(
            "PCD header: FIELDS, SIZE, TYPE and COUNT differ in length"
        )
    fields = []
    for position, name in enumerate(names):
        # PCL calls all padding `_`; a NumPy type needs one name for each.
        unique = f"_{position}" if name == "_" else name
        scalar = f"<{kinds[position]}{sizes[position]}"
        shape = () if counts[position] == 1 else (counts[position],)
        fields.append((unique, scalar, shape))
    try:
        dtype = np.dtype(fields)
    except (TypeError, ValueError) as error:
        raise ValueError(f"PCD header: {error}") from error
    for name in "xyz":
        if name not in names or dtype[name].kind != "f":
            raise ValueError(f"PCD header: no field {name} of type F")
    if number < 0:
        raise ValueError("PCD header: a negative number of points")
    return dtype, number


def _read_ascii(
    path: Path, offset: int, dtype: np.dtype, count: int
) -> np.ndarray:
    if count == 0:
        return np.empty(0, dtype=dtype)
    # A point takes a byte at the very least: no buffer for more of them.
    _check_size(path, offset + count)
    with open(path, "rb") as stream:
        stream.seek(offset)
        values = np.loadtxt(stream, dtype=np.float64, ndmin=2, max_rows=count)
    names = dtype.names or ()
    widths = [_width(dtype, name) for name in names]
    if values.shape != (count, sum(widths)):
        raise ValueError(
            f"PCD: {values.shape[0]} x {values.shape[1]} numbers instead of"
            f" {count} x {sum(widths)}"
        )
    points = np.empty(count, dtype=dtype)
    columns = np.split(values, np.cumsum(widths)[:-1], axis=1)
    for name, column in zip(names, columns, strict=True):
        store(points, name, column.reshape(points[name].shape))
    return points


def _read_compressed(
    path: Path, offset: int, dtype: np.dtype, count: int
) -> np.ndarray:
    with open(path, "rb") as stream:
        stream.seek(offset)
        sizes = np.frombuffer(stream.read(8), dtype="<u4")
        if len(sizes) != 2:
            raise ValueError("PCD: the file is cut off")
        packed = np.frombuffer(stream.read(int(sizes[0])), dtype=np.uint8)
    if len(packed) != sizes[0]:
        raise ValueError("PCD: the file is cut off")
    if sizes[1] != count * dtype.itemsize:
        raise ValueError("PCD: the compressed size does not fit the header")
    plain = np.empty(int(sizes[1]), dtype=np.uint8)
    if not _decompress_lzf(packed, plain):
        raise ValueError("PCD: the compressed data is damaged")
    # Stored field by field: all x, then all y, ...
    points = np.empty(count, dtype=dtype)
    start = 0
    for name in dtype.names or ():
        scalar = dtype[name]
        end = start + count * scalar.itemsize
        points[name] = (
            plain[start:end].view(scalar.base).reshape(count, *scalar.shape)
        )
        start = end
    return points


def _width(dtype: np.dtype, name: str) -> int:
    """Returns how many numbers a field holds."""
    return int(np.prod(dtype[name].shape))


def _check_size(path: Path, needed: int) -> None:
    size = path.stat().st_size
    if size < needed:
        raise ValueError(f"PCD: cut off at {size} of {needed} bytes")


@compiled
def _decompress_lzf(packed: np.ndarray, plain: np.ndarray) -> bool:
    """Expands LZF data; returns whether it was sound and filled `plain`.

    The format: a control byte below 32 announces that many literal bytes
    plus one. Otherwise its upper three bits are the length of a copy less
    two (7: one more byte adds to it), its lower five bits and the next byte
    the distance back less one.
    """
    source = 0
    target = 0
    while source < len(packed):
        control = int(packed[source])
        source += 1
        if control < 32:
            length = control + 1
            if source + length > len(packed) or target + length > len(plain):
                return False
            plain[target : target + length] = packed[source : source + length]
            source += length
            target += length
            continue
        length = control >> 5
        if length == 7:
            if source >= len(packed):
                return False
            length += int(packed[source])
            source += 1
        if source >= len(packed):
            return False
        distance = ((control & 31) << 8) + int(packed[source]) + 1
        source += 1
        length += 2
        if distance > target or target + length > len(plain):
            return False
        # One by one: a copy may overlap what it writes.
        for _ in range(length):
            plain[target] = plain[target - distance]
            target += 1
    return target == len(plain)
