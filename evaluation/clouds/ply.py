"""Point clouds in PLY files."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evaluation.clouds.record_blocks import check_size, read_binary, read_text

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "<"}
_HEADER_LIMIT_BYTES = 1 << 16


def read_ply(path: Path, block: int) -> Iterator[np.ndarray]:
    """Reads the vertices of an ascii or binary PLY file.

    Faces and other elements are ignored; they must follow the vertices.

    Args:
        path: the file.
        block: number of vertices in a block.

    Yields:
        Structured arrays of shape (N,) under the file's property names, at
        least one.

    Raises:
        ValueError: if the file is not PLY, contradicts itself or is cut off.
        OSError: if it cannot be read.
    """
    encoding, dtype, count, alone, offset = _read_header(path)
    if encoding == "ascii":
        # A vertex takes at least one byte.
        check_size(path, offset + count, exactly=False)
        more = not alone
        return read_text(path, offset, count, block, dtype, "PLY", more)
    check_size(path, offset + count * dtype.itemsize, exactly=alone)
    return read_binary(path, dtype, offset, count, block)


def _read_header(path: Path) -> tuple[str, np.dtype, int, bool, int]:
    """Returns encoding, type and number of vertices, if alone, their offset."""
    lines = []
    with open(path, "rb") as stream:
        if stream.readline(8).strip() != b"ply":
            raise ValueError("not a PLY file")
        while stream.tell() < _HEADER_LIMIT_BYTES:
            raw = stream.readline(_HEADER_LIMIT_BYTES)
            words = raw.decode("ascii", "replace").split()
            if words == ["end_header"]:
                break
            if not raw:
                raise ValueError("PLY header: no end_header")
            if words:
                lines.append(words)
        else:
            raise ValueError("PLY header: no end_header")
        offset = stream.tell()
    encoding = next((w[1] for w in lines if w[0] == "format" and w[1:]), "")
    if encoding not in _ORDERS:
        raise ValueError(f"PLY header: unknown format {encoding!r}")
    dtype, count = _describe_vertices(lines, _ORDERS[encoding])
    alone = sum(words[0] == "element" for words in lines) == 1
    return encoding, dtype, count, alone, offset


def _describe_vertices(
    lines: list[list[str]], order: str
) -> tuple[np.dtype, int]:
    elements = [i for i, words in enumerate(lines) if words[0] == "element"]
    if not elements or lines[elements[0]][1:2] != ["vertex"]:
        raise ValueError("PLY header: the first element is not vertex")
    end = elements[1] if len(elements) > 1 else len(lines)
    try:
        count = int(lines[elements[0]][2])
        fields = [
            (words[2], order + _TYPES[words[1]])
            for words in lines[elements[0] + 1 : end]
            if words[0] == "property"
        ]
    except (KeyError, IndexError, ValueError) as error:
        raise ValueError(f"PLY header: {error} is missing or wrong") from error
    if count < 0:
        raise ValueError("PLY header: a negative number of vertices")
    dtype = np.dtype(fields)
    for name in "xyz":
        if name not in dict(fields) or dtype[name].kind != "f":
            raise ValueError(f"PLY header: no floating-point property {name}")
    return dtype, count
