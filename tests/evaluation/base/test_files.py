"""Files are checked, and read within a limit."""

import os

import pytest

from evaluation.base import (
    InputError,
    is_there,
    make_folder,
    read_bytes,
    user_errors,
)


def test_only_errors_of_the_file_system_are_turned(tmp_path):
    with (
        pytest.raises(InputError, match="x: Permission denied"),
        user_errors("x"),
    ):
        raise OSError(13, os.strerror(13))
    with pytest.raises(ValueError, match="other"), user_errors("x"):
        raise ValueError("other")


def test_only_files_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    for name, fault in (
        ("pipe", "not a regular file"),
        ("zero", "not a regular file"),
        (".", "Is a directory"),
        ("none", "No such file"),
    ):
        with pytest.raises(InputError, match=fault):
            read_bytes(tmp_path / name)


def test_a_file_where_a_folder_is_needed(tmp_path):
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(InputError, match=f"^{file}: not a folder$"):
        make_folder(file)


def test_a_file_that_may_be_missing(tmp_path):
    assert not is_there(tmp_path / "a")
    (tmp_path / "a").touch()
    assert is_there(tmp_path / "a")
    (tmp_path / "dead").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe")
    for name in (".", "dead", "pipe"):
        with pytest.raises(InputError):
            is_there(tmp_path / name)
