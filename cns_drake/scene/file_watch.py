"""Notices changes of files."""

from collections.abc import Callable
import functools
import os
from pathlib import Path
from typing import TypeVar

# Larger files are read again each time, so that they do not stay in memory
# [bytes].
_SMALL = 1 << 18
_Result = TypeVar("_Result")


def once_a_file(
    function: Callable[[Path], _Result],
) -> Callable[[Path], _Result]:
    """Makes a function read each small file once, unless the file changes.

    The stages of a city share most of their files. All callers share the
    results, which must therefore be read-only.
    """

    @functools.lru_cache(maxsize=4096)
    def read_once(path: Path, stamp: tuple[int, ...]) -> _Result:
        return function(path)

    @functools.wraps(function)
    def read(path: Path) -> _Result:
        status = _status(path)
        if status is None or status.st_size > _SMALL:
            return function(path)
        return read_once(path, _stamp(status))

    return read


class FileWatch:
    """Notices whether any of a number of files has changed.

    Contents are not compared: a file counts as changed if its size, its time
    stamps or its inode have changed.
    """

    def __init__(self) -> None:
        self._stamps: dict[str, tuple[int, ...]] = {}

    def record(self, path: str) -> os.stat_result | None:
        """Records the status of a file, for a later call of `changed`.

        If the function is called again for the same file, the first status is
        kept.

        Returns:
            The current status; None if the file does not exist.
        """
        status = _status(path)
        self._stamps.setdefault(path, _stamp(status))
        return status

    def changed(self) -> str | None:
        """Returns the path of a file that has changed; None if none has.

        Only files whose status `FileWatch.record` has recorded count.
        """
        for path, stamp in self._stamps.items():
            if _stamp(_status(path)) != stamp:
                return path
        return None


def _status(path: str | Path) -> os.stat_result | None:
    try:
        return os.stat(path)
    except (OSError, ValueError):  # It may not be a file name.
        return None


def _stamp(status: os.stat_result | None) -> tuple[int, ...]:
    if status is None:
        return ()
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
