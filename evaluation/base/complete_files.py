"""Writes files and folders, which get their names only when complete."""

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import stat
import tempfile

from evaluation.base.drafts import (
    check_draft,
    check_links,
    draft_file,
    draft_identity,
    scratch_folder,
    sole_writer,
)
from evaluation.base.errors import InputError
from evaluation.base.files import make_folder, user_errors


@contextlib.contextmanager
def completing(path: Path) -> Iterator[Path]:
    """Yields an empty, temporary file, which becomes the file `path`.

    When the block ends normally, the temporary file is flushed to the disk and
    renamed to `path`; an older file of that name is replaced. On an exception,
    the temporary file is removed. Of two processes that write the same file,
    the last one provides it.

    Raises:
        InputError: if the file cannot be written, or `path` is a folder, a
            link, a device or a pipe.
    """
    _check_file(path)
    with user_errors(path), draft_file(path) as part:
        made = draft_identity(part)
        yield part
        check_draft(part, made, path)
        with part.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(part, path)


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
    if not replaces:
        check_new_folder(folder)
    check_links(place)
    make_folder(place.parent)
    with (
        sole_writer(folder),
        user_errors(folder),
        scratch_folder(place) as scratch,
    ):
        made = draft_identity(scratch)
        draft = scratch / place.name
        draft.mkdir()
        yield draft
        check_draft(scratch, made, folder)
        if replaces and os.path.lexists(place):
            os.replace(place, scratch / "replaced")
        os.replace(draft, place)


def remove_folder(folder: Path) -> None:
    """Renames a folder, then removes it.

    If the process is killed before the folder is removed, no incomplete folder
    is left under the original name.

    Raises:
        InputError: if the folder cannot be removed.
    """
    with user_errors(folder), scratch_folder(folder) as scratch:
        os.replace(folder, scratch / "removed")


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


def check_writable(path: Path) -> None:
    """Checks before a long run that a file can be written after the run.

    Creates the folder of the file if necessary, and leaves nothing else behind.

    Raises:
        InputError: if the file could not be written.
    """
    _check_file(path)
    make_folder(path.parent)
    with draft_file(path):
        pass


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


def _check_file(path: Path) -> None:
    """Checks that a file of this name may be written."""
    check_links(path)
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
