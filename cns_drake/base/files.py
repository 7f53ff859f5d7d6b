"""Writing files that get their final names only when they are complete."""

import codecs
from collections.abc import Callable, Iterator
import contextlib
import fcntl
import hashlib
import os
from pathlib import Path
import shutil
import stat

from cns_drake.base.errors import InputError

_WRITTEN_BYTES = 1 << 26
# Some file systems allow 255; this leaves room for endings and joined names.
_LONGEST_NAME_BYTES = 120
# Number of characters at the beginning of a longer name that are kept.
_KEPT_CHARACTERS = 20


def cache_folder() -> Path:
    """Returns cns-drake's folder in the cache of the user.

    Source: the XDG base directory specification. The folder may not exist.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    folder = Path(base) if os.path.isabs(base) else Path("~/.cache")
    return Path(os.path.expanduser(folder)) / "cns-drake"


def part_path(path: Path) -> Path:
    """Returns the temporary name that a file has until it is complete."""
    return path.with_name(f"{path.name}.part")


@contextlib.contextmanager
def user_errors(path: Path | str) -> Iterator[None]:
    """Turns a file system error into an InputError that names the file.

    Raises:
        InputError: if the block raises OSError.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


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
        _lock(part, stack, lambda: None)
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
        InputError: if `folder` cannot be written, is not empty and `replaces`
            is false, or another process is writing it.
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


def remove_folder(folder: Path) -> None:
    """Renames a folder, then removes it.

    If the process is killed meanwhile, no incomplete folder is left under the
    original name.

    Raises:
        InputError: if the folder cannot be removed.
    """
    part = part_path(folder)
    with user_errors(folder):
        # A run that was killed may have left one behind.
        shutil.rmtree(part, ignore_errors=True)
        os.replace(folder, part)
        shutil.rmtree(part)


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


def check_regular(path: Path) -> None:
    """Raises an error unless a path is a regular file.

    Raises:
        InputError: the path does not exist, or is a folder, device or pipe.
    """
    with user_errors(path):
        mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"{path}: Is a directory")
    if not stat.S_ISREG(mode):
        raise InputError(f"{path}: not a regular file")


def is_there(path: Path) -> bool:
    """Returns whether an optional file exists.

    Raises:
        InputError: the path is something else: a folder, a pipe, a dead link.
    """
    if not os.path.lexists(path):
        return False
    check_regular(path)
    return True


def read_bytes(path: Path, limit: int = _WRITTEN_BYTES) -> bytes:
    """Returns the content of a file, after checking its size.

    Args:
        path: the file.
        limit: greatest size of the file [bytes]; the default is ample for files
            written by hand.

    Raises:
        InputError: if the file cannot be read, does not exist or is too large.
    """
    check_regular(path)
    with user_errors(path), open(path, "rb") as stream:
        content = stream.read(limit + 1)
    if len(content) > limit:
        raise InputError(f"{path}: larger than {limit} bytes")
    return content


def read_text(path: Path, limit: int = _WRITTEN_BYTES) -> str:
    """Returns the text of a file of at most `limit` bytes.

    `decode_text` describes the possible encodings.

    Raises:
        InputError: if the file cannot be read, or is not text.
    """
    try:
        return decode_text(read_bytes(path, limit))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text") from error


def decode_text(data: bytes) -> str:
    """Returns the text in UTF-8 bytes, or in UTF-16 with a byte order mark.

    A byte order mark, with which editors of Windows begin files, is removed.

    Raises:
        UnicodeDecodeError: the bytes are in neither encoding.
    """
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return data.decode("utf-16" if is_utf16 else "utf-8-sig")


def file_name(text: str) -> str:
    """Turns a text into a file name that cannot lead to another folder.

    Use this function for the names of the drive, map and stage in a recording
    before these names become parts of paths. Usual names stay unchanged. In
    unusual names, unsafe characters are replaced such that different names stay
    different.
    """
    name = "".join(
        c if c.isalnum() or c in "_-+ " or (c == "." and k) else _escaped(c)
        for k, c in enumerate(text)
    )
    if not name or len(name.encode()) > _LONGEST_NAME_BYTES:
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass"))
        # An escaped character never has a tilde behind its percent sign.
        name = f"{name[:_KEPT_CHARACTERS]}%~{digest.hexdigest()[:32]}"
    return name


def _escaped(character: str) -> str:
    octets = character.encode("utf-8", "surrogatepass")
    return "".join(f"%{octet:02X}" for octet in octets)


def _new_part(path: Path) -> Path:
    """Returns the part name of a file that may be written.

    Raises:
        InputError: the name is that of a folder, link, device or pipe.
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


def open_plain(path: Path, flags: int) -> int:
    """Opens a file for writing, and returns its file descriptor.

    The file is created if it does not exist. Symbolic links are not followed,
    because they may lead to another user's file. If the path is a pipe, the
    function does not wait for a reader.

    Args:
        path: the file.
        flags: further flags of `os.open`, such as `os.O_WRONLY`.
    """
    flags |= os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
    return os.open(path, flags, 0o666)


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
    with user_errors(path):
        part = _new_part(path)
        make_folder(path.parent)
        part.touch()
        part.unlink()


def make_folder(path: Path) -> None:
    """Makes a folder, with its parents, unless it is there already.

    Raises:
        InputError: if it cannot be made, or a file has its name.
    """
    with user_errors(path):
        try:
            path.mkdir(parents=True, exist_ok=True)
        except FileExistsError:
            raise InputError(f"{path}: not a folder") from None


@contextlib.contextmanager
def exclusive(path: Path, on_wait: Callable[[], None]) -> Iterator[None]:
    """Locks a file, so that one process at a time runs the block.

    During the block, `<path>.lock` is locked, also for other machines if the
    file system supports locks. The lock is released even if the process
    crashes. If another process holds the lock, `on_wait` is called before
    waiting.

    Raises:
        InputError: if the lock cannot be written.
    """
    make_folder(path.parent)
    with contextlib.ExitStack() as stack:
        with user_errors(path.with_name(f"{path.name}.lock")):
            _lock(path, stack, on_wait)
        yield


def sole_writer(folder: Path) -> contextlib.AbstractContextManager[None]:
    """Returns a context manager that locks a folder which is being written.

    Raises:
        InputError: on entering the context, if another process is writing the
            folder, or the lock cannot be written.
    """

    def refuse() -> None:
        raise InputError(f"{folder}: another process is writing this folder")

    return exclusive(part_path(Path(os.path.abspath(folder))), refuse)


def remove_lock(path: Path) -> None:
    """Removes the lock file `<path>.lock` that a killed process left behind.

    A lock that a running process holds stays.
    """
    if path.with_name(f"{path.name}.lock").is_file():
        # A file that cannot be locked is in use, or is not one of our locks.
        with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
            _lock(path, stack, _refuse_to_wait)


def _refuse_to_wait() -> None:
    raise BlockingIOError


def _lock(
    path: Path, stack: contextlib.ExitStack, on_wait: Callable[[], None]
) -> None:
    """Locks `<path>.lock` until `stack` is closed."""
    lock = path.with_name(f"{path.name}.lock")
    while True:
        descriptor = open_plain(lock, os.O_WRONLY)
        stream = stack.enter_context(os.fdopen(descriptor, "w"))
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
