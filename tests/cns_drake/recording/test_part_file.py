"""Files that are written again from their start."""

import os

import pytest

from cns_drake.base.errors import InputError
from cns_drake.recording.part_file import PartFile


def written(path, *pieces, finish=True):
    file = PartFile(path)
    for piece in pieces:
        file.write(piece)
    if finish:
        file.finish()
    file.close()
    return path.read_bytes()


@pytest.mark.parametrize(
    "before",
    [
        b"",
        b"ab",
        b"abcdef",
        b"abcdefgh",
        b"abcdefgh and more",
        b"abcdeXgh",
        b"Xbcdefgh",
    ],
)
def test_the_result_is_that_of_an_empty_file(tmp_path, before):
    path = tmp_path / "file.part"
    path.write_bytes(before)
    assert written(path, b"abc", b"", b"def", b"gh") == b"abcdefgh"


def test_equal_bytes_keep_what_follows(tmp_path):
    path = tmp_path / "file.part"
    path.write_bytes(b"abcdefgh")
    assert written(path, b"abc", finish=False) == b"abcdefgh"
    assert written(path, b"abc", b"dXY", finish=False) == b"abcdXY"


def test_whether_anything_new_was_written(tmp_path):
    path = tmp_path / "file.part"
    path.write_bytes(b"abc")
    file = PartFile(path)
    assert file.replaying
    file.write(b"ab")
    assert file.replaying
    assert file.tell() == 2
    file.write(b"x")
    assert not file.replaying
    assert file.tell() == 3
    file.close()
    assert not PartFile(tmp_path / "new.part").replaying


def test_how_a_file_starts(tmp_path):
    path = tmp_path / "file.part"
    path.write_bytes(b"abc")
    file = PartFile(path)
    assert file.starts_like(b"ab")
    assert file.starts_like(b"abcd")  # It may have been cut off.
    assert not file.starts_like(b"x")
    assert not file.starts_like(b"abd")
    file.write(b"abc")
    file.clear()
    file.write(b"d")
    file.finish()
    file.close()
    assert path.read_bytes() == b"d"


def test_one_writer_at_a_time(tmp_path):
    path = tmp_path / "file.part"
    file = PartFile(path)
    with pytest.raises(InputError, match=r"file\.part: another process is"):
        PartFile(path)
    file.close()
    PartFile(path).close()


def test_a_file_that_gets_its_final_name_meanwhile(tmp_path, monkeypatch):
    path = tmp_path / "file.part"
    path.write_bytes(b"abc")
    os_open = os.open

    def open_late(*arguments):
        descriptor = os_open(*arguments)
        path.rename(tmp_path / "file")
        path.write_bytes(b"of another")
        return descriptor

    monkeypatch.setattr(os, "open", open_late)
    with pytest.raises(InputError, match=r"file\.part: another process has"):
        PartFile(path)
    assert (tmp_path / "file").read_bytes() == b"abc"
