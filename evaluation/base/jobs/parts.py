"""Files of intermediate results that name their inputs.

A part is the file of one intermediate result. The first line of the file names
the format, and the second line contains the inputs as JSON. The result follows
(see `encode`), compressed by zstd at its fastest level. Compression halves the
size of maps. Spectra hardly shrink; compressing 50 MB of spectra takes a tenth
of a second.

The descriptors and scans of a long drive do not fit into memory together. They
are kept in a `LongList`, whose blocks of items follow the result in the file.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import asdict, dataclass, fields, is_dataclass
import importlib
import json
import os
from pathlib import Path
import re
import struct
import sys
import tempfile
from typing import Any, BinaryIO
import weakref

import numpy as np
import zstandard

from evaluation.base.budget import reading
from evaluation.base.complete_files import completing
from evaluation.base.errors import InputError
from evaluation.base.files import check_regular, make_folder, user_errors
from evaluation.base.jobs.step import Reporter, Step
from evaluation.base.json_text import fingerprint
from evaluation.base.unpacking import unpacked

_MAGIC = b"cns-eval part 3\n"
_LEVEL = 1
# What compressed data begin with.
_ZSTD = b"\x28\xb5\x2f\xfd"
# A `LongList` keeps at most this number of its last items in memory.
_MOST_HELD = 512
# Number of items of a `LongList` that are written and read together.
_BLOCK = 64


class _Joined(Sequence[Any]):
    """A sequence to which lists can be added, as to a list."""

    def __add__(self, other: list[Any]) -> list[Any]:
        return [*self, *other]

    def __radd__(self, other: list[Any]) -> list[Any]:
        return [*other, *self]


class LongList(_Joined):
    """A list that grows, and keeps its items in a file once there are many.

    The last items, at most 512, are in memory until the list is written as part
    of the value of a `Part`. Of the items in a file, the blocks that were used
    last are in memory, with 512 items. An item that is read again is another
    object, so do not change it. A short slice is a list; a long one reads its
    items when they are used, like the `LongList`.

    Items that cannot be stored (see `encode`) all stay in memory.
    """

    def __init__(self, folder: Path | None = None):
        """Makes an empty list.

        Args:
            folder: existing folder for a temporary file, which has no name and
                vanishes with the list; None for the system's folder.
        """
        self._path = folder
        self._stream: BinaryIO | None = None
        # Ends of the blocks in the file, after the start of the first block.
        self._ends = [0]
        # Number of items in blocks; all blocks but the last one are full.
        self._num_stored = 0
        # Size of the blocks without compression [bytes].
        self._plain_bytes = 0
        self._recent: list[Any] = []
        # Blocks in memory, from the least to the most recently used one.
        self._blocks: dict[int, list[Any]] = {}
        self._is_storable = True

    @classmethod
    def of(cls, items: Iterable[Any]) -> LongList:
        """Returns a list of items, with the system's folder if it is long."""
        made = cls()
        for item in items:
            made.append(item)
        return made

    @classmethod
    def _in_file(
        cls,
        path: Path,
        stream: BinaryIO,
        start: int,
        stored: Mapping[str, Any],
    ) -> LongList:
        """Returns a list whose blocks are in a part.

        Args:
            path: path of the part, for error messages.
            stream: the part, which is open: the file may be replaced by then.
            start: offset of the first block.
            stored: the result of `_stored`.
        """
        made = cls()
        made._path = path
        made._stream = os.fdopen(os.dup(stream.fileno()), "rb")
        weakref.finalize(made, made._stream.close)
        made._ends = [start, *(start + end for end in stored["ends"])]
        made._num_stored = stored["items"]
        made._plain_bytes = stored["plain"]
        return made

    def __len__(self) -> int:
        return self._num_stored + len(self._recent)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            if self._num_stored == 0:
                return self._recent[index]
            return _stretch(self, range(len(self))[index])
        index = range(len(self))[index]
        if index >= self._num_stored:
            return self._recent[index - self._num_stored]
        number, within = divmod(index, _BLOCK)
        block = self._blocks.pop(number, None)
        if block is None:
            block = self._read(number)
            if len(self._blocks) >= max(2, _MOST_HELD // _BLOCK):
                del self._blocks[next(iter(self._blocks))]
        self._blocks[number] = block
        return block[within]

    @property
    def _where(self) -> Path:
        return self._path or Path("temporary file")

    @property
    def num_bytes(self) -> int:
        """Size of the items in the file if they were in memory [bytes]."""
        return self._plain_bytes

    @property
    def is_in_file(self) -> bool:
        """Whether some of its items are in a file."""
        return self._num_stored > 0

    def append(self, item: Any) -> None:
        """Adds an item; the oldest items in memory are written to the file."""
        assert self._num_stored % _BLOCK == 0, "the list was written"
        self._recent.append(item)
        if self._is_storable and len(self._recent) > _MOST_HELD:
            try:
                self._write(_BLOCK)
            except TypeError:
                self._is_storable = False

    def _write(self, number: int) -> None:
        """Writes the next items to the file as one block."""
        plain = encode(self._recent[:number])
        data = _compressed(plain)
        with user_errors(self._where):
            if self._stream is None:
                self._stream = tempfile.TemporaryFile(dir=self._path)  # noqa: SIM115
                weakref.finalize(self, self._stream.close)
            self._stream.write(data)
            self._stream.flush()
        del self._recent[:number]
        self._num_stored += number
        self._plain_bytes += len(plain)
        self._ends.append(self._ends[-1] + len(data))

    def _read(self, number: int) -> list[Any]:
        """Returns the items of a block."""
        data = self._bytes(number)
        with _damage_named(self._where):
            return decode(_unpacked(data))

    def _bytes(self, number: int) -> bytes:
        """Returns a block as it is in the file."""
        assert self._stream is not None
        start, end = self._ends[number : number + 2]
        with _damage_named(self._where):
            data = os.pread(self._stream.fileno(), end - start, start)
            if len(data) < end - start:
                raise ValueError("cut off")
        return data

    def _stored(self) -> dict[str, Any]:
        """Writes all items to the file; returns what `_in_file` needs."""
        while self._recent:
            self._write(min(len(self._recent), _BLOCK))
        start = self._ends[0]
        return {
            "items": self._num_stored,
            "ends": [end - start for end in self._ends[1:]],
            "plain": self._plain_bytes,
        }

    def _copy(self, stream: BinaryIO) -> None:
        """Appends all blocks to a stream; `_stored` comes first."""
        for number in range(len(self._ends) - 1):
            stream.write(self._bytes(number))


def _stretch(of: LongList, rows: range) -> Sequence[Any]:
    """Returns some items, as a list if there are few."""
    if len(rows) <= _BLOCK:
        return [of[row] for row in rows]
    return _Stretch(of, rows)


class _Stretch(_Joined):
    """Some items of a list, which are read when they are used."""

    def __init__(self, of: LongList, rows: range):
        self._of = of
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return _stretch(self._of, self._rows[index])
        return self._of[self._rows[index]]


def _compressed(plain: bytes) -> bytes:
    compressor = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True)
    return compressor.compress(plain)


def _unpacked(data: bytes) -> bytes:
    # Version 4 stored some results as they are.
    return unpacked(data, "zstd" if data.startswith(_ZSTD) else "")


@dataclass(frozen=True)
class Part:
    """An intermediate result, in a file that names its inputs.

    Attributes:
        path: path of the file.
    """

    path: Path

    def write(self, inputs: Mapping, value: object) -> None:
        """Writes a value to the file; creates its folder if needed.

        The inputs are everything on which the value depends, ready for JSON.

        Raises:
            InputError: if the value cannot be encoded, or the file cannot be
                written.
        """
        lists: list[LongList] = []
        try:
            plain = encode(value, lists)
            stored = [one._stored() for one in lists]
        except TypeError as error:
            raise InputError(f"{self.path}: {error}") from error
        data = _compressed(plain)
        header = {
            "digest": fingerprint(inputs),
            "bytes": len(data),
            "plain": len(plain),
            "inputs": inputs,
            "lists": stored,
        }
        make_folder(self.path.parent)
        with (
            completing(self.path) as unfinished,
            open(unfinished, "wb") as stream,
        ):
            stream.write(_MAGIC)
            stream.write(json.dumps(header, sort_keys=True).encode() + b"\n")
            stream.write(data)
            for one in lists:
                one._copy(stream)

    def is_current(self, inputs: Mapping) -> bool:
        """Returns whether the file is complete and made from `inputs`."""
        try:
            return self.identity() == fingerprint(inputs)
        except InputError:
            return False

    def identity(self) -> str:
        """Returns the digest of the inputs from which the file was made.

        Raises:
            InputError: if there is no such file, or it is cut off.
        """
        with self._opened() as (header, _):
            return header["digest"]

    def read(self) -> Any:
        """Returns the value in the file.

        Raises:
            InputError: if there is no such file, or it is damaged.
        """
        with self._opened() as (header, stream):
            data = stream.read(header["bytes"])
            lists = []
            start = stream.tell()
            for stored in header["lists"]:
                lists.append(
                    LongList._in_file(self.path, stream, start, stored)
                )
                start += stored["ends"][-1]
            return decode(_unpacked(data), lists)

    def size(self) -> int:
        """Returns the approximate size of the value in memory [bytes].

        Raises:
            InputError: if there is no such file, or it is damaged.
        """
        with self._opened() as (header, _):
            return sum(one["plain"] for one in (header, *header["lists"]))

    @contextlib.contextmanager
    def _opened(self) -> Iterator[tuple[dict, BinaryIO]]:
        """Yields the header, and the value after checking its length."""
        check_regular(self.path)
        with _damage_named(self.path), open(self.path, "rb") as stream:
            if stream.readline(len(_MAGIC)) != _MAGIC:
                raise ValueError("no part of a study")
            header = json.loads(stream.readline())
            start = stream.tell()
            ends = (one["ends"][-1] for one in header["lists"])
            if stream.seek(0, 2) - start != header["bytes"] + sum(ends):
                raise ValueError("cut off")
            stream.seek(start)
            yield header, stream


@contextlib.contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    """Limits reading a file; turns its errors into an `InputError`."""
    try:
        with reading(path):
            yield
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    except (ValueError, *_DECODING_ERRORS) as error:
        raise InputError(f"{path}: damaged ({error}); delete it") from error


@dataclass(frozen=True)
class MakePart(Step):
    """A job step that writes the result of a function to a file.

    Attributes:
        function: function whose result is written. The first parameter of this
            function is a `Reporter`; the arguments follow.
        arguments: arguments of the function. If one changes, the file is made
            again. An argument is a plain value, a dataclass of plain values, a
            path (of which only the name counts), an object with a method
            `identity` that returns what counts, or a tuple of such values.
        version: counts the changes of what the function returns for the same
            arguments.
        figures: further files that the function writes.
        part: the file that is written, with the digest of its inputs.
    """

    part: Part
    function: Callable[..., object]
    arguments: tuple[object, ...]
    version: int = 1
    figures: tuple[Path, ...] = ()

    @property
    def output(self) -> Path:
        return self.part.path

    def is_done(self) -> bool:
        return (
            self.part.path.is_file()
            and self.part.is_current(self.inputs())
            and all(file.is_file() for file in self.figures)
        )

    def run(self, reporter: Reporter) -> None:
        # Inputs are read first, so that a file that changes during the work
        # counts as changed.
        inputs = self.inputs()
        self.part.write(inputs, self.function(reporter, *self.arguments))

    def inputs(self) -> dict[str, object]:
        """Returns all inputs of the result, ready for JSON.

        Raises:
            InputError: an input cannot be read.
        """
        return self.made_of(
            {
                "function": self.function.__name__,
                "arguments": _identity(self.arguments),
            }
        )


def _identity(argument: Any) -> object:
    if isinstance(argument, tuple):
        return [_identity(one) for one in argument]
    if isinstance(argument, Path):
        return argument.name
    if hasattr(argument, "identity"):
        return argument.identity()
    if is_dataclass(argument) and not isinstance(argument, type):
        return asdict(argument)
    return argument


_LENGTH = struct.Struct("<Q")
_OWN_MODULE = re.compile(r"evaluation(\.[a-z]\w*)+")
# Errors for a tree of another form or with other fields.
_DECODING_ERRORS = (
    AttributeError,
    ImportError,
    IndexError,
    KeyError,
    OverflowError,
    RecursionError,
    SyntaxError,
    TypeError,
    struct.error,
)


def encode(value: object, lists: list[LongList] | None = None) -> bytes:
    """Returns a value as bytes; equal values give equal bytes.

    A value is None, a number, text, bytes, an array without Python objects, or
    a list, tuple, dict, named tuple or dataclass of such values.

    Args:
        value: the value.
        lists: the lists among the values whose items are in a file are added
            here instead of their items; None if there are none.

    Raises:
        TypeError: if the value contains anything else.
    """
    encoder = _Encoder(lists)
    tree = encoder.encode(value)
    types: dict[str, int] = {}
    headers = []
    for one in encoder.arrays:
        described = repr(np.lib.format.dtype_to_descr(one.dtype))
        number = types.setdefault(described, len(types))
        headers.append((number, one.shape, "F" if one.flags.fnc else "C"))
    index = [list(types), headers, tree]
    text = json.dumps(index, separators=(",", ":")).encode()
    arrays = (one.tobytes("A") for one in encoder.arrays)
    return b"".join([_LENGTH.pack(len(text)), text, *arrays])


def decode(data: bytes, lists: Sequence[LongList] = ()) -> Any:
    """Returns the value that `encode` turned into bytes.

    Dataclasses must belong to this package, or to modules that have been
    imported.

    Args:
        data: the bytes.
        lists: the lists among the values whose items are in a file.

    Raises:
        ValueError: if the bytes are not from `encode`, or a type is unknown.
    """
    try:
        (length,) = _LENGTH.unpack_from(data)
        start = _LENGTH.size + length
        types, headers, tree = json.loads(data[_LENGTH.size : start])
        dtypes = [
            np.lib.format.descr_to_dtype(ast.literal_eval(one)) for one in types
        ]
        if any(one.hasobject for one in dtypes):
            raise ValueError("an array of objects")
        arrays = []
        for number, shape, order in headers:
            whole = np.ndarray(shape, dtypes[number], data, start, order=order)
            arrays.append(whole.copy(order))
            start += whole.nbytes
        return _decode_tree(tree, arrays, lists)
    except _DECODING_ERRORS as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


class _Encoder:
    """Turns a value into a tree; arrays that occur twice are stored once."""

    def __init__(self, lists: list[LongList] | None) -> None:
        self._lists = lists
        self.arrays: list[np.ndarray] = []
        # The identity of an array -> its number.
        self._numbers: dict[int, int] = {}

    def encode(self, value: Any) -> Any:
        """Returns the tree of a value, and adds its arrays to `arrays`."""
        kind = type(value)
        if value is None or kind in (bool, int, float, str):
            return value
        if kind is LongList and value.is_in_file and self._lists is not None:
            self._lists.append(value)
            return {"long": len(self._lists) - 1}
        if kind in (list, LongList):
            return [self.encode(one) for one in value]
        if kind is tuple:
            return {"tuple": [self.encode(one) for one in value]}
        if kind is dict:
            pairs = [[self.encode(k), self.encode(v)] for k, v in value.items()]
            return {"dict": pairs}
        if kind is np.ndarray:
            return {"array": self._number_of(value)}
        if kind is bytes:
            return {"bytes": self._number_of(np.frombuffer(value, np.uint8))}
        if isinstance(value, np.generic):
            return {"scalar": self._number_of(np.asarray(value))}
        name = [kind.__module__, kind.__qualname__]
        if is_dataclass(value):
            values = {
                field.name: self.encode(getattr(value, field.name))
                for field in fields(value)
            }
            return {"dataclass": name, "fields": values}
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return {"named": name, "values": [self.encode(v) for v in value]}
        raise TypeError(
            f"{'.'.join(name)} cannot be kept: use numbers, text, arrays, or"
            " lists, tuples, dicts and dataclasses of them"
        )

    def _number_of(self, array: np.ndarray) -> int:
        """Returns the number of an array, which is stored if it is new."""
        if id(array) not in self._numbers:
            if array.dtype.hasobject:
                raise TypeError("an array of objects cannot be kept")
            self._numbers[id(array)] = len(self.arrays)
            self.arrays.append(array)
        return self._numbers[id(array)]


def _decode_tree(
    tree: Any, arrays: Sequence[np.ndarray], lists: Sequence[LongList]
) -> Any:
    """Returns the value of a tree; see `_Encoder`."""

    def decoded(inner: Any) -> Any:
        return _decode_tree(inner, arrays, lists)

    if isinstance(tree, list):
        return [decoded(one) for one in tree]
    if not isinstance(tree, dict):
        return tree
    if "tuple" in tree:
        return tuple(map(decoded, tree["tuple"]))
    if "dict" in tree:
        return {decoded(key): decoded(value) for key, value in tree["dict"]}
    if "long" in tree:
        return lists[tree["long"]]
    if "array" in tree:
        return arrays[tree["array"]]
    if "bytes" in tree:
        return arrays[tree["bytes"]].tobytes()
    if "scalar" in tree:
        return arrays[tree["scalar"]][()]
    if "named" in tree:
        values = [decoded(one) for one in tree["values"]]
        kind = _find_type(*tree["named"])
        if not issubclass(kind, tuple) or len(kind._fields) != len(values):
            raise TypeError(f"{kind.__name__} is no such tuple")
        return tuple.__new__(kind, values)
    kind = _find_type(*tree["dataclass"])
    names = {field.name for field in fields(kind)}
    if names != tree["fields"].keys():
        raise TypeError(f"{kind.__name__} has other fields")
    made = object.__new__(kind)
    for name, value in tree["fields"].items():
        object.__setattr__(made, name, decoded(value))
    return made


def _find_type(module: str, name: str) -> Any:
    """Returns a type by its name; imports only modules of this package."""
    if module not in sys.modules and _OWN_MODULE.fullmatch(module):
        importlib.import_module(module)
    found: Any = sys.modules[module]
    for part in name.split("."):
        found = vars(found)[part]
    if not isinstance(found, type):
        raise TypeError(f"{name} is no type")
    return found
