"""The files in the folder of a map."""

import os

import pytest

from evaluation.base import InputError
from worlds.maps import MapFolder, drive_name


def test_existing_files(tmp_path):
    folder = MapFolder(tmp_path / "town")
    folder.path.mkdir()
    assert folder.name == "town"
    assert (folder.stages(), folder.drives()) == ({}, [])
    for name in ("10", "02", "9", "new"):
        folder.stage(name).touch()
    for number in ("10", "9", "03"):
        folder.drive(number).touch()
    (folder.path / "stage_01.yaml").touch()
    folder.other_drive("02").touch()
    stages = folder.stages()
    assert list(stages) == ["02", "9", "10", "new"]
    assert stages["10"] == folder.path / "stage_10.sdf"
    drives = [folder.drive(number) for number in ("03", "9", "10")]
    assert folder.drives() == drives
    assert folder.recordable_drives() == drives[1:]
    assert folder.other_drives() == [folder.path / "other_02.yaml"]


def test_what_editors_leave_is_no_file_of_a_map(tmp_path):
    folder = MapFolder(tmp_path)
    for name in (".git", "old.d", "meshes"):
        (tmp_path / name).mkdir()
    (tmp_path / ".#stage_01.sdf").symlink_to("me@host.1:2")
    (tmp_path / "dead.sdf").symlink_to("nowhere")
    for name in ("stage_01.sdf", "roads.yaml", "README"):
        (tmp_path / name).touch()
    assert [p.name for p in folder.files()] == ["roads.yaml", "stage_01.sdf"]
    os.mkfifo(tmp_path / "x.y")
    with pytest.raises(InputError, match=r"x\.y: not a regular file"):
        folder.files()


def test_names_of_drives(tmp_path):
    folder = MapFolder(tmp_path / "town")
    assert drive_name(folder.drive("04")) == "town_04"
    assert drive_name(folder.other_drive("04")) == "town_other_04"
    assert drive_name(folder.path / "my_drive.yaml") == "my_drive"
