"""The shipped worlds survive a wheel's archive unchanged."""

from concurrent.futures import ThreadPoolExecutor

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
    assert list(folder.parent.iterdir()) == [folder]
    assert {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob("*")
        if path.is_file()
    } == FILES


def test_a_cache_that_cannot_be_written_is_named(archive, tmp_path):
    (tmp_path / "cache").write_text("a file, not a folder")
    with pytest.raises(InputError, match=r"worlds-.*XDG_CACHE_HOME"):
        unpacked(archive)
