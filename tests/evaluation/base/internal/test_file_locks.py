"""Locks that are no plain files are refused."""

import fcntl
import os

import pytest

from evaluation.base import InputError
from evaluation.base.file_locks import exclusive


def test_a_lock_that_is_a_link_a_pipe_or_a_text_is_refused(tmp_path):
    mine = tmp_path / "mine"
    mine.write_text("mine")
    (tmp_path / "a.lock").symlink_to(mine)
    os.mkfifo(tmp_path / "b.lock")
    (tmp_path / "c.lock").write_text("mine")
    for name in "abc":
        with (
            pytest.raises(InputError, match=rf"{name}\.lock: "),
            exclusive(tmp_path / name, lambda: None),
        ):
            raise AssertionError("locked")
    assert mine.read_text() == (tmp_path / "c.lock").read_text() == "mine"


def test_nobody_can_take_a_lock_in_a_shared_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    (shared / "out.lock").write_text("of somebody else")
    with exclusive(shared / "out", lambda: None):
        assert [one.name for one in shared.iterdir()] == ["out.lock"]
        (lock,) = (tmp_path / "cache").rglob("*.lock")
        with lock.open() as stream, pytest.raises(BlockingIOError):
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    assert not lock.exists()
