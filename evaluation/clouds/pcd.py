"""Point clouds in PCL's PCD format, version 0.7 and its predecessors."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.clouds.record_blocks import check_size, read_binary, read_text

_KINDS = {"F": "f", "I": "i", "U": "u"}
# A header takes some hundred bytes; the search for it ends here.
_HEADER_LIMIT_BYTES = 1 << 16
# LZF expands three bytes to at most 264. Compressed files are unpacked in
# memory; larger ones must not be compressed.
_LZF_RATIO = 88
_UNPACKED_LIMIT_BYTES = 1 << 27


def read_pcd(path: Path, block: int) -> Iterator[np.ndarray]:
    """Reads an ascii, binary or binary_compressed PCD file.

    Args:
        path: the file.
        block: number of points in a block.

    Yields:
        Structured arrays of shape (N,) under the file's field names, at least
        one; padding (fields named `_`) has names of its own.

    Raises:
        ValueError: if the file is not PCD, contradicts itself or is cut off.
        OSError: if it cannot be read.
    """
    header, offset = _read_header(path)
    dtype, count = _describe(header)
    encoding = header["DATA"][0].lower() if header["DATA"] else ""
    if encoding == "ascii":
        # A point takes at least one byte, which bounds the buffer.
        check_size(path, offset + count, exactly=False)
        return read_text(path, offset, count, block, dtype, "PCD")
    if encoding == "binary":
        check_size(path, offset + count * dtype.itemsize, exactly=True)
        return read_binary(path, dtype, offset, count, block)
    if encoding == "binary_compressed":
        return _read_compressed(path, offset, dtype, count, block)
    raise ValueError(f"unknown PCD encoding {encoding!r}")


def _read_header(path: Path) -> tuple[dict[str, list[str]], int]:
    """Returns keyword -> values, and the offset of the points [bytes]."""
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
        numbers = []
        if "POINTS" in header:
            numbers.append(int(header["POINTS"][0]))
        if "WIDTH" in header or not numbers:
            numbers.append(int(header["WIDTH"][0]) * int(header["HEIGHT"][0]))
    except (KeyError, IndexError, ValueError) as error:
        raise ValueError(f"PCD header: {error} is missing or wrong") from error
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ValueError(
            "PCD header: FIELDS, SIZE, TYPE and COUNT differ in length"
        )
    fields = []
    for position, name in enumerate(names):
        # PCL names all padding `_`; a NumPy type needs different names.
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
    number = numbers[0]
    if numbers[-1] != number:
        raise ValueError(
            f"PCD header: POINTS {number} against {numbers[-1]} of WIDTH x"
            " HEIGHT"
        )
    if number < 0:
        raise ValueError("PCD header: a negative number of points")
    return dtype, number


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
        if num_plain > _LZF_RATIO * num_packed:
            raise ValueError(
                f"PCD: {num_packed} bytes cannot hold {num_plain} of them"
            )
        if max(num_packed, num_plain) > _UNPACKED_LIMIT_BYTES:
            raise ValueError(
                f"PCD: {num_plain} bytes compressed in one piece are more than"
                f" {_UNPACKED_LIMIT_BYTES} (save it as binary)"
            )
        check_size(path, offset + 8 + num_packed, exactly=True)
        packed = np.frombuffer(stream.read(num_packed), dtype=np.uint8)
    plain = np.empty(num_plain, dtype=np.uint8)
    if not _decompress_lzf(packed, plain):
        raise ValueError("PCD: the compressed data is damaged")
    for start in range(0, max(count, 1), block):
        yield _interleaved(plain, dtype, count, slice(start, start + block))


def _interleaved(
    plain: np.ndarray, dtype: np.dtype, count: int, part: slice
) -> np.ndarray:
    """Returns some points of `count`, stored field by field."""
    points = np.empty(len(range(count)[part]), dtype=dtype)
    start = 0
    for name in dtype.names or ():
        scalar = dtype[name]
        end = start + count * scalar.itemsize
        column = plain[start:end].view(scalar.base)
        points[name] = column.reshape(count, *scalar.shape)[part]
        start = end
    return points


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
            for _ in range(length):
                plain[target] = packed[source]
                source += 1
                target += 1
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
        # Bytes are copied one by one: source and target may overlap.
        for _ in range(length):
            plain[target] = plain[target - distance]
            target += 1
    return target == len(plain)
