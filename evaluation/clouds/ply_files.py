"""Reads the vertices of PLY files, ascii or binary."""

from collections.abc import Iterator
import itertools
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evaluation.clouds.notes import OnNote
from evaluation.clouds.record_reading import (
    BYTE_ORDER_MARK,
    HEADER_LIMIT_BYTES,
    check_size,
    content_lines,
    read_records,
    read_text_records,
    record_type,
)

# Type of a property -> its NumPy type.
_PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2"},
    **{"int": "i4", "uint": "u4", "float": "f4", "double": "f8"},
}
# NumPy's names, such as uint8.
_PLY_TYPES |= {np.dtype(one).name: one for one in _PLY_TYPES.values()}
_PLY_ORDERS = {
    "binary_little_endian": "<",
    "binary_big_endian": ">",
    "ascii": "<",
}


def read_ply(path: Path, block: int, on_note: OnNote) -> Iterator[np.ndarray]:
    """Reads the vertices of an ascii or binary PLY file.

    Faces and other elements are ignored. In a binary file, elements before the
    vertices must not contain lists, because lists would hide where the vertices
    begin.
    """
    encoding, elements, offset = _read_ply_header(path)
    order = _PLY_ORDERS[encoding]
    before = []
    for element in elements:
        if element.name == "vertex":
            break
        before.append(element)
    else:
        raise ValueError("PLY header: no element vertex")
    dtype = element.dtype(order)
    for name in "xyz":
        if name not in (dtype.names or ()) or dtype[name].kind != "f":
            raise ValueError(f"PLY header: no floating-point property {name}")
    count = element.number
    alone = element is elements[-1]
    if encoding == "ascii":
        offset = _offset_after_lines(
            path, offset, sum(element.number for element in before)
        )
        # A vertex takes at least one byte.
        check_size(path, offset + count, exactly=False)
        more = not alone
        return read_text_records(path, offset, count, block, dtype, "PLY", more)
    offset += sum(
        element.number * element.dtype(order).itemsize for element in before
    )
    check_size(path, offset + count * dtype.itemsize, exactly=alone)
    return read_records(path, dtype, offset, count, block)


def _offset_after_lines(path: Path, offset: int, count: int) -> int:
    """Returns the offset after `count` rows of a text file [bytes]."""
    with open(path, "rb") as stream:
        stream.seek(offset)
        for _ in itertools.islice(content_lines(stream), count):
            pass
        return stream.tell()


class _Element(NamedTuple):
    """One element of a PLY file: (name, type) of its properties."""

    name: str
    number: int
    properties: list[tuple[str, str]]

    def dtype(self, order: str) -> np.dtype:
        """Returns the NumPy type of one element, in a given byte order."""
        for name, kind in self.properties:
            if kind not in _PLY_TYPES:
                raise ValueError(
                    f"PLY header: {self.name}: property {name} of the type"
                    f" {kind!r}, which is not read"
                )
        fields = [
            (name, order + _PLY_TYPES[kind]) for name, kind in self.properties
        ]
        return record_type(fields, f"PLY header: {self.name}: property")


def _read_ply_header(path: Path) -> tuple[str, list[_Element], int]:
    """Returns encoding, elements, and offset of the first element [bytes]."""
    encoding = ""
    elements: list[_Element] = []
    with open(path, "rb") as stream:
        if (
            stream.readline(HEADER_LIMIT_BYTES)
            .removeprefix(BYTE_ORDER_MARK)
            .strip()
            != b"ply"
        ):
            raise ValueError("not a PLY file")
        while stream.tell() < HEADER_LIMIT_BYTES:
            raw = stream.readline(HEADER_LIMIT_BYTES)
            match raw.decode("ascii", "replace").split():
                case ["end_header"]:
                    break
                case ["format", encoding, *_]:
                    pass
                case ["element", name, count] if count.isdecimal():
                    elements.append(_Element(name, int(count), []))
                case ["element", name, count] if count[1:].isdecimal():
                    raise ValueError(
                        f"PLY header: {count}, a negative number of {name}"
                    )
                case ["property", "list", _, _, name] if elements:
                    elements[-1].properties.append((name, "list"))
                case ["property", kind, name] if elements:
                    elements[-1].properties.append((name, kind))
                case ["element" | "property", *_] as words:
                    raise ValueError(
                        f"PLY header: {' '.join(words)!r} is not understood"
                    )
            if not raw:
                raise ValueError("PLY header: no end_header")
        else:
            raise ValueError("PLY header: no end_header")
        offset = stream.tell()
    if encoding not in _PLY_ORDERS:
        raise ValueError(f"PLY header: unknown format {encoding!r}")
    return encoding, elements, offset
