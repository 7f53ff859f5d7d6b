"""Files of intermediate results that name their inputs.

A part is the file of one intermediate result. It begins with a line that names
its format and a line of JSON with its inputs. The result follows (see
`encode`), compressed by zstd at its fastest level. Compression halves maps.
Spectra hardly shrink; compressing 50 MB of them takes a tenth of a second.
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

from cns_drake.base.errors import InputError
from cns_drake.base.files import (
    check_regular,
    completing,
    file_name,
    make_folder,
    user_errors,
)
from cns_drake.base.jobs.fingerprint import code_digest, fingerprint
from cns_drake.base.jobs.step import Reporter, Step

_LENGTH = struct.Struct("<Q")
# Types in these modules belong to methods and are not checked.
_METHODS = "evaluation.methods"
_OWN_MODULE = re.compile(r"evaluation(\.[a-z]\w*)+")
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
# Errors for a tree of another form or with other fields, and for headers of
# arrays that NumPy cannot parse.
_FAULTS = (
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

    Unlike a pickle, which can run any code when it is read, the bytes contain a
    tree of JSON, followed by the arrays as NumPy stores them. A value is None,
    a number, text, bytes, an array without Python objects, or a list, tuple,
    dict, named tuple or dataclass of such values.

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
        return _decode(tree, _read_arrays(data, start))
    except _FAULTS as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


class _Encoder:
    """Turns a value into a tree; arrays that occur twice are stored once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        # The identity of an array -> its number.
        self._numbers: dict[int, int] = {}

    def encode(self, value: Any) -> Any:
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
            return {"array": self._add(value)}
        if kind is bytes:
            return {"bytes": self._add(np.frombuffer(value, np.uint8))}
        if isinstance(value, np.generic):
            return {"scalar": self._add(np.asarray(value))}
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

    def _add(self, array: np.ndarray) -> int:
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


def _decode(tree: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(tree, list):
        return [_decode(one, arrays) for one in tree]
    if not isinstance(tree, dict):
        return tree
    if "tuple" in tree:
        return tuple(_decode(one, arrays) for one in tree["tuple"])
    if "dict" in tree:
        return {
            _decode(key, arrays): _decode(value, arrays)
            for key, value in tree["dict"]
        }
    if "array" in tree:
        return arrays[tree["array"]]
    if "bytes" in tree:
        return arrays[tree["bytes"]].tobytes()
    if "scalar" in tree:
        return arrays[tree["scalar"]][()]
    if "named" in tree:
        values = [_decode(one, arrays) for one in tree["values"]]
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
        object.__setattr__(made, name, _decode(value, arrays))
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


def _fits_type(tree: Any, hint: Any) -> bool:
    """Returns whether a tree may be of a type; arrays may hold anything."""
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

        Results that were made from the value stay valid. Call `restore` if the
        value must be computed again.

        Raises:
            InputError: if there is no such file, or it is damaged.
        """
        with self._opened() as (header, _):
            if _REMOVED in header:
                return
        self._write({**header, "bytes": 0, _REMOVED: True}, b"")

    def restore(self) -> None:
        """Removes the file if its value was removed; a job then makes it anew.

        Raises:
            InputError: if the file cannot be removed.
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
        """Returns the size of the value in memory, about [bytes].

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
            (length,) = _LENGTH.unpack(source.read(_LENGTH.size))
            tree = source.read(min(length, _uncompressed_size(header["bytes"])))
            return _fits_type(json.loads(tree), hint)
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
        except (zstandard.ZstdError, ValueError, *_FAULTS) as error:
            raise InputError(
                f"{self.path}: damaged ({error}); delete it"
            ) from error


@dataclass(frozen=True)
class MakePart(Step):
    """A job step that writes the result of a function to a file.

    Attributes:
        function: function whose result is written. Its first parameter is a
            `Reporter`; the arguments follow. If its code changes, the file is
            made again.
        arguments: arguments of the function. If one changes, the file is made
            again. Each is a plain value, a dataclass of plain values, a path
            (of which only the name counts), an object whose method `identity`
            returns what counts, or a tuple of such values.
        figures: further files that the function writes.
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


@dataclass(frozen=True)
class FeatureFiles:
    """The files (`Part`) with all that a study needs of a recording.

    These are the drive's poses and map, its scans at places and queries, and,
    in one file for each method, the descriptors of these scans.

    Attributes:
        folder: folder of the files.
    """

    folder: Path

    @property
    def drive(self) -> Part:
        """The file with the drive's poses and map, a `DriveSummary`."""
        return Part(self.folder / "drive.data")

    @property
    def fine(self) -> Part:
        """The file with the cloud for pictures, an array (K, 3)."""
        return Part(self.folder / "fine.data")

    @property
    def scans(self) -> Part:
        """The file with the drive's scans at places and queries.

        For a drive with a map, the file contains a `KeptScans`; otherwise a
        list of scans (N, 3).
        """
        return Part(self.folder / "scans.data")

    def described(self, key: str) -> Part:
        """Returns the file with a method's descriptors of the drive.

        The file contains a `DriveNames` and a `DriveDescriptors`.

        Args:
            key: `MethodChoice.key` of the method. For descriptors by a second
                protocol, what `described_key` of
                `evaluation.study.feature_extraction` returns.
        """
        return Part(self.folder / f"described_{file_name(key)}.data")

    def remove_descriptors(self) -> None:
        """Removes all descriptors, once results were made from them.

        Descriptors take three quarters of the space; see `Part.remove_value`.

        Raises:
            InputError: a file cannot be written.
        """
        for path in sorted(self.folder.glob("described_*.data")):
            Part(path).remove_value()


@dataclass(frozen=True)
class StudyFiles:
    """The paths of all files of a study.

    Attributes:
        output: folder of the study.
    """

    output: Path

    @property
    def figures(self) -> Path:
        """The folder of all figures."""
        return self.output / "figures"

    def features(self, recording: str) -> FeatureFiles:
        """Returns the files with a recording's map and descriptors."""
        folder = self.output / "parts" / "features"
        return FeatureFiles(folder / file_name(recording))

    def part(self, kind: str, *names: str) -> Part:
        """Returns the file of an intermediate result.

        Args:
            kind: kind of result, such as `changes`; the name of a folder.
            names: names of the drives to which the result belongs.
        """
        name = ",".join(map(file_name, names))
        return Part(self.output / "parts" / kind / f"{name}.data")
