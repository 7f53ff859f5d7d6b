"""A store of results: each has a file named by what the result was made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from evaluation.base.jobs.parts import Part
from evaluation.base.json_text import fingerprint
from evaluation.base.version import __version__

# Length of a file's name, in hexadecimal digits.
_DIGITS = 20


@dataclass(frozen=True, eq=False)
class Key:
    """What a result is, and everything on which it depends.

    Equal inputs give equal keys, wherever files are, whatever they are called,
    and whatever else is measured beside.

    Attributes:
        kind: what the result is; the name of its folder in a store.
        inputs: what the result is made of, ready for JSON: the contents of
            files, settings and versions.
        version: counts the changes of the result for equal inputs. Raise it
            with each such change.
    """

    kind: str
    inputs: Mapping[str, object]
    version: int = 1

    @property
    def made_of(self) -> dict[str, object]:
        """The inputs, with the versions of the program and of the result."""
        return {**self.inputs, "version": [__version__, self.version]}

    @cached_property
    def digest(self) -> str:
        """Digest of kind, inputs and versions."""
        return fingerprint({"kind": self.kind, **self.made_of})


@dataclass(frozen=True)
class Store:
    """Results in a folder.

    Attributes:
        folder: the folder. It can move, and several runs can share it.
    """

    folder: Path

    def part(self, key: Key) -> Part:
        """Returns the file of a result."""
        name = f"{key.digest[:_DIGITS]}.data"
        return Part(self.folder / key.kind / name)

    def has(self, key: Key) -> bool:
        """Returns whether the store has a result."""
        part = self.part(key)
        return part.path.is_file() and part.is_current(key.made_of)

    def read(self, key: Key) -> Any:
        """Returns a result.

        Raises:
            InputError: the store lacks it, or its file is damaged.
        """
        return self.part(key).read()

    def write(self, key: Key, value: object) -> None:
        """Adds a result.

        Raises:
            InputError: the value cannot be encoded, or the file cannot be
                written.
        """
        self.part(key).write(key.made_of, value)
