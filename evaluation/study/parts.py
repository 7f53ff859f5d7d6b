"""Files of intermediate results that name their inputs.

A part begins with a line that names its format and a line of JSON with its
inputs. Its value follows (see `plain_values`), compressed by zstd at its
fastest level. This halves maps. For 50 MB of spectra, which hardly shrink, it
takes a tenth of a second.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any, BinaryIO

import zstandard

from cns_drake.base.errors import InputError
from cns_drake.base.files import completing, make_folder
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.jobs.step import Reporter, Step
from evaluation.study.plain_values import decode, encode

_MAGIC = b"cns-eval part 2\n"
_LEVEL = 1


class PartStep(Step):
    """A step that writes a part, and figures of it if it has any.

    Attributes:
        part: path of the part.
    """

    part: Path

    @property
    def output(self) -> Path:
        return self.part

    @property
    def figures(self) -> tuple[Path, ...]:
        """Files that `make` writes."""
        return ()

    @abc.abstractmethod
    def inputs(self) -> dict[str, object]:
        """Returns all inputs of the part except the code, ready for JSON.

        Raises:
            InputError: an input cannot be read.
        """

    @abc.abstractmethod
    def make(self, reporter: Reporter) -> object:
        """Returns the value of the part; see `Step.run`."""

    def is_done(self) -> bool:
        inputs = self.made_of(self.inputs())
        return is_current(self.part, inputs) and all(
            file.is_file() for file in self.figures
        )

    def run(self, reporter: Reporter) -> None:
        # Inputs are read first, so that a file that changes during the work
        # counts as changed.
        inputs = self.made_of(self.inputs())
        write_part(self.part, inputs, self.make(reporter))


def write_part(path: Path, inputs: Mapping, value: object) -> None:
    """Writes a part; its folder is made if needed.

    Args:
        path: of the file.
        inputs: all that the value depends on, ready for JSON.
        value: of types that `plain_values` can keep.

    Raises:
        InputError: if it cannot be kept or written.
    """
    try:
        plain = encode(value)
    except TypeError as error:
        raise InputError(f"{path}: {error}") from error
    data = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True).compress(
        plain
    )
    header = {
        "digest": fingerprint(inputs),
        "bytes": len(data),
        "inputs": inputs,
    }
    make_folder(path.parent)
    with completing(path) as unfinished, open(unfinished, "wb") as stream:
        stream.write(_MAGIC)
        stream.write(json.dumps(header, sort_keys=True).encode() + b"\n")
        stream.write(data)


def is_current(path: Path, inputs: Mapping) -> bool:
    """Returns whether a complete part exists that has these inputs."""
    try:
        return part_digest(path) == fingerprint(inputs)
    except InputError:
        return False


def part_digest(path: Path) -> str:
    """Returns the digest of the inputs of a part.

    Raises:
        InputError: if there is no such part, or it is cut off.
    """
    try:
        with open(path, "rb") as stream:
            return _read_header(path, stream)["digest"]
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


def read_part(path: Path) -> Any:
    """Returns the value of a part.

    Raises:
        InputError: if there is no such part, or it is damaged.
    """
    try:
        with open(path, "rb") as stream:
            _read_header(path, stream)
            data = stream.read()
        return decode(zstandard.ZstdDecompressor().decompress(data))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    except (zstandard.ZstdError, ValueError) as error:
        raise InputError(f"{path}: damaged ({error}); delete it") from error


def _read_header(path: Path, stream: BinaryIO) -> dict:
    """Reads up to the value, which must have its full length."""
    try:
        if stream.readline(len(_MAGIC)) != _MAGIC:
            raise ValueError("no part of a study")
        header = json.loads(stream.readline())
        start = stream.tell()
        if stream.seek(0, 2) - start != header["bytes"]:
            raise ValueError("cut off")
        stream.seek(start)
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: damaged ({error}); delete it") from error
    return header
