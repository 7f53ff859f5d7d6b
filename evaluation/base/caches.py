"""The user's cache: what is in it may be missing, cut, foreign or old."""

import contextlib
import os
from pathlib import Path
import shutil
import stat
import time

# What nobody has used for so long is of an older release [s].
_UNUSED_S = 30 * 86400.0


def cache_folder() -> Path | None:
    """Returns cns-drake's folder in the cache of the user.

    Source: the XDG base directory specification. The folder may not exist.
    Without an absolute path, as for a user without a home, there is no cache:
    anybody could have written files in the working directory.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(base):
        base = os.path.expanduser("~/.cache")
    return Path(base) / "cns-drake" if os.path.isabs(base) else None


def own_cache(name: str) -> Path | None:
    """Returns a folder of the cache, which is made if needed.

    The result is None if there is no cache, the folder cannot be made, or
    others can have written there.
    """
    cache = cache_folder()
    if cache is None:
        return None
    folder = cache / name
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if is_own(folder):
            return folder
    return None


def is_own(folder: Path) -> bool:
    """Returns whether only this user, and root, can have filled a folder.

    Raises:
        OSError: there is no such folder.
    """
    state = folder.stat()
    others = state.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return state.st_uid == os.geteuid() and not others


def mark_used(path: Path) -> None:
    """Tells `remove_unused` that a file or folder of a cache is in use."""
    with contextlib.suppress(OSError):
        os.utime(path)


def remove_unused(folder: Path, pattern: str) -> None:
    """Removes what older releases have left in a folder of the cache.

    Args:
        folder: folder of the cache.
        pattern: pattern of the names, as for `Path.glob`, that only this
            program gives.
    """
    for path in folder.glob(pattern):
        with contextlib.suppress(OSError):
            state = path.lstat()
            if (
                state.st_uid != os.geteuid()
                or time.time() - state.st_mtime < _UNUSED_S
            ):
                continue
            if stat.S_ISDIR(state.st_mode):
                shutil.rmtree(path)
            else:
                path.unlink()
