"""Files and folders get their names when they are complete."""

import os
from pathlib import Path
import re
import stat
import subprocess
import sys

import pytest

from evaluation.base import (
    InputError,
    check_folder_writable,
    check_writable,
    completing,
    draft_folder,
    write_text,
)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_final_name_comes_with_completion_only(tmp_path):
    path = tmp_path / "page.html"
    path.write_text("old")
    with completing(path) as part:
        assert part.parent == tmp_path
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert names(tmp_path) == ["page.html"]


def test_an_error_leaves_nothing(tmp_path):
    for writer in (completing, draft_folder):
        with (
            pytest.raises(InputError, match="No space"),
            writer(tmp_path / "town"),
        ):
            raise OSError(28, "No space left on device")
    assert names(tmp_path) == []


def test_two_drafts_of_one_file_have_names_that_nobody_knows(tmp_path):
    found = set()
    for _ in range(100):
        with completing(tmp_path / "a") as part:
            found.add(part.name)
    assert len({name.split(".")[-2] for name in found}) == 100
    assert all(len(name.split(".")[-2]) == 32 for name in found)


@pytest.mark.parametrize("name", ["a" * 255, "é" * 127])
def test_the_longest_names_can_be_written(tmp_path, name):
    write_text(tmp_path / name, "text")
    assert (tmp_path / name).read_text() == "text"


def test_what_lies_beside_stays(tmp_path):
    """Names of unfinished downloads, locks and copies are the user's."""
    mine = {"town.part", "town.part.lock", "town.lock", ".town.part"}
    for name in mine:
        (tmp_path / name).mkdir()
        (tmp_path / name / "notes").write_text("mine")
    with draft_folder(tmp_path / "town") as draft:
        (draft / "a").touch()
    with completing(tmp_path / "town.txt") as part:
        part.touch()
    assert {*names(tmp_path)} == mine | {"town", "town.txt"}
    assert all((tmp_path / name / "notes").exists() for name in mine)


def killed_draft(folder, how):
    """Returns what a killed process left of a draft in a folder."""
    before = {*folder.iterdir()}
    code = (
        "import os, signal, sys\nfrom pathlib import Path\n"
        f"from evaluation.base import {how}\n"
        f"with {how}(Path(sys.argv[1])) as part:\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", code, folder / "town"], check=False)
    (left,) = {*folder.iterdir()} - before
    return left


@pytest.mark.slow
@pytest.mark.parametrize("how", ["completing", "draft_folder"])
def test_the_next_run_removes_what_a_killed_one_left(tmp_path, how):
    left = killed_draft(tmp_path, how)
    assert left.name.startswith(".town.")
    write_text(tmp_path / "other", "text")
    assert names(tmp_path) == ["other"]


@pytest.mark.slow
def test_only_what_a_killed_run_made_is_removed(tmp_path):
    """Something else may have got the name since."""
    left = killed_draft(tmp_path, "draft_folder")
    left.rename(tmp_path / "moved")
    left.mkdir()
    (left / "notes").write_text("mine")
    write_text(tmp_path / "other", "text")
    assert (left / "notes").read_text() == "mine"


def test_a_draft_that_was_exchanged_becomes_no_file(tmp_path):
    mine = tmp_path / "mine"
    mine.write_text("mine")

    def exchange():
        with completing(tmp_path / "a") as part:
            part.unlink()
            part.symlink_to(mine)

    with pytest.raises(InputError, match="something else took"):
        exchange()
    assert not (tmp_path / "a").exists()
    assert mine.read_text() == "mine"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives links away")
def test_links_of_others_in_a_shared_folder_are_not_followed(tmp_path):
    shared, mine = tmp_path / "shared", tmp_path / "mine"
    shared.mkdir()
    mine.mkdir()
    (shared / "out").symlink_to(mine)
    os.lchown(shared / "out", 12345, 12345)
    write_text(shared / "out" / "a", "not shared")
    shared.chmod(0o1777)
    with pytest.raises(InputError, match="a link of another user"):
        write_text(shared / "out" / "b", "text")
    with (
        pytest.raises(InputError, match="a link of another user"),
        draft_folder(shared / "out" / "c"),
    ):
        pytest.fail("begun")
    assert names(mine) == ["a"]


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


def test_of_two_writers_of_one_file_the_last_provides_it(tmp_path):
    path = tmp_path / "page.html"
    with completing(path) as first:
        first.write_text("first")
        write_text(path, "second")
        assert path.read_text() == "second"
    assert path.read_text() == "first"
    assert names(tmp_path) == ["page.html"]


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
