"""Files of intermediate results that name their inputs.

A part begins with a line that names its format and a line of JSON with its
inputs. Its value follows (see `plain_values`), compressed by zstd at its
fastest level. This halves maps. For 50 MB of spectra, which hardly shrink, it
takes a tenth of a second.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, is_dataclass
import json
from pathlib import Path
from typing import Any, BinaryIO

import zstandard

from cns_drake.base.errors import InputError
from cns_drake.base.files import completing, file_name, make_folder
from cns_drake.base.jobs.fingerprint import code_digest, fingerprint
from cns_drake.base.jobs.step import Reporter, Step
from evaluation.study.plain_values import decode, encode

_MAGIC = b"cns-eval part 2\n"
_LEVEL = 1


@dataclass(frozen=True)
class Part:
    """An intermediate result in a file.

    Attributes:
        path: the file, which need not exist yet.
    """

    path: Path

    def write(self, inputs: Mapping, value: object) -> None:
        """Writes the part; its folder is made if needed.

        Args:
            inputs: all that the value depends on, ready for JSON.
            value: a value of types that `plain_values` can keep.

        Raises:
            InputError: if it cannot be kept or written.
        """
        try:
            plain = encode(value)
        except TypeError as error:
            raise InputError(f"{self.path}: {error}") from error
        compressor = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True)
        data = compressor.compress(plain)
        header = {
            "digest": fingerprint(inputs),
            "bytes": len(data),
            "inputs": inputs,
        }
        make_folder(self.path.parent)
        with (
            completing(self.path) as unfinished,
            open(unfinished, "wb") as stream,
        ):
            stream.write(_MAGIC)
            stream.write(json.dumps(header, sort_keys=True).encode() + b"\n")
            stream.write(data)

    def is_current(self, inputs: Mapping) -> bool:
        """Returns whether a complete part exists that has these inputs."""
        try:
            return self.identity() == fingerprint(inputs)
        except InputError:
            return False

    def identity(self) -> str:
        """Returns the digest of the inputs of the part.

        Raises:
            InputError: if there is no such part, or it is cut off.
        """
        try:
            with open(self.path, "rb") as stream:
                return self._read_header(stream)["digest"]
        except OSError as error:
            raise InputError(
                f"{self.path}: {error.strerror or error}"
            ) from error

    def read(self) -> Any:
        """Returns the value of the part.

        Raises:
            InputError: if there is no such part, or it is damaged.
        """
        try:
            with open(self.path, "rb") as stream:
                self._read_header(stream)
                data = stream.read()
            return decode(zstandard.ZstdDecompressor().decompress(data))
        except OSError as error:
            raise InputError(
                f"{self.path}: {error.strerror or error}"
            ) from error
        except (zstandard.ZstdError, ValueError) as error:
            raise self._damage(error) from error

    def _read_header(self, stream: BinaryIO) -> dict:
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
            raise self._damage(error) from error
        return header

    def _damage(self, error: Exception) -> InputError:
        return InputError(f"{self.path}: damaged ({error}); delete it")


@dataclass(frozen=True)
class MakePart(Step):
    """Writes what a function returns as a part.

    Attributes:
        part: the file to write.
        function: a function of a module, whose code counts as an input; it
            takes a `Reporter` before the arguments.
        arguments: the inputs. Each is plain, a dataclass of plain values, a
            file or folder, of which the name counts, or has a method
            `identity` that says what counts; or is a tuple of such values.
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
        return self.part.is_current(self._inputs()) and all(
            file.is_file() for file in self.figures
        )

    def run(self, reporter: Reporter) -> None:
        # Inputs are read first, so that a file that changes during the work
        # counts as changed.
        inputs = self._inputs()
        self.part.write(inputs, self.function(reporter, *self.arguments))

    def _inputs(self) -> dict[str, object]:
        """Returns all inputs of the part, ready for JSON.

        Raises:
            InputError: an input cannot be read.
        """
        return {
            "function": self.function.__name__,
            "arguments": _identity(self.arguments),
            "code": code_digest(self.function.__module__),
        }


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
class SurveyFiles:
    """The parts that hold the survey of a recording.

    A job that needs one method's descriptions reads no other's.

    Attributes:
        folder: the folder of the parts.
    """

    folder: Path

    @property
    def drive(self) -> Part:
        """The `SurveyedDrive`."""
        return Part(self.folder / "drive.data")

    @property
    def fine(self) -> Part:
        """The cloud for pictures."""
        return Part(self.folder / "fine.data")

    @property
    def scans(self) -> Part:
        """The scans of places and queries: a `KeptScans`, or a list."""
        return Part(self.folder / "scans.data")

    def described(self, key: str) -> Part:
        """Returns the part with (`PlacedDrive`, `DescribedDrive`).

        Args:
            key: name of the method, or a `described_key`.
        """
        return Part(self.folder / f"described_{file_name(key)}.data")


@dataclass(frozen=True)
class RecognitionFiles:
    """The parts that hold the results of methods on two recordings.

    Attributes:
        folder: the folder of the parts.
    """

    folder: Path

    def result(self, key: str) -> Part:
        """Returns the part with the `RecognitionResult` of a method.

        Args:
            key: name of the method, or a `described_key`.
        """
        return Part(self.folder / f"{file_name(key)}.data")

    @property
    def evidence(self) -> Part:
        """The `PairEvidence` of all methods."""
        return Part(self.folder / "why" / "evidence.data")


@dataclass(frozen=True)
class StudyFiles:
    """The files of a study.

    Attributes:
        output: the folder of the study.
    """

    output: Path

    @property
    def figures(self) -> Path:
        """The folder of all figures."""
        return self.output / "figures"

    def survey(self, recording: str) -> SurveyFiles:
        """Returns the parts of the survey of a recording."""
        folder = self.output / "parts" / "surveys"
        return SurveyFiles(folder / file_name(recording))

    def recognition(self, database: str, query: str) -> RecognitionFiles:
        """Returns the parts of the results on two recordings."""
        name = f"{file_name(database)},{file_name(query)}"
        return RecognitionFiles(self.output / "parts" / "recognition" / name)

    def change(self, earlier: str, later: str) -> Part:
        """Returns the part with the `ChangeResult` of two recordings."""
        return self._part("changes", earlier, later)

    @property
    def costs(self) -> Part:
        """The list of `Cost`."""
        return self._part("costs", "costs")

    def page_drives(self, city: str) -> Part:
        """Returns the part with a city's `PageDrive`s, by name."""
        return self._part("pages", city)

    def trend_points(self, database: str, query: str) -> Part:
        """Returns the part with the `TrendPoint`s of two recordings."""
        return self._part("trend", database, query)

    def rung(self, name: str) -> Part:
        """Returns the part with the `RungOutcome`s of a rung of a ladder."""
        return self._part("rungs", name)

    def localised(self, name: str) -> Part:
        """Returns the part with the localised queries of a pair of drives."""
        return self._part("localised", name)

    def map_scores(self, name: str) -> Part:
        """Returns the part with the scores of labels of a pair's maps."""
        return self._part("maps", name)

    def drawn(self, stem: str) -> Part:
        """Returns the part that names the inputs of a figure."""
        return self._part("figures", stem)

    def _part(self, folder: str, *names: str) -> Part:
        name = ",".join(map(file_name, names))
        return Part(self.output / "parts" / folder / f"{name}.data")
