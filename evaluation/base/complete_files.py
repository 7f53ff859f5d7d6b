"""Writes files and folders, which get their names only when complete."""

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import shutil
import stat
import tempfile

from evaluation.base.errors import InputError
from evaluation.base.file_locks import exclusive, lock_file
from evaluation.base.files import make_folder, user_errors


def part_path(path: Path) -> Path:
    """Returns the temporary name that a file has until it is complete."""
    return path.with_name(f"{path.name}.part")


@contextlib.contextmanager
def completing(path: Path) -> Iterator[Path]:
    """Yields a temporary path to write, which becomes the file `path`.

    When the block ends normally, the temporary file is flushed to the disk and
    renamed to `path`. On an exception, the temporary file is removed. If
    another process is writing the same file, the block waits until that file is
    complete.

    Raises:
        InputError: if the file cannot be written, or `path` is a folder, a
            link, a device or a pipe.
    """
    part = _new_part(path)
    with contextlib.ExitStack() as stack, user_errors(path):
        lock_file(part, stack, lambda: None)
        try:
            # A pipe or link of that name must not be written to.
            part.unlink(missing_ok=True)
            yield part
            complete_part(path)
        finally:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)


@contextlib.contextmanager
def draft_folder(folder: Path, *, replaces: bool = False) -> Iterator[Path]:
    """Yields a temporary folder that becomes `folder` when the block ends.

    The temporary folder has the name of `folder`, because files that are
    written to it may contain this name; only the parent folder differs. On an
    exception the temporary folder is removed. An existing `folder` that is not
    empty is replaced if `replaces` is true; otherwise it is an error.

    Raises:
        InputError: `folder` cannot be written, another process is writing it,
            or it is not empty although `replaces` is false.
    """
    # `.` has no name.
    place = Path(os.path.abspath(folder))
    part = part_path(place)
    draft = part / place.name
    if not replaces:
        check_new_folder(folder)
    with sole_writer(folder):
        try:
            with user_errors(folder):
                # A run that was killed may have left one behind.
                shutil.rmtree(part, ignore_errors=True)
                draft.mkdir(parents=True)
                yield draft
                if replaces and os.path.lexists(place):
                    os.replace(place, part / "replaced")
                os.replace(draft, place)
        finally:
            shutil.rmtree(part, ignore_errors=True)


def check_new_folder(folder: Path) -> None:
    """Raises an error if a folder that is to be made already contains files.

    Raises:
        InputError: the folder contains files, or the path exists and is not a
            folder.
    """
    with user_errors(folder):
        if os.path.lexists(folder) and (
            folder.is_symlink() or not folder.is_dir() or any(folder.iterdir())
        ):
            raise InputError(f"{folder}: exists already; give a new folder")


def write_text(path: Path, text: str) -> None:
    """Writes a text file, which gets its name only when it is complete.

    Raises:
        InputError: if it cannot be written.
    """
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")


def write_part(path: Path, text: str) -> None:
    """Writes text to the temporary file of `path`, and flushes it to disk.

    `complete_part` then gives the file its final name.

    Raises:
        InputError: if that fails, e.g. on a full disk.
    """
    part = _new_part(path)
    # Several files must all be whole before the first gets its name.
    with user_errors(part):
        if not part.is_char_device():  # A full device reports its error.
            part.unlink(missing_ok=True)
    with user_errors(part), open(part, "w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())


def complete_part(path: Path) -> None:
    """Renames the temporary file of `path` to `path`, once it is on the disk.

    An older file of that name is replaced.

    Raises:
        InputError: the file cannot be written to the disk or renamed.
    """
    with user_errors(path):
        part = part_path(path)
        with part.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(part, path)


def check_writable(path: Path) -> None:
    """Checks before a long run that a file can be written after the run.

    Creates the folder of the file if necessary, and leaves nothing else behind.

    Raises:
        InputError: if the file could not be written.
    """
    with user_errors(path):
        part = _new_part(path)
        make_folder(path.parent)
        part.touch()
        part.unlink()


def check_folder_writable(folder: Path) -> None:
    """Checks before a long run that files can be written to a folder.

    The folder need not exist; nothing is left behind.

    Raises:
        InputError: if no file could be written.
    """
    existing = folder
    while not os.path.lexists(existing):
        existing = existing.parent
    with user_errors(folder), tempfile.TemporaryFile(dir=existing):
        pass


def sole_writer(folder: Path) -> contextlib.AbstractContextManager[None]:
    """Returns a context manager that locks a folder which is being written.

    Raises:
        InputError: on entering the context, if another process is writing the
            folder, or the lock cannot be written.
    """

    def refuse() -> None:
        raise InputError(f"{folder}: another process is writing this folder")

    return exclusive(part_path(Path(os.path.abspath(folder))), refuse)


def _new_part(path: Path) -> Path:
    """Returns the temporary name of a file, if the file may be written.

    Raises:
        InputError: the path is a folder, link, device or pipe.
    """
    with user_errors(path):
        mode = path.lstat().st_mode if os.path.lexists(path) else stat.S_IFREG
        if stat.S_ISDIR(mode):
            raise InputError(
                f"{path}: a folder has this name; give another file name"
            )
        if stat.S_ISLNK(mode):
            # Neither may the link's target be overwritten, nor the link be
            # replaced.
            raise InputError(f"{path}: a link; give the name of a file")
        if not stat.S_ISREG(mode):
            raise InputError(f"{path}: not a regular file")
    return part_path(path)
