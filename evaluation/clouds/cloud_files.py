"""Single point clouds: map files, and scans with a file each."""

from collections.abc import Callable, Iterator
import contextlib
import itertools
import math
from pathlib import Path
from typing import BinaryIO

import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.compiled import compiled
from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular
from cns_drake.base.points import check_range, store
from cns_drake.base.poses import FARTHEST

# Enough for rows of some tens of numbers with some tens of characters.
_LONGEST_LINE_BYTES = 1 << 16
_PCD_TYPES = {"F": "f", "I": "i", "U": "u"}
# A header takes some hundred bytes; the search for it ends here.
_HEADER_LIMIT_BYTES = 1 << 16
# LZF expands three bytes to at most 264. Compressed files are unpacked in
# memory; larger ones must not be compressed.
_LZF_RATIO = 88
_UNPACKED_LIMIT_BYTES = 1 << 27
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
# Reads a file; the second argument is the number of points in a block.
_Reader = Callable[[Path, int], Iterator[np.ndarray]]
_BIN = np.dtype([(name, "<f4") for name in ("x", "y", "z", "intensity")])
# Number of points of a map that are read at a time.
_BLOCK = 1 << 18
# More than a LiDAR's turn can fill [bytes].
SCAN_LIMIT_BYTES = 1 << 27


def _records(
    path: Path, dtype: np.dtype, offset: int, count: int, block: int
) -> Iterator[np.ndarray]:
    """Yields the records of a file in blocks; at least one, maybe empty.

    They are read into memory of our own: a memory-mapped file would end the
    process without a message (SIGBUS) if another program shortened it.
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


def _text_records(
    path: Path,
    offset: int,
    count: int,
    block: int,
    dtype: np.dtype,
    kind: str,
    more: bool = False,
) -> Iterator[np.ndarray]:
    """Yields rows of numbers as records, like `_records`.

    Args:
        kind: the kind of file, for errors.
        more: whether something else follows.
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


def _check_size(path: Path, needed: int, exactly: bool) -> None:
    """Refuses a file of another size [bytes], or, unless exactly, a less."""
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


def _read_pcd(path: Path, block: int) -> Iterator[np.ndarray]:
    """Reads an ascii, binary or binary_compressed PCD file (PCL, up to 0.7).

    Padding (fields named `_`) gets names of its own.
    """
    header, offset = _read_pcd_header(path)
    dtype, count = _describe_pcd(header)
    encoding = header["DATA"][0].lower() if header["DATA"] else ""
    if encoding == "ascii":
        # A point takes at least one byte, which bounds the buffer.
        _check_size(path, offset + count, exactly=False)
        return _text_records(path, offset, count, block, dtype, "PCD")
    if encoding == "binary":
        _check_size(path, offset + count * dtype.itemsize, exactly=True)
        return _records(path, dtype, offset, count, block)
    if encoding == "binary_compressed":
        return _read_compressed(path, offset, dtype, count, block)
    raise ValueError(f"unknown PCD encoding {encoding!r}")


def _read_pcd_header(path: Path) -> tuple[dict[str, list[str]], int]:
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


def _describe_pcd(header: dict[str, list[str]]) -> tuple[np.dtype, int]:
    """Returns the type of a point and the number of points."""
    try:
        names = header["FIELDS"]
        sizes = [int(size) for size in header["SIZE"]]
        kinds = [_PCD_TYPES[kind.upper()] for kind in header["TYPE"]]
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
        _check_size(path, offset + 8 + num_packed, exactly=True)
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


def _read_ply(path: Path, block: int) -> Iterator[np.ndarray]:
    """Reads the vertices of an ascii or binary PLY file.

    Faces and other elements are ignored; they must follow the vertices.
    """
    encoding, dtype, count, alone, offset = _read_ply_header(path)
    if encoding == "ascii":
        # A vertex takes at least one byte.
        _check_size(path, offset + count, exactly=False)
        more = not alone
        return _text_records(path, offset, count, block, dtype, "PLY", more)
    _check_size(path, offset + count * dtype.itemsize, exactly=alone)
    return _records(path, dtype, offset, count, block)


def _read_ply_header(path: Path) -> tuple[str, np.dtype, int, bool, int]:
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
    if encoding not in _PLY_ORDERS:
        raise ValueError(f"PLY header: unknown format {encoding!r}")
    dtype, count = _describe_vertices(lines, _PLY_ORDERS[encoding])
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
            (words[2], order + _PLY_TYPES[words[1]])
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
    _check_size(path, offset + count * dtype.itemsize, exactly=True)
    if dtype.names is not None:
        for name in "xyz":
            if name not in dtype.names or dtype[name].kind not in "fiu":
                raise ValueError(f"the records have no number {name}")
        return _records(path, dtype, offset, count, block)
    if len(shape) != 2 or shape[1] not in (3, 4):
        raise ValueError(f"an array of shape {shape} instead of N x 3 or N x 4")
    if dtype.kind not in "fiu":
        raise ValueError(f"{dtype} is not a type of coordinates")
    if by_column:
        return _read_columns(path, dtype, shape, offset, block)
    rows = np.dtype((dtype, shape[1:]))
    return (
        _to_cloud(part)
        for part in _records(path, rows, offset, shape[0], block)
    )


def _read_npy_header(
    path: Path,
) -> tuple[np.dtype, tuple[int, ...], bool, int]:
    """Returns type, shape, whether stored by columns, and the offset."""
    try:
        # Of a size that NumPy cannot count it would only warn.
        with np.errstate(over="ignore"):
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


def read_npy(path: Path) -> np.ndarray:
    """Returns the array of a file, whose values follow each other in C order.

    Raises:
        InputError: it cannot be read, or holds no array of the size it names.
    """
    with _faults(path):
        check_regular(path)
        dtype, shape, _, offset = _read_npy_header(path)
        count = math.prod(shape)
        _check_size(path, offset + count * dtype.itemsize, exactly=True)
        (values,) = _records(path, dtype, offset, count, max(count, 1))
    return values.reshape(shape)


def _read_columns(
    path: Path, dtype: np.dtype, shape: tuple[int, ...], offset: int, block: int
) -> Iterator[np.ndarray]:
    count, width = shape
    columns = [
        _records(path, dtype, offset + k * count * dtype.itemsize, count, block)
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
    return _records(path, _BIN, 0, size // _BIN.itemsize, block)


_READERS: dict[str, _Reader] = {
    ".pcd": _read_pcd,
    ".ply": _read_ply,
    ".npy": _read_npy,
    ".bin": _read_bin,
}
