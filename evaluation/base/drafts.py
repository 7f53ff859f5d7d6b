"""Files and folders that are not complete yet.

A draft lies beside the file or folder that it will become, under a name that
nobody can know. A record of the draft in the user's cache is locked while the
process lives. Of a process that was killed, the next one removes the draft:
only what a record describes is removed. Without a cache, drafts of killed
processes stay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import fcntl
import json
import os
from pathlib import Path
import secrets
import shutil
import stat
from typing import Any

from evaluation.base.caches import own_cache
from evaluation.base.errors import InputError
from evaluation.base.files import user_errors

_ENDING = ".part"
# Number of characters of a name that its draft keeps: names end somewhere.
_KEPT = 40


@contextlib.contextmanager
def draft_file(target: Path) -> Iterator[Path]:
    """Yields a new, empty file beside `target`, which is removed at the end.

    Raises:
        InputError: the file cannot be written.
    """

    def make(path: Path) -> None:
        flags = os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_WRONLY
        os.close(os.open(path, flags, 0o666))

    with _draft(target, make) as path:
        yield path


@contextlib.contextmanager
def scratch_folder(target: Path) -> Iterator[Path]:
    """Yields a new folder beside `target`, which is removed at the end.

    No other user can look into the folder.

    Raises:
        InputError: the folder cannot be written.
    """
    with _draft(target, lambda path: path.mkdir(mode=0o700)) as path:
        yield path


def is_draft_of(path: Path, target: Path) -> bool:
    """Returns whether a path has the name of a draft of `target`."""
    start = f".{target.name[-_KEPT:]}."
    return path.name.startswith(start) and path.name.endswith(_ENDING)


def check_draft(draft: Path, made: list[int], target: Path) -> None:
    """Raises an error if a draft is not what this process made.

    In a folder that everybody may change, others can put something else there.

    Raises:
        InputError: something else has the draft's name.
    """
    if draft_identity(draft) != made:
        raise InputError(f"{target}: something else took the unfinished file")


def draft_identity(path: Path) -> list[int]:
    """Returns what the file system knows a file, folder or link by."""
    state = path.lstat()
    kind = stat.S_IFMT(state.st_mode)
    return [state.st_dev, state.st_ino, state.st_uid, kind]


@contextlib.contextmanager
def sole_writer(target: Path, what: str = "folder") -> Iterator[None]:
    """Excludes the user's other processes from writing a file or folder.

    Args:
        target: the file or folder.
        what: what it is called in the error.

    Raises:
        InputError: on entering the context, if another process writes it.
    """
    with _recorded({"sole": _place(target)}) as is_free:
        if not is_free:
            raise InputError(
                f"{target}: another process is writing this {what}"
            )
        yield


def _place(target: Path) -> str:
    return os.path.realpath(target)


@contextlib.contextmanager
def _draft(target: Path, make: Callable[[Path], None]) -> Iterator[Path]:
    # `.` has no name.
    place = Path(os.path.abspath(target))
    name = f".{place.name[-_KEPT:]}.{secrets.token_hex(16)}{_ENDING}"
    path = place.with_name(name)
    with user_errors(target):
        make(path)
        made = draft_identity(path)
    with _recorded({"draft": str(path), "made": made}):
        try:
            yield path
        finally:
            _remove(path, made)


def _remove(path: Path, made: list[int]) -> None:
    """Removes a draft, unless something else has its name."""
    with contextlib.suppress(OSError):
        if draft_identity(path) != made:
            return
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()


@contextlib.contextmanager
def _recorded(values: dict[str, Any]) -> Iterator[bool]:
    """Keeps a locked record of this process's work.

    Yields False, without a record, if a living process has an equal one.
    """
    with contextlib.ExitStack() as stack:
        is_free = True
        # A cache that cannot be written, or a file system without locks.
        with contextlib.suppress(OSError), _locked_records() as records:
            if records is not None:
                is_free = values not in _living(records)
            if records is not None and is_free:
                path = records / f"{secrets.token_hex(16)}.json"
                stream = stack.enter_context(path.open("xb", 0))
                stack.callback(path.unlink, missing_ok=True)
                fcntl.flock(stream, fcntl.LOCK_EX)
                stream.write(json.dumps(values).encode())
        yield is_free


@contextlib.contextmanager
def _locked_records() -> Iterator[Path | None]:
    """Yields the folder of records, locked; None if there is none."""
    records = own_cache("drafts")
    if records is None:
        yield None
        return
    with (records / "lock").open("a") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield records


def _living(records: Path) -> list[dict[str, Any]]:
    """Returns the records of living processes; removes drafts of others."""
    living = []
    for path in records.glob("*.json"):
        with contextlib.suppress(FileNotFoundError), path.open() as stream:
            values = _values(stream.read())
            try:
                fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                living.append(values)
                continue
            if "draft" in values:
                _remove(Path(values["draft"]), values.get("made", []))
            path.unlink()
    return living


def _values(text: str) -> dict[str, Any]:
    """Returns the values of a record; none if it was cut off."""
    with contextlib.suppress(ValueError):
        values = json.loads(text)
        if isinstance(values, dict):
            return values
    return {}


def check_links(path: Path) -> None:
    """Refuses a path through a link of another user.

    Raises:
        InputError: a folder of the path is a link of another user, in a folder
            where others can write.
    """
    for folder in Path(os.path.abspath(path)).parents:
        # What is not there is reported when it is used.
        with contextlib.suppress(OSError):
            if (
                folder.is_symlink()
                and folder.lstat().st_uid not in (0, os.geteuid())
                and folder.parent.stat().st_mode & (stat.S_IWGRP | stat.S_IWOTH)
            ):
                raise InputError(
                    f"{folder}: a link of another user; give the path to which"
                    " it leads"
                )
