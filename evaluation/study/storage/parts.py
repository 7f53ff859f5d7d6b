"""Files of intermediate results that name their inputs.

A part is the file of one intermediate result. The first line of the file names
the format, and the second line contains the inputs as JSON. The result follows
(see `evaluation.study.storage.value_encoding`), compressed by zstd at its
fastest level. Compression halves the size of maps. Spectra hardly shrink;
compressing 50 MB of spectra takes a tenth of a second.
"""

from collections.abc import Callable, Iterator, Mapping
import contextlib
from dataclasses import asdict, dataclass, is_dataclass
import json
from pathlib import Path
from typing import Any, BinaryIO

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
from evaluation.study.storage.value_encoding import (
    DECODING_ERRORS,
    annotations,
    decode,
    encode,
    fits_type,
    read_tree,
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
            return fits_type(read_tree(source, most), hint)
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
        except (zstandard.ZstdError, ValueError, *DECODING_ERRORS) as error:
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
        hint = annotations(self.function).get("return", Any)
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
