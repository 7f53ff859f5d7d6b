"""Writing files that appear under their names only when they are whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import fcntl
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


@contextlib.contextmanager
def exclusive(path: Path, on_wait: Callable[[], None]) -> Iterator[None]:
    """Keeps other processes that ask for the same out, while the block runs.

    The file `<path>.lock` is locked meanwhile, also for other machines if
    the file system knows locks. It is unlocked however the process ends.

    Args:
        path: what the block works on, a file or a folder.
        on_wait: is called before waiting for another process.

    Raises:
        InputError: if the lock cannot be written.
    """
    lock = path.with_name(f"{path.name}.lock")
    make_folder(path.parent)
    with contextlib.ExitStack() as stack:
        try:
            while not _lock(lock, stack, on_wait):
                pass
        except OSError as error:
            raise InputError(f"{lock}: {error.strerror or error}") from error
        yield


def _lock(
    lock: Path, stack: contextlib.ExitStack, on_wait: Callable[[], None]
) -> bool:
    """Locks a file; tells whether it still has its name then."""
    stream = stack.enter_context(lock.open("w"))
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        on_wait()
        fcntl.flock(stream, fcntl.LOCK_EX)
    except OSError:
        pass  # Some network file systems know no locks; then there is none.
    # Whoever had it before has removed it; others may have made it anew.
    try:
        if not os.path.samestat(os.stat(lock), os.fstat(stream.fileno())):
            return False
    except FileNotFoundError:
        return False
    stack.callback(lock.unlink, missing_ok=True)
    return True
