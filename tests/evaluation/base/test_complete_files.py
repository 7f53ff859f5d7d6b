"""Files and folders get their names when they are complete."""

import fcntl
import os
from pathlib import Path
import re
import stat
from threading import Thread

import pytest

from evaluation.base import (
    InputError,
    check_folder_writable,
    check_writable,
    complete_part,
    completing,
    draft_folder,
    part_path,
    write_part,
    write_text,
)


def test_part_lies_beside_the_file(tmp_path):
    assert part_path(tmp_path / "a.b.html") == tmp_path / "a.b.html.part"


def test_final_name_comes_with_completion_only(tmp_path):
    path = tmp_path / "page.html"
    write_part(path, "ä\n")
    assert not path.exists()
    complete_part(path)
    assert path.read_bytes() == b"\xc3\xa4\n"
    assert not part_path(path).exists()


def test_older_file_stays_until_completion(tmp_path):
    path = tmp_path / "page.html"
    path.write_text("old")
    write_part(path, "new")
    assert path.read_text() == "old"
    complete_part(path)
    assert path.read_text() == "new"


def test_full_disk_is_one_line(tmp_path):
    path = tmp_path / "page.html"
    part_path(path).symlink_to("/dev/full")
    with pytest.raises(InputError) as error:
        write_part(path, "text")
    assert str(error.value) == f"{path}.part: No space left on device"
    assert not path.exists()


def test_check_creates_the_folder_and_nothing_else(tmp_path):
    path = tmp_path / "new" / "page.html"
    check_writable(path)
    assert list(path.parent.iterdir()) == []


def test_check_leaves_an_existing_file_alone(tmp_path):
    path = tmp_path / "page.html"
    path.write_text("old")
    check_writable(path)
    assert path.read_text() == "old"


def test_check_refuses_what_cannot_be_written(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match=f"{file}: not a folder"):
        check_writable(file / "page.html")
    with pytest.raises(InputError, match="a folder has this name"):
        check_writable(tmp_path)


def test_only_plain_names_are_written(tmp_path, monkeypatch):
    """A link, a pipe, a folder of the name of a result stay as they are."""
    monkeypatch.chdir(tmp_path)
    mine = tmp_path / "mine"
    mine.write_text("mine")
    (tmp_path / "linked").symlink_to(mine)
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    for name, fault in (
        (".", "a folder"),
        ("linked", "a link"),
        ("loop", "a link"),
        ("pipe", "not a regular file"),
    ):
        with pytest.raises(InputError, match=rf"^{re.escape(name)}: {fault}"):
            write_text(Path(name), "text")
        with pytest.raises(InputError, match=fault):
            check_writable(tmp_path / name)
    assert mine.read_text() == "mine"
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_a_part_name_that_is_a_pipe_or_a_link_is_not_written_to(tmp_path):
    mine = tmp_path / "mine"
    mine.write_text("mine")
    part_path(tmp_path / "a").symlink_to(mine)
    os.mkfifo(part_path(tmp_path / "b"))
    for name in "ab":
        write_text(tmp_path / name, "text")
        assert (tmp_path / name).read_text() == "text"
    part_path(tmp_path / "c").symlink_to(mine)
    os.mkfifo(part_path(tmp_path / "d"))
    for name in "cd":
        write_part(tmp_path / name, "text")
        complete_part(tmp_path / name)
        assert (tmp_path / name).read_text() == "text"
    assert mine.read_text() == "mine"


def test_a_new_folder_takes_no_name_that_is_taken(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    (tmp_path / "empty").mkdir()
    (tmp_path / "linked").symlink_to("empty")
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    for name in (".", "full", "linked", "loop", "pipe"):
        with (
            pytest.raises(InputError, match=f"^{re.escape(name)}: exists"),
            draft_folder(Path(name)),
        ):
            raise AssertionError("begun")
    for name in ("empty", "new"):
        with draft_folder(Path(name)) as draft:
            assert draft.name == name
            (draft / "a").touch()
        assert (tmp_path / name / "a").exists()


def test_two_writers_of_one_folder(tmp_path):
    folder = tmp_path / "folder"
    with draft_folder(folder) as draft:
        (draft / "a").touch()
        with (
            pytest.raises(InputError, match=f"^{folder}: another process is"),
            draft_folder(folder),
        ):
            pytest.fail("begun")
        assert (draft / "a").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
    assert (folder / "a").exists()


def test_two_writers_of_one_file(tmp_path):
    path = tmp_path / "page.html"
    order = []

    def write() -> None:
        with completing(path) as part:
            order.append("second")
            part.write_text("second")

    with completing(path) as part:
        part.write_text("first")
        other = Thread(target=write)
        other.start()
        with (
            open(tmp_path / "page.html.part.lock") as lock,
            pytest.raises(BlockingIOError),
        ):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        order.append("first")
    other.join()
    assert order == ["first", "second"]
    assert path.read_text() == "second"
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_a_folder_is_checked_before_it_is_filled(tmp_path):
    folder = tmp_path / "a" / "b"
    check_folder_writable(folder)
    assert list(tmp_path.iterdir()) == []
    folder.mkdir(parents=True)
    (folder / "file").write_text("")
    check_folder_writable(folder)
    for wrong in (folder / "file", Path("/proc/cns-drake")):
        with pytest.raises(InputError, match=wrong.name):
            check_folder_writable(wrong)
