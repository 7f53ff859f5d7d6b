"""Files of intermediate results that name their inputs.

A part is the file of one intermediate result. The first line of the file names
the format, and the second line contains the inputs as JSON. The result follows
(see `encode`), compressed by zstd at its
fastest level. Compression halves the size of maps. Spectra hardly shrink;
compressing 50 MB of spectra takes a tenth of a second.
"""

from collections.abc import Callable, Iterator, Mapping
import contextlib
from dataclasses import asdict, dataclass, fields, is_dataclass
import importlib
import io
import json
import math
from pathlib import Path
import re
import struct
import sys
import tokenize
from types import NoneType, UnionType
from typing import Any, BinaryIO, Union, get_args, get_origin, get_type_hints

import numpy as np
import zstandard

from cns_drake.base import (
    InputError,
    Reporter,
    Step,
    check_regular,
    code_digest,
    completing,
    fingerprint,
    make_folder,
    user_errors,
)

_MAGIC = b"cns-eval part 2\n"
_LEVEL = 1
# Field of the header of a part whose value was removed.
_REMOVED = "spent"
# Greatest size of a line of inputs [bytes].
_MOST_INPUTS = 1 << 24
# Limit of the uncompressed size, as a multiple of the compressed bytes.
_MOST_RATIO = 200
# This uncompressed size is always allowed [bytes].
_ALWAYS_BYTES = 1 << 27


def _uncompressed_size(size: int) -> int:
    """Returns the greatest uncompressed size of some compressed bytes."""
    return max(_MOST_RATIO * size, _ALWAYS_BYTES)


@dataclass(frozen=True)
class Part:
    """An intermediate result of a study, in a file that names its inputs.

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
        try:
            plain = encode(value)
        except TypeError as error:
            raise InputError(f"{self.path}: {error}") from error
        compressor = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True)
        data = compressor.compress(plain)
        is_stored = len(plain) > _uncompressed_size(len(data))
        data = plain if is_stored else data
        header = {
            "digest": fingerprint(inputs),
            "bytes": len(data),
            "inputs": inputs,
            **({"stored": True} if is_stored else {}),
        }
        make_folder(self.path.parent)
        self._write(header, data)

    def remove_value(self) -> None:
        """Removes the value, and keeps the record of its inputs.

        Results that were made from the value stay valid. Call
        `discard_if_value_removed` if the value must be computed again.

        Raises:
            InputError: if there is no such file, or it is damaged.
        """
        with self._opened() as (header, _):
            if _REMOVED in header:
                return
        self._write({**header, "bytes": 0, _REMOVED: True}, b"")

    def discard_if_value_removed(self) -> None:
        """Deletes the file if its value was removed; a job then makes it anew.

        Raises:
            InputError: if the file cannot be deleted.
        """
        is_removed = False
        with contextlib.suppress(InputError), self._opened() as (header, _):
            is_removed = _REMOVED in header
        if is_removed:
            with user_errors(self.path):
                self.path.unlink()

    def _write(self, header: Mapping, data: bytes) -> None:
        with (
            completing(self.path) as unfinished,
            open(unfinished, "wb") as stream,
        ):
            stream.write(_MAGIC)
            stream.write(json.dumps(header, sort_keys=True).encode() + b"\n")
            stream.write(data)

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
            if _REMOVED in header:
                raise InputError(f"{self.path}: its value was removed")
            data = stream.read()
            if "stored" not in header:
                data = zstandard.ZstdDecompressor().decompress(data)
            return decode(data)

    def size(self) -> int:
        """Returns the approximate size of the value in memory [bytes].

        Raises:
            InputError: if there is no such file, or it is damaged.
        """
        with self._opened() as (header, stream):
            if {"stored", _REMOVED} & header.keys():
                return header["bytes"]
            return zstandard.frame_content_size(stream.read(18))

    def fits(self, hint: object) -> bool:
        """Returns whether the value in the file can be of a given type.

        Only the beginning of the file is read. The result is false if the file
        cannot be read.

        Args:
            hint: the type, as in an annotation.
        """
        with (
            contextlib.suppress(InputError),
            self._opened() as (header, stream),
        ):
            source: Any = stream
            if "stored" not in header:
                source = zstandard.ZstdDecompressor().stream_reader(stream)
            most = _uncompressed_size(header["bytes"])
            return _fits_type(_read_tree(source, most), hint)
        return False

    @contextlib.contextmanager
    def _opened(self) -> Iterator[tuple[dict, BinaryIO]]:
        """Yields the header, and the value after checking its length."""
        check_regular(self.path)
        try:
            with open(self.path, "rb") as stream:
                if stream.readline(len(_MAGIC)) != _MAGIC:
                    raise ValueError("no part of a study")
                header = json.loads(stream.readline(_MOST_INPUTS))
                start = stream.tell()
                size = stream.seek(0, 2) - start
                if size != header["bytes"]:
                    raise ValueError("cut off")
                stream.seek(start)
                if not {"stored", _REMOVED} & header.keys():
                    claimed = zstandard.frame_content_size(stream.read(18))
                    if not 0 <= claimed <= _uncompressed_size(size):
                        raise ValueError(f"{size} bytes stand for {claimed}")
                    stream.seek(start)
                yield header, stream
        except OSError as error:
            raise InputError(
                f"{self.path}: {error.strerror or error}"
            ) from error
        except (zstandard.ZstdError, ValueError, *_DECODING_ERRORS) as error:
            raise InputError(
                f"{self.path}: damaged ({error}); delete it"
            ) from error


@dataclass(frozen=True)
class MakePart(Step):
    """A job step that writes the result of a function to a file.

    Attributes:
        function: function whose result is written. The first parameter of this
            function is a `Reporter`; the arguments follow. If its code changes,
            the file is made again.
        arguments: arguments of the function. If one changes, the file is made
            again. An argument is a plain value, a dataclass of plain values, a
            path (of which only the name counts), an object with a method
            `identity` that returns what counts, or a tuple of such values.
        figures: further files that the function writes.
        part: the file that is written, with the digest of its inputs.
    """

    part: Part
    function: Callable[..., object]
    arguments: tuple[object, ...]
    figures: tuple[Path, ...] = ()

    @property
    def output(self) -> Path:
        return self.part.path

    def is_done(self) -> bool:
        hint = _annotations(self.function).get("return", Any)
        return (
            self.part.path.is_file()
            and self.part.is_current(self._inputs())
            and all(file.is_file() for file in self.figures)
            and self.part.fits(hint)
        )

    def run(self, reporter: Reporter) -> None:
        # Inputs are read first, so that a file that changes during the work
        # counts as changed.
        inputs = self._inputs()
        self.part.write(inputs, self.function(reporter, *self.arguments))

    def parts(self) -> Iterator[Part]:
        """Yields the parts among the arguments of the function."""
        return _parts_in(self.arguments)

    def _inputs(self) -> dict[str, object]:
        """Returns all inputs of the result, ready for JSON.

        Raises:
            InputError: an input cannot be read.
        """
        return {
            "function": self.function.__name__,
            "arguments": _identity(self.arguments),
            "code": code_digest(self.function.__module__),
        }


def _parts_in(argument: object) -> Iterator[Part]:
    if isinstance(argument, Part):
        yield argument
    elif isinstance(argument, tuple):
        for one in argument:
            yield from _parts_in(one)


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
# Types in these modules belong to methods and are not checked.
_METHODS = "evaluation.methods"
_OWN_MODULE = re.compile(r"evaluation(\.[a-z]\w*)+")
# Errors for a tree of another form or with other fields, and for headers of
# arrays that NumPy cannot parse.
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
    tokenize.TokenError,
)
# The form of a tree -> the type of its value; see `_Encoder`.
_FORMS: dict[str, type] = {
    "tuple": tuple,
    "dict": dict,
    "array": np.ndarray,
    "bytes": bytes,
}


def encode(value: object) -> bytes:
    """Returns a value as bytes; equal values give equal bytes.

    A value is None, a number, text, bytes, an array without Python objects, or
    a list, tuple, dict, named tuple or dataclass of such values.

    Raises:
        TypeError: if the value contains anything else.
    """
    encoder = _Encoder()
    tree = json.dumps(encoder.encode(value), separators=(",", ":")).encode()
    stream = io.BytesIO()
    stream.write(_LENGTH.pack(len(tree)))
    stream.write(tree)
    for array in encoder.arrays:
        np.lib.format.write_array(stream, array, allow_pickle=False)
    return stream.getvalue()


def decode(data: bytes) -> Any:
    """Returns the value that `encode` turned into bytes.

    Dataclasses must belong to this package, or to modules that have been
    imported.

    Raises:
        ValueError: if the bytes are not from `encode`, or a type is unknown.
    """
    try:
        (length,) = _LENGTH.unpack_from(data)
        start = _LENGTH.size + length
        tree = json.loads(data[_LENGTH.size : start])
        return _decode_tree(tree, _read_arrays(data, start))
    except _DECODING_ERRORS as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


class _Encoder:
    """Turns a value into a tree; arrays that occur twice are stored once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        # The identity of an array -> its number.
        self._numbers: dict[int, int] = {}

    def encode(self, value: Any) -> Any:
        """Returns the tree of a value, and adds its arrays to `arrays`."""
        kind = type(value)
        if value is None or kind in (bool, int, float, str):
            return value
        if kind is list:
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


def _read_arrays(data: bytes, start: int) -> list[np.ndarray]:
    """Returns the arrays that are stored from an offset onwards."""
    stream = io.BytesIO(data)
    stream.seek(start)
    arrays = []
    while (place := stream.tell()) < len(data):
        # NumPy would first reserve all that a header names.
        is_first = np.lib.format.read_magic(stream) == (1, 0)
        form = "1_0" if is_first else "2_0"
        read = getattr(np.lib.format, f"read_array_header_{form}")
        shape, _, dtype = read(stream)
        if math.prod(shape) * dtype.itemsize > len(data) - stream.tell():
            raise ValueError("an array is cut off")
        stream.seek(place)
        arrays.append(np.lib.format.read_array(stream, allow_pickle=False))
    return arrays


def _decode_tree(tree: Any, arrays: list[np.ndarray]) -> Any:
    """Returns the value of a tree; see `_Encoder`."""
    if isinstance(tree, list):
        return [_decode_tree(one, arrays) for one in tree]
    if not isinstance(tree, dict):
        return tree
    if "tuple" in tree:
        return tuple(_decode_tree(one, arrays) for one in tree["tuple"])
    if "dict" in tree:
        return {
            _decode_tree(key, arrays): _decode_tree(value, arrays)
            for key, value in tree["dict"]
        }
    if "array" in tree:
        return arrays[tree["array"]]
    if "bytes" in tree:
        return arrays[tree["bytes"]].tobytes()
    if "scalar" in tree:
        return arrays[tree["scalar"]][()]
    if "named" in tree:
        values = [_decode_tree(one, arrays) for one in tree["values"]]
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
        object.__setattr__(made, name, _decode_tree(value, arrays))
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


def _read_tree(stream: BinaryIO, most: int) -> Any:
    """Returns the tree of an encoded value, without its arrays.

    Args:
        stream: the encoded value, from its beginning.
        most: greatest number of bytes of the tree that are read.
    """
    (length,) = _LENGTH.unpack(stream.read(_LENGTH.size))
    return json.loads(stream.read(min(length, most)))


def _fits_type(tree: Any, hint: Any) -> bool:
    """Returns whether an encoded value may be of a type.

    Arrays may hold anything.

    Args:
        tree: the tree of the value, from `_read_tree`.
        hint: the type, as in an annotation.
    """
    kind = get_origin(hint) or hint
    inner = get_args(hint)
    if kind in (Union, UnionType):
        return any(_fits_type(tree, one) for one in inner)
    kind = NoneType if kind is None else kind
    is_open = kind is Any or not isinstance(kind, type)
    if is_open or (isinstance(tree, dict) and "scalar" in tree):
        return True
    found = type(tree)
    if isinstance(tree, dict):
        name = tree.get("dataclass") or tree.get("named")
        forms = [one for form, one in _FORMS.items() if form in tree]
        found = _find_type(*name) if name else forms[0]
    if not issubclass(found, (kind, int) if kind is float else kind):
        return False
    if is_dataclass(found) and not found.__module__.startswith(_METHODS):
        hints = _annotations(found)
        return all(
            _fits_type(tree["fields"][one.name], hints.get(one.name, Any))
            for one in fields(found)
        )
    if found not in (list, tuple, dict) or not inner:
        return True
    items = tree if found is list else tree[found.__name__]
    if found is dict:
        items = [one for _, one in items]
    elif kind is tuple and inner[1:] != (...,):
        return len(items) == len(inner) and all(map(_fits_type, items, inner))
    return all(_fits_type(one, inner[found is dict]) for one in items)


def _annotations(kind: Any) -> dict[str, Any]:
    """Returns the annotations of a class or function, if they can be found."""
    try:
        return get_type_hints(kind)
    except NameError:  # A type is imported for type checkers alone.
        return {}
