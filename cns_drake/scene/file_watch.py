"""Notices changes of files."""

import os


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


def _status(path: str) -> os.stat_result | None:
    try:
        return os.stat(path)
    except (OSError, ValueError):  # It may not be a file name.
        return None


def _stamp(status: os.stat_result | None) -> tuple[int, ...]:
    if status is None:
        return ()
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
