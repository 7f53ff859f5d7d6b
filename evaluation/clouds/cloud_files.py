"""Single point clouds: map files, and scans with a file each."""

import codecs
from collections.abc import Callable, Iterator
import functools
import itertools
import math
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple
import warnings

import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.compiled import compiled
from cns_drake.base.errors import InputError, value_errors
from cns_drake.base.files import check_regular, user_errors
from cns_drake.base.number_text import is_number, parse_rows
from cns_drake.base.points import check_range, store
from cns_drake.base.poses import FARTHEST
from cns_drake.base.repetitions import repeated
from evaluation.clouds.bin_columns import find_layout

# Room for some tens of numbers with some tens of characters each.
_LONGEST_LINE_BYTES = 1 << 16
_PCD_TYPES = {"F": "f", "I": "i", "U": "u"}
_PCD_SIZES = {"f": (2, 4, 8), "i": (1, 2, 4, 8), "u": (1, 2, 4, 8)}
_UNMOVED = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
# Rounding steps of a coordinate from which on surfaces are blurred [m].
_COARSE_STEP = 0.03
_MARK = codecs.BOM_UTF8
# The end of a header is searched up to here; a header takes some hundred bytes.
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
# A function that takes a note for the user.
OnNote = Callable[[str], None]
# A function that reads a file; its second argument is the number of points per
# block.
_Reader = Callable[[Path, int, OnNote], Iterator[np.ndarray]]
# Number of points of a map that are read at a time.
_BLOCK = 1 << 18
# Largest file of a scan [bytes]; a turn of a LiDAR cannot fill it.
SCAN_LIMIT_BYTES = 1 << 27


def _records(
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
        more: whether the file continues after these rows.
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
            yield _to_records(texts, dtype, kind, start)
        if not more and next(lines, None) is not None:
            raise ValueError(f"more than the {count} rows of the header")
    if count == 0:
        yield np.empty(0, dtype)


def _check_size(path: Path, needed: int, exactly: bool) -> None:
    """Refuses a file shorter or, if `exactly`, longer than `needed` [bytes]."""
    size = path.stat().st_size
    if size < needed:
        raise ValueError(f"cut off at {size} of {needed} bytes")
    if exactly and size > needed:
        raise ValueError(
            f"{size - needed} bytes more than the points of the header"
        )


def _lines(stream: BinaryIO) -> Iterator[bytes]:
    """Yields the lines that are neither blank nor comments."""
    while line := stream.readline(_LONGEST_LINE_BYTES):
        if len(line) == _LONGEST_LINE_BYTES:
            raise ValueError("a line is too long for a row of numbers")
        if line.strip() and not line.lstrip().startswith(b"#"):
            yield line


def _to_records(
    texts: list[bytes], dtype: np.dtype, kind: str, first: int
) -> np.ndarray:
    """Returns (N,) records of a type from rows of numbers.

    Args:
        texts: N rows.
        kind: the kind of file, for errors.
        first: number of rows before these, for errors.
    """
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


def _read_pcd(path: Path, block: int, on_note: OnNote) -> Iterator[np.ndarray]:
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


def _record_type(fields: list[tuple], where: str) -> np.dtype:
    """Returns a type of records; refuses a field that is there twice."""
    names = [field[0] for field in fields]
    for name in repeated(names):
        raise ValueError(f"{where} {name} is there twice")
    return np.dtype(fields)


def _read_pcd_header(path: Path) -> tuple[dict[str, list[str]], int]:
    """Returns keyword -> values, and the offset of the points [bytes]."""
    header = {}
    with open(path, "rb") as stream:
        while stream.tell() < _HEADER_LIMIT_BYTES:
            raw = stream.readline(_HEADER_LIMIT_BYTES).removeprefix(_MARK)
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


def _describe_pcd(header: dict[str, list[str]]) -> tuple[np.dtype, int]:
    """Returns the type of a point and the number of points."""

    def of(keyword: str) -> list[int]:
        try:
            return [int(word) for word in header[keyword]]
        except (KeyError, ValueError) as error:
            raise ValueError(
                f"PCD header: {keyword} is missing or wrong"
            ) from error

    if "FIELDS" not in header:
        raise ValueError("PCD header: FIELDS is missing or wrong")
    names = header["FIELDS"]
    sizes = of("SIZE")
    kinds = [
        _PCD_TYPES.get(kind.upper(), "") for kind in header.get("TYPE", [])
    ]
    counts = of("COUNT") if "COUNT" in header else [1] * len(names)
    numbers = of("POINTS")[:1] if "POINTS" in header else []
    if "WIDTH" in header or not numbers:
        # Unorganised clouds of old writers have no height.
        height = of("HEIGHT")[:1] if "HEIGHT" in header else [1]
        numbers.append(math.prod([*of("WIDTH")[:1], *height]))
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ValueError(
            "PCD header: FIELDS, SIZE, TYPE and COUNT differ in length"
        )
    fields: list[tuple] = []
    for position, name in enumerate(names):
        size = sizes[position]
        kind = kinds[position]
        count = counts[position]
        if size not in _PCD_SIZES.get(kind, ()) or count < 1:
            raise ValueError(
                f"PCD header: {name}: no type {header['TYPE'][position]} of"
                f" SIZE {size} and COUNT {count}"
            )
        # PCL names all padding `_`; a NumPy type needs different names.
        unique = f"_{position}" if name == "_" else name
        shape = () if count == 1 else (count,)
        fields.append((unique, f"<{kind}{size}", shape))
    dtype = _record_type(fields, "PCD header: field")
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
    """Returns points of a file that stores its `count` points by fields."""
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

    Format: each sequence begins with a control byte c. If c < 32, then c + 1
    literal bytes follow. Otherwise the sequence copies earlier bytes. The upper
    three bits of c are the length minus two; if they are 7, the next byte is
    added to the length. The lower five bits and one more byte are the distance
    back minus one.
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


def _read_ply(path: Path, block: int, on_note: OnNote) -> Iterator[np.ndarray]:
    """Reads the vertices of an ascii or binary PLY file.

    Faces and other elements are ignored. In a binary file, elements before the
    vertices may have no lists, because lists would hide where the vertices
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
        offset = _behind_lines(path, offset, sum(one.number for one in before))
        # A vertex takes at least one byte.
        _check_size(path, offset + count, exactly=False)
        more = not alone
        return _text_records(path, offset, count, block, dtype, "PLY", more)
    offset += sum(one.number * one.dtype(order).itemsize for one in before)
    _check_size(path, offset + count * dtype.itemsize, exactly=alone)
    return _records(path, dtype, offset, count, block)


def _behind_lines(path: Path, offset: int, count: int) -> int:
    """Returns the offset after `count` rows of a text file [bytes]."""
    with open(path, "rb") as stream:
        stream.seek(offset)
        for _ in itertools.islice(_lines(stream), count):
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
        return _record_type(fields, f"PLY header: {self.name}: property")


def _read_ply_header(path: Path) -> tuple[str, list[_Element], int]:
    """Returns encoding, elements and the offset of the first one [bytes]."""
    encoding = ""
    elements: list[_Element] = []
    with open(path, "rb") as stream:
        if (
            stream.readline(_HEADER_LIMIT_BYTES).removeprefix(_MARK).strip()
            != b"ply"
        ):
            raise ValueError("not a PLY file")
        while stream.tell() < _HEADER_LIMIT_BYTES:
            raw = stream.readline(_HEADER_LIMIT_BYTES)
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


def no_note(note: str) -> None:
    """Ignores a note for the user: the default where no notes are wanted."""


def read_cloud(
    path: Path, columns: int | None = None, on_note: OnNote = no_note
) -> np.ndarray:
    """Returns the points of a point cloud file.

    The ending of the file's name gives the format: `.pcd` and `.ply` in all
    their encodings; `.npy` with an N x 3 or N x 4 array or a structured array;
    `.bin` with float32 numbers, such as x, y, z and intensity of each point in
    KITTI.

    Args:
        path: an existing file of a scan; see `read_blocks` for maps.
        columns: number of float32 numbers for each point in a `.bin`; by
            default guessed from the values.
        on_note: is called with notes on how the file was read.

    Returns:
        Structured array of shape (N,) with floating-point fields `x`, `y`, `z`
        and all other fields of the file.

    Raises:
        InputError: if there is no such file, its content does not match its
            ending, or it is too large for a scan.
    """
    path = Path(path)
    _find_reader(path)
    with user_errors(path), value_errors(path):
        size = path.stat().st_size
        if size > SCAN_LIMIT_BYTES:
            raise ValueError(f"{size} bytes is too large for a scan")
    # One block holds the whole file.
    (points,) = read_blocks(path, columns, on_note, block=SCAN_LIMIT_BYTES)
    return points


def read_blocks(
    path: Path,
    columns: int | None = None,
    on_note: OnNote = no_note,
    block: int = _BLOCK,
) -> Iterator[np.ndarray]:
    """Reads a point cloud of any size in parts; see `read_cloud`.

    Args:
        path: an existing file.
        columns: see `read_cloud`.
        on_note: see `read_cloud`.
        block: number of points in a part.

    Yields:
        At least one part, maybe empty.

    Raises:
        InputError: see `read_cloud`; raised also between parts, e.g. if the
            file is cut off meanwhile.
    """
    path = Path(path)
    reader = _find_reader(path)
    if reader is _read_bin:
        reader = functools.partial(_read_bin, columns=columns)
    with user_errors(path), value_errors(path):
        check_regular(path)
        read = 0
        coarse = 0.0
        for points in reader(path, block, on_note):
            check_range(points, FARTHEST, first=read)
            read += len(points)
            if not coarse and (coarse := _coarse_step(points)):
                on_note(
                    f"{path}: so far from the origin float32 has steps of"
                    f" {coarse:.2g} m; write float64, or from a nearer origin"
                )
            yield points


def _coarse_step(points: np.ndarray) -> float:
    """Returns the float32 step of the farthest point if coarse, else 0 [m]."""
    farthest = [
        np.abs(points[axis]).max(where=np.isfinite(points[axis]), initial=0)
        for axis in "xyz"
        if points.dtype[axis].str[1:] == "f4"
    ]
    step = float(np.spacing(max(farthest, default=np.float32(0.0))))
    return step if step >= _COARSE_STEP else 0.0


def is_cloud(path: Path) -> bool:
    """Returns whether a file name has the ending of a point cloud file."""
    return path.suffix.lower() in _READERS


def _find_reader(path: Path) -> _Reader:
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path}: unknown kind of point cloud (there are: "
            f"{' '.join(_READERS)})"
        )
    return reader


def _read_npy(path: Path, block: int, on_note: OnNote) -> Iterator[np.ndarray]:
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


def _read_bin(
    path: Path, block: int, on_note: OnNote, columns: int | None = None
) -> Iterator[np.ndarray]:
    layout = find_layout([path], columns)
    if layout.note:
        on_note(layout.note)
    dtype = layout.dtype
    size = path.stat().st_size
    if size % dtype.itemsize:
        raise ValueError(
            f"{size} bytes is not a whole number of points of"
            f" {layout.columns} float32"
        )
    return _records(path, dtype, 0, size // dtype.itemsize, block)


_READERS: dict[str, _Reader] = {
    ".pcd": _read_pcd,
    ".ply": _read_ply,
    ".npy": _read_npy,
    ".bin": _read_bin,
}
