"""A file that an interrupted process resumes by writing it again."""

import contextlib
import fcntl
import io
import os
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.file_locks import open_plain


class PartFile(io.BufferedRandom):
    """A binary file that keeps what a run writes again, and replaces the rest.

    A process that resumes an interrupted file writes all bytes again from the
    start of the file. While it replays, written bytes are only compared with
    the file: equal bytes are kept. At the first difference, the rest of the
    file is cut off, and from then on bytes are written as in any file.

    The result is the same as if the file had been empty. The part that both
    runs have in common is never lost, and there is no second copy on the disk.

    Only one process can write the file at a time. The file is locked until it
    is closed or its process ends in any way.

    Attributes:
        replaying: whether the file already contained all bytes written so far.
    """

    def __init__(self, path: Path):
        """Opens the file, or creates it.

        Raises:
            OSError: the file cannot be opened or locked.
            InputError: another process is writing the file.
        """
        descriptor = open_plain(path, os.O_RDWR)
        super().__init__(io.FileIO(descriptor, "r+b"))
        try:
            self._lock(path)
        except BaseException:
            self.close()
            raise
        self.replaying = os.fstat(descriptor).st_size > 0

    def starts_like(self, content: bytes) -> bool:
        """Returns whether the existing file and a content begin alike.

        File and content are compared up to the end of the shorter of the two.
        """
        self.seek(0)
        found = self.read(len(content))
        self.seek(0)
        return content.startswith(found)

    def clear(self) -> None:
        """Empties the file."""
        self.seek(0)
        self.truncate()
        self.replaying = False

    def write(self, data: bytes) -> int:  # type: ignore[override]
        """Writes the next bytes, or keeps them if the file has the same.

        While the file is being replayed, bytes that equal the file's next bytes
        are not written. At the first difference, the rest of the file is cut
        off, and replaying ends.

        Args:
            data: the next bytes.

        Returns:
            Number of bytes, as for any file.
        """
        if self.replaying:
            start = self.tell()
            if self.read(len(data)) == data:
                return len(data)
            self.seek(start)
            self.truncate()
            self.replaying = False
        return super().write(data)

    def finish(self) -> None:
        """Ends the file here and flushes it to the disk."""
        self.truncate()
        self.flush()
        os.fsync(self.fileno())

    def _lock(self, path: Path) -> None:
        # Some network file systems have no locks; then there is none.
        with contextlib.suppress(OSError):
            try:
                fcntl.flock(self, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"{path}: another process is writing this file"
                ) from None
        # Between opening and locking, that process may have completed the
        # file and given it another name.
        if not os.path.samestat(os.stat(path), os.fstat(self.fileno())):
            raise InputError(f"{path}: another process has completed this file")
