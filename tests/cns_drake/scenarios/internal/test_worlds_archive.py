"""The shipped worlds survive a wheel's archive unchanged."""

from concurrent.futures import ThreadPoolExecutor
import os

import pytest

from evaluation.base import InputError
from hatch_build import pack
from worlds.maps.shipped import unpacked

FILES = {"package.xml": "<package/>\n", "town/meshes/a.obj": "v 0 0 0\n"}


@pytest.fixture
def archive(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for name, text in FILES.items():
        path = tmp_path / "worlds" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    pack(tmp_path / "worlds", tmp_path / "worlds.tar.xz")
    return tmp_path / "worlds.tar.xz"


def test_files_come_out_as_they_went_in(archive):
    with ThreadPoolExecutor(4) as pool:
        folders = set(pool.map(unpacked, [archive] * 4))
    (folder,) = folders
    assert list(folder.parent.glob("*worlds*")) == [folder]
    assert contents(folder) == FILES


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "sizes.json"
    }


@pytest.mark.parametrize("name", [*FILES, "sizes.json"])
@pytest.mark.parametrize("is_cut", [True, False])
def test_what_is_missing_or_cut_off_is_unpacked_again(archive, name, is_cut):
    file = unpacked(archive) / name
    if is_cut:
        os.truncate(file, 3)
    else:
        file.unlink()
    assert contents(unpacked(archive)) == FILES


def test_a_folder_where_others_can_write_is_not_read(archive):
    unpacked(archive).chmod(0o777)
    with pytest.raises(InputError, match=r"others can write there"):
        unpacked(archive)


def test_older_releases_are_removed_and_nothing_else(archive, tmp_path):
    cache = tmp_path / "cache/cns-drake"
    old, used, other = (
        cache / name
        for name in (f"worlds-{'0' * 16}", f"worlds-{'1' * 16}", "worlds-mine")
    )
    for folder in (old, used, other):
        folder.mkdir(parents=True)
        (folder / "file").touch()
    for folder in (old, other):
        os.utime(folder, (1e9, 1e9))
    folder = unpacked(archive)
    assert {*cache.glob("worlds*")} == {used, other, folder}


def test_a_cache_that_cannot_be_written_is_named(archive, tmp_path):
    (tmp_path / "cache").write_text("a file, not a folder")
    with pytest.raises(InputError, match=r"worlds-.*XDG_CACHE_HOME"):
        unpacked(archive)
