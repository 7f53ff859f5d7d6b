"""Digests of files; a file is read again only if it has changed.

A file is identified by a digest of its content and not by its time of change: a
copy counts as the same file, and a corrected file as another file, even if both
have the same size. To read large files only once, the digests are stored in the
user's cache folder, together with the size and the times that the file system
states for each file.
"""

from collections.abc import Sequence
import contextlib
import hashlib
import json
import os
from pathlib import Path
import time

from evaluation.base.caches import mark_used, own_cache, remove_unused
from evaluation.base.complete_files import write_text
from evaluation.base.files import check_regular, user_errors

_BLOCK_BYTES = 1 << 20
# Number of digits of a digest.
_DIGITS = 64
# A file that was changed so recently may change again without another time:
# some file systems count whole seconds [ns].
_SETTLED_NS = 2_000_000_000


def file_digests(files: Sequence[Path]) -> list[str]:
    """Returns the SHA-256 digests of the contents of files.

    Raises:
        InputError: a file cannot be read, or is no regular file.
    """
    if not files:
        return []
    paths = [os.path.realpath(file) for file in files]
    name = hashlib.sha256("\0".join(paths).encode(errors="surrogateescape"))
    cache = own_cache("digests")
    if cache is None:
        return [_state_and_digest(path, None)[1] for path in paths]
    kept = cache / f"{name.hexdigest()[:32]}.json"
    known: dict[str, list] = {}
    # A cache that cannot be read or written only costs time.
    with contextlib.suppress(Exception):
        known = {
            path: [[*state], digest]
            for path, (state, digest) in json.loads(kept.read_bytes()).items()
            if isinstance(digest, str) and len(digest) == _DIGITS
        }
    if known:
        mark_used(kept)
    else:
        remove_unused(cache, "*.json")
    found = {path: _state_and_digest(path, known.get(path)) for path in paths}
    settled = {
        path: entry for path, entry in found.items() if entry[0] is not None
    }
    if settled != known:
        with contextlib.suppress(Exception):
            write_text(kept, json.dumps(settled))
    return [found[path][1] for path in paths]


def settled_state(path: Path) -> list[int] | None:
    """Returns what the file system says of a file; None while it may change.

    If two results are equal, so are the contents. The result is also None if
    the file is not there.
    """
    with contextlib.suppress(OSError):
        state = _state(os.path.realpath(path))
        if time.time_ns() - max(state[1:3]) > _SETTLED_NS:
            return state
    return None


def _state_and_digest(path: str, known: list | None) -> list:
    """Returns the state of a file, and its digest.

    The state is what the file system says about the file. It is None if the
    file may change without a change of its state. `known` is an earlier result,
    and is returned if the state is still the same.
    """
    check_regular(Path(path))
    with user_errors(path):
        state = _state(path)
        if known is not None and known[0] == state:
            return known
        digest = hashlib.sha256()
        with open(path, "rb") as stream:
            while block := stream.read(_BLOCK_BYTES):
                digest.update(block)
        is_settled = (
            time.time_ns() - max(state[1:3]) > _SETTLED_NS
            and _state(path) == state
        )
    return [state if is_settled else None, digest.hexdigest()]


def _state(path: str) -> list[int]:
    """Returns the size, the times and the inode number of a file.

    A program can set back the time of the content's last change, but not the
    time of the inode's last change.
    """
    stat = os.stat(path)
    return [
        stat.st_size,
        stat.st_mtime_ns,
        stat.st_ctime_ns,
        stat.st_ino,
        stat.st_dev,
    ]
