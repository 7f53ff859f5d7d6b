"""File locks, with which only one process at a time does a piece of work."""

from collections.abc import Callable, Iterator
import contextlib
import errno
import fcntl
import hashlib
import os
from pathlib import Path
import stat

from evaluation.base.caches import own_cache
from evaluation.base.files import make_folder, user_errors


@contextlib.contextmanager
def exclusive(path: Path, on_wait: Callable[[], None]) -> Iterator[None]:
    """Locks a file, so that one process at a time runs the block.

    During the block, `<path>.lock` is locked, also for other machines if the
    file system supports locks. In a folder where everybody can write, others
    could take this name, so the lock is in the user's cache. The lock is
    released even if the process crashes. If another process holds the lock,
    `on_wait` is called before waiting.

    Raises:
        InputError: if the lock cannot be written.
    """
    make_folder(path.parent)
    lock = _lock_of(path)
    with contextlib.ExitStack() as stack:
        with user_errors(lock):
            _lock_file(lock, stack, on_wait)
        yield


def remove_lock(path: Path) -> None:
    """Removes the lock of `exclusive` that a killed process left behind.

    A lock that a running process holds stays.
    """
    # A file that cannot be locked is in use, or is not one of our locks.
    with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
        lock = _lock_of(path)
        if lock.is_file():
            _lock_file(lock, stack, _refuse_to_wait)


def _lock_of(path: Path) -> Path:
    """Returns the lock of a file or folder, whose parent exists."""
    if path.parent.stat().st_mode & stat.S_IWOTH:
        own = own_cache("locks")
        if own is not None:
            name = os.fsencode(os.path.realpath(path))
            return own / f"{hashlib.sha256(name).hexdigest()[:32]}.lock"
    return path.with_name(f"{path.name}.lock")


def _refuse_to_wait() -> None:
    raise BlockingIOError


def _lock_file(
    lock: Path, stack: contextlib.ExitStack, on_wait: Callable[[], None]
) -> None:
    """Locks a file until a stack of contexts is closed.

    Args:
        stack: stack that releases the lock when it is closed.
        on_wait: called if another process holds the lock, before waiting.

    Raises:
        OSError: the lock cannot be written.
    """
    while True:
        descriptor = _open_plain(lock)
        stream = stack.enter_context(os.fdopen(descriptor, "wb"))
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            on_wait()
            fcntl.flock(stream, fcntl.LOCK_EX)
        except OSError:
            pass  # Some network file systems have no locks.
        # Its former owner may have removed it, and another process made a new
        # one.
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.stat(lock), os.fstat(stream.fileno())):
                stack.callback(lock.unlink, missing_ok=True)
                return


def _open_plain(path: Path) -> int:
    """Opens a lock for writing, and returns its file descriptor.

    The file is created if it does not exist. Symbolic links are not followed,
    because they may lead to another user's file. If the path is a pipe, the
    function does not wait for a reader. A file with a content is no lock.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
    descriptor = os.open(path, flags, 0o666)
    if os.fstat(descriptor).st_size > 0:
        os.close(descriptor)
        raise FileExistsError(errno.EEXIST, "a file that is no lock")
    return descriptor
