"""Writing files so that a final name only ever means a complete file."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path

from cns_drake.errors import InputError


def part_path(path: Path) -> Path:
    """Returns the name that a file has until it is complete."""
    return path.with_name(f"{path.name}.part")


@contextlib.contextmanager
def user_errors(path: Path) -> Iterator[None]:
    """Turns errors of the file system into one line that names the file.

    Raises:
        InputError: if the block raises OSError.
    """
    try:
        yield
    except OSError as error:
        fault = error.strerror or str(error)
        raise InputError(f"{path}: {fault}") from error


def write_part(path: Path, text: str) -> None:
    """Writes text under the part name of `path`, down to the disk.

    Raises:
        InputError: if that fails, e.g. on a full disk.
    """
    part = part_path(path)
    with user_errors(part), open(part, "w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())


def complete_part(path: Path) -> None:
    """Gives a file its final name, replacing an older file of that name.

    Raises:
        InputError: if that fails.
    """
    with user_errors(path):
        os.replace(part_path(path), path)


def check_writable(path: Path) -> None:
    """Finds out before a long run whether a file can be written at its end.

    Creates the folder if need be and leaves nothing else behind.

    Raises:
        InputError: if the file could not be written.
    """
    with user_errors(path):
        if path.is_dir():
            raise InputError(f"{path}: there is a folder of this name")
        path.parent.mkdir(parents=True, exist_ok=True)
        part = part_path(path)
        part.touch()
        part.unlink()
