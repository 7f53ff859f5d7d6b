"""Writing files that appear under their names only when they are whole."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path

from evaluation.errors import InputError


@contextlib.contextmanager
def completing(path: Path) -> Iterator[Path]:
    """Yields where to write what shall become the file `path`.

    On leaving normally the file gets its name; on an exception it goes away.

    Raises:
        InputError: if it cannot be written.
    """
    part = path.with_name(f"{path.name}.part")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def make_folder(path: Path) -> None:
    """Makes a folder, with its parents, unless it is there already.

    Raises:
        InputError: if it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
