"""Reads PCD files (PCL, up to 0.7): ascii, binary and binary_compressed."""

from collections.abc import Iterator
import math
from pathlib import Path

import numpy as np

from evaluation.base import is_number, unpacked
from evaluation.clouds.notes import OnNote
from evaluation.clouds.record_reading import (
    BYTE_ORDER_MARK,
    HEADER_LIMIT_BYTES,
    check_size,
    read_records,
    read_text_records,
    record_type,
)

_PCD_TYPES = {"F": "f", "I": "i", "U": "u"}
_PCD_SIZES = {"f": (4, 8), "i": (1, 2, 4, 8), "u": (1, 2, 4, 8)}
_UNMOVED = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]


def read_pcd(path: Path, block: int, on_note: OnNote) -> Iterator[np.ndarray]:
    """Reads an ascii, binary or binary_compressed PCD file (PCL, up to 0.7).

    Padding (fields named `_`) gets names of its own. VIEWPOINT is not applied,
    because programs disagree whether it moves the points; a note says so.
    """
    header, offset = _read_pcd_header(path)
    if _is_moved(header.get("VIEWPOINT", [])):
        on_note(
            f"{path}: VIEWPOINT is not applied; the points are taken as they"
            " are written"
        )
    dtype, count = _point_type(header), _num_points(header)
    encoding = header["DATA"][0].lower() if header["DATA"] else ""
    if encoding == "ascii":
        # A number takes at least one byte, which bounds the buffer.
        numbers = sum(
            math.prod(dtype[name].shape) for name in dtype.names or ()
        )
        check_size(path, offset + count * numbers, exactly=False)
        return read_text_records(path, offset, count, block, dtype, "PCD")
    if encoding == "binary":
        check_size(path, offset + count * dtype.itemsize, exactly=True)
        return read_records(path, dtype, offset, count, block)
    if encoding == "binary_compressed":
        return _read_compressed(path, offset, dtype, count, block)
    raise ValueError(f"unknown PCD encoding {encoding!r}")


def _read_pcd_header(path: Path) -> tuple[dict[str, list[str]], int]:
    """Returns the values of each keyword, and the points' offset [bytes]."""
    header = {}
    with open(path, "rb") as stream:
        while stream.tell() < HEADER_LIMIT_BYTES:
            raw = stream.readline(HEADER_LIMIT_BYTES).removeprefix(
                BYTE_ORDER_MARK
            )
            words = raw.split(b"#")[0].decode("ascii", "replace").split()
            if words:
                header[words[0].upper()] = words[1:]
            if "DATA" in header:
                return header, stream.tell()
            if not raw:
                break
    raise ValueError("not a PCD file: no DATA line in the header")


def _is_moved(viewpoint: list[str]) -> bool:
    """Returns whether a viewpoint differs from the origin's."""
    if not all(map(is_number, viewpoint)):
        return True
    return bool(viewpoint) and list(map(float, viewpoint)) != _UNMOVED


def _point_type(header: dict[str, list[str]]) -> np.dtype:
    if "FIELDS" not in header:
        raise ValueError("PCD header: FIELDS is missing or wrong")
    names = header["FIELDS"]
    sizes = _integers(header, "SIZE")
    kinds = [
        _PCD_TYPES.get(kind.upper(), "") for kind in header.get("TYPE", [])
    ]
    counts = [1] * len(names)
    if "COUNT" in header:
        counts = _integers(header, "COUNT")
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ValueError(
            "PCD header: FIELDS, SIZE, TYPE and COUNT differ in length"
        )
    fields: list[tuple] = []
    for position, name in enumerate(names):
        size = sizes[position]
        kind = kinds[position]
        count = counts[position]
        if count == 0:  # PCL writes padding of no bytes.
            continue
        if size not in _PCD_SIZES.get(kind, ()) or count < 1:
            raise ValueError(
                f"PCD header: {name}: no type {header['TYPE'][position]} of"
                f" SIZE {size} and COUNT {count}"
            )
        # PCL names all padding `_`; a NumPy type needs different names.
        unique = f"_{position}" if name == "_" else name
        shape = () if count == 1 else (count,)
        fields.append((unique, f"<{kind}{size}", shape))
    dtype = record_type(fields, "PCD header: field")
    for name in "xyz":
        if name not in (dtype.names or ()) or dtype[name].kind != "f":
            raise ValueError(f"PCD header: no field {name} of type F")
    return dtype


def _num_points(header: dict[str, list[str]]) -> int:
    """Returns the number of points."""
    numbers = _integers(header, "POINTS")[:1] if "POINTS" in header else []
    if "WIDTH" in header or not numbers:
        # Unorganised clouds of old writers have no height.
        height = _integers(header, "HEIGHT")[:1] if "HEIGHT" in header else [1]
        numbers.append(math.prod([*_integers(header, "WIDTH")[:1], *height]))
    number = numbers[0]
    if numbers[-1] != number:
        raise ValueError(
            f"PCD header: POINTS {number} against {numbers[-1]} of WIDTH x"
            " HEIGHT"
        )
    if number < 0:
        raise ValueError("PCD header: a negative number of points")
    return number


def _integers(header: dict[str, list[str]], keyword: str) -> list[int]:
    try:
        return [int(word) for word in header[keyword]]
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"PCD header: {keyword} is missing or wrong"
        ) from error


def _read_compressed(
    path: Path, offset: int, dtype: np.dtype, count: int, block: int
) -> Iterator[np.ndarray]:
    with open(path, "rb") as stream:
        stream.seek(offset)
        head = stream.read(8)
        if len(head) != 8:
            raise ValueError("PCD: the file is cut off")
        num_packed, num_plain = np.frombuffer(head, dtype="<u4").tolist()
        if num_plain != count * dtype.itemsize:
            raise ValueError("PCD: the compressed size does not fit the header")
        check_size(path, offset + 8 + num_packed, exactly=True)
        packed = stream.read(num_packed)
    try:
        data = unpacked(packed, "lzf", num_plain)
    except ValueError as error:
        if num_packed != num_plain:
            raise ValueError(f"PCD: {error}") from error
        data = packed  # pypcd4 writes what does not shrink as it is.
    plain = np.frombuffer(data, np.uint8)
    for start in range(0, max(count, 1), block):
        yield _interleaved(plain, dtype, count, slice(start, start + block))


def _interleaved(
    plain: np.ndarray, dtype: np.dtype, count: int, part: slice
) -> np.ndarray:
    """Returns a part of `count` points that a file stores field by field."""
    points = np.empty(len(range(count)[part]), dtype=dtype)
    start = 0
    for name in dtype.names or ():
        scalar = dtype[name]
        end = start + count * scalar.itemsize
        column = plain[start:end].view(scalar.base)
        points[name] = column.reshape(count, *scalar.shape)[part]
        start = end
    return points
