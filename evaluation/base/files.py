"""Files that a user names: checks, order, and reading."""

import codecs
from collections.abc import Iterator
import contextlib
import hashlib
import os
from pathlib import Path
import re
import stat

from evaluation.base.budget import reading
from evaluation.base.errors import InputError

# Some file systems allow 255; this leaves room for endings and joined names.
_LONGEST_NAME_BYTES = 120
# Number of characters at the beginning of a longer name that are kept.
_KEPT_CHARACTERS = 20
_NUMBERS = re.compile(r"([0-9]+)")


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


# How a file begins that stands for one in Git LFS, and its greatest size.
_POINTER = b"version https://git-lfs.github.com/spec/"
_POINTER_BYTES = 1024


def check_regular(path: Path) -> None:
    """Raises an error unless a path is a regular file.

    Raises:
        InputError: the path does not exist, or is a folder, device or pipe.
    """
    with user_errors(path):
        status = path.stat()
    mode = status.st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"{path}: Is a directory")
    if not stat.S_ISREG(mode):
        raise InputError(f"{path}: not a regular file")
    if status.st_size <= _POINTER_BYTES:
        with user_errors(path), path.open("rb") as stream:
            if stream.read(len(_POINTER)) == _POINTER:
                raise InputError(
                    f"{path}: a pointer of Git LFS instead of the file; `git"
                    " lfs pull` fetches it"
                )


def is_there(path: Path) -> bool:
    """Returns whether an optional file exists.

    Raises:
        InputError: the path is something else: a folder, a pipe, a dead link.
    """
    if not os.path.lexists(path):
        return False
    check_regular(path)
    return True


def read_bytes(path: Path) -> bytes:
    """Returns the content of a file.

    Raises:
        InputError: if the file cannot be read or does not exist.
    """
    check_regular(path)
    with reading(path), user_errors(path), open(path, "rb") as stream:
        # What is added meanwhile may have no end.
        return stream.read(os.fstat(stream.fileno()).st_size)


def read_text(path: Path) -> str:
    """Returns the text of a file; `decode_text` describes the encodings.

    Raises:
        InputError: if the file cannot be read, or is not text.
    """
    try:
        return decode_text(read_bytes(path))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text") from error


def decode_text(data: bytes) -> str:
    """Returns bytes as text, from UTF-8 or from UTF-16 with a byte order mark.

    A byte order mark, with which editors of Windows begin files, is removed.

    Raises:
        UnicodeDecodeError: the bytes are in neither encoding.
    """
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return data.decode("utf-16" if is_utf16 else "utf-8-sig")


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


def natural_key(text: str) -> tuple:
    """Returns the key by which names are sorted in natural order.

    Digits in a name count as whole numbers: 9 comes before 10, `v9` before
    `v10`, and `2012-2-4` before `2012-10-28`. Names that differ only in leading
    zeros are in the order of text.
    """
    # Text and numbers alternate. Of two numbers, the longer one is greater.
    return tuple(
        (len(part.lstrip("0")), part.lstrip("0")) if k % 2 else part
        for k, part in enumerate(_NUMBERS.split(text))
    ), text


def listed(folder: Path, pattern: str = "*") -> list[Path]:
    """Returns the files and folders in a folder, in natural order.

    Hidden files are left out: editors and macOS write files such as
    `._000001.bin` next to the user's files.

    Args:
        folder: the folder. If the folder does not exist, the result is empty.
        pattern: pattern of the names, as for `Path.glob`.
    """
    found = [
        path for path in folder.glob(pattern) if not path.name.startswith(".")
    ]
    return sorted(found, key=lambda path: natural_key(str(path)))


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
