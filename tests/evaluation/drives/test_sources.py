"""Sources of recordings, which are identified by their files."""

import os
import shutil

from helpers.small_towns import drive
import pytest

from evaluation.base import InputError
from evaluation.drives import RecordingSource

pytestmark = pytest.mark.slow


def test_a_recording_is_identified_by_its_files(tmp_path):
    folder = tmp_path / "metropolis_01"
    drive(folder, "01", "a")
    first = RecordingSource(folder).identity()
    assert RecordingSource(folder).identity() == first
    # Also by a link, under whose name it is in tables.
    (tmp_path / "links").mkdir()
    link = tmp_path / "links/metropolis_01"
    link.symlink_to(folder)
    assert RecordingSource(link).identity() == first
    other = tmp_path / "other_name"
    other.symlink_to(folder)
    assert RecordingSource(other).identity() != first
    (path,) = folder.glob("*.mcap")
    content = path.read_bytes()
    path.unlink()
    drive(tmp_path / "other" / "metropolis_01", "02", "a")
    (other,) = (tmp_path / "other").rglob("*.mcap")
    other.rename(path)
    assert RecordingSource(folder).identity() != first
    path.write_bytes(content)
    assert RecordingSource(folder).identity() == first
    with pytest.raises(InputError, match=r"none: no such file"):
        RecordingSource(tmp_path / "none").identity()


def test_a_copy_of_a_recording_is_the_same(tmp_path):
    folder = tmp_path / "metropolis_01"
    drive(folder, "01", "a")
    (path,) = folder.glob("*.mcap")
    identities = [RecordingSource(one).identity() for one in (folder, path)]
    copy = tmp_path / "copy" / "metropolis_01"
    shutil.copytree(folder, copy)
    os.utime(copy / path.name, ns=(1, 1))
    assert RecordingSource(copy).identity() == identities[0]
    assert RecordingSource(copy / path.name).identity() == identities[1]
