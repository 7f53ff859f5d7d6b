"""Digests of files: read again when a file has changed, and only then."""

import hashlib
import io
import os

from evaluation.base import digests
from evaluation.base.digests import file_digests


def test_digests_are_kept_until_a_file_changes(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "scan.bin"
    opened = []

    def check(content, *, is_read=True):
        opened.clear()
        expected = [hashlib.sha256(content).hexdigest()]
        assert file_digests([path]) == expected
        assert opened == [str(path)] * is_read

    monkeypatch.setattr(
        digests,
        "open",
        lambda file, _: opened.append(file) or io.FileIO(file),
        raising=False,
    )
    path.write_bytes(b"points")
    # A file that was just written is read each time.
    check(b"points")
    check(b"points")
    monkeypatch.setattr("time.time_ns", lambda: path.stat().st_ctime_ns + 3e9)
    check(b"points")
    check(b"points", is_read=False)
    # The time of the content can be set back, that of the inode cannot.
    stat = path.stat()
    path.write_bytes(b"pointz")
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    check(b"pointz")
    # A damaged cache, or none, costs time only.
    (kept,) = (tmp_path / "cache").rglob("digests/*.json")
    for damage in ("", '{"a": 1}', "[]", f'{{"{path}": [[1], 2]}}'):
        kept.write_text(damage)
        check(b"pointz")
    # Others could have written there.
    check(b"pointz", is_read=False)
    kept.parent.chmod(0o777)
    check(b"pointz")
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    check(b"pointz")
