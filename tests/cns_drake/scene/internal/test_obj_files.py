"""Meshes are read once; a cache that is wrong in any way changes nothing."""

import errno

from helpers.mesh_texts import L_VERTICES, obj_text
import numpy as np
import pytest

from cns_drake.scene import obj_files
from cns_drake.scene.obj_files import ObjFiles

NUMBER = obj_files._FEWEST


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "cns-drake" / "meshes"


@pytest.fixture
def meshes(tmp_path):
    folder = tmp_path / "city"
    folder.mkdir()
    paths = [folder / f"{number}.obj" for number in range(NUMBER)]
    for number, path in enumerate(paths):
        # No number of a vertex is exact; some files have notes and marks.
        text = obj_text(L_VERTICES.astype(float) * (number + 1) / 7.0)
        text += "l 1 2\n" * (number % 3)
        mark = "\N{ZERO WIDTH NO-BREAK SPACE}" * (number % 2)
        path.write_text(mark + text, encoding="utf-8")
    return paths


def read(paths):
    """All that is known of meshes, as bytes and texts."""
    found = []
    with ObjFiles() as files:
        for path in paths:
            faces, surface = files.faces(path), files.surface(path)
            assert not any(array.flags.writeable for array in surface)
            arrays = [faces.box, *surface]
            kinds = [(one.dtype.str, one.shape) for one in arrays]
            content = [one.tobytes() for one in arrays]
            found.append((faces.notes, faces.num_triangles, kinds, content))
    return found


def refuse(*_):
    raise AssertionError("a file was read again")


def never_read(monkeypatch):
    monkeypatch.setattr(obj_files, "check_obj", refuse)
    monkeypatch.setattr(obj_files, "ReadObjToTriangleSurfaceMesh", refuse)


def test_second_reader_takes_the_bytes_of_the_first(cache, meshes, monkeypatch):
    first = read(meshes)
    never_read(monkeypatch)
    assert read(meshes) == first
    # What the file has does not depend on the files' order, or their names.
    assert read(meshes[::-1]) == first[::-1]
    meshes[0].rename(meshes[0].with_name("renamed.obj"))
    assert read([meshes[0].with_name("renamed.obj")]) == first[:1]


def test_changed_mesh_is_read_again(cache, meshes):
    first = read(meshes)
    meshes[3].write_text(meshes[5].read_text(encoding="utf-8"))
    meshes[4].write_text(obj_text(L_VERTICES + 1))
    again = read(meshes)
    assert again[3] == first[5]
    assert np.frombuffer(again[4][3][0])[:3].tolist() == [1.0, 1.0, 1.0]
    assert again[5:] == first[5:]


def test_mesh_that_changes_while_it_is_read(cache, meshes, monkeypatch):
    def change(path):
        path.write_text(obj_text(L_VERTICES + 1))
        return reader(path)

    reader = obj_files.ReadObjToTriangleSurfaceMesh
    monkeypatch.setattr(obj_files, "ReadObjToTriangleSurfaceMesh", change)
    with pytest.raises(ValueError, match="changed while it was being read"):
        ObjFiles().surface(meshes[0])


def test_what_is_checked_first_is_read_later(cache, meshes, monkeypatch):
    with ObjFiles() as files:
        for path in meshes:
            files.faces(path)
    monkeypatch.setattr(obj_files, "check_obj", refuse)
    first = read(meshes)
    never_read(monkeypatch)
    assert read(meshes) == first


def cut(share):
    return lambda content: content[: int(len(content) * share)]


def flipped(place):
    def flip(content):
        changed = bytearray(content)
        changed[place] ^= 1
        return bytes(changed)

    return flip


# A way in which the file of the cache is wrong -> what makes it so.
DAMAGE = {
    "empty": cut(0.0),
    "cut in the surfaces": cut(0.4),
    "cut in the index": cut(0.9),
    "a byte of a surface": flipped(1000),
    "a byte of the index": flipped(-100),
    "a byte of the trailer": flipped(-12),
    "another file": lambda content: b"v 0 0 0\n" * 1000,
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_cache_is_made_again(cache, meshes, damage, monkeypatch):
    first = read(meshes)
    (kept,) = cache.iterdir()
    whole = kept.read_bytes()
    kept.write_bytes(DAMAGE[damage](whole))
    assert read(meshes) == first
    if damage != "a byte of a surface":  # That mesh alone is read again.
        assert kept.read_bytes() == whole


def test_cache_of_others_is_not_read(cache, meshes):
    first = read(meshes)
    (kept,) = cache.iterdir()
    kept.write_bytes(b"")
    cache.chmod(0o777)
    assert read(meshes) == first
    assert kept.read_bytes() == b""


def test_cache_of_another_release_is_left_alone(cache, meshes, monkeypatch):
    first = read(meshes)
    monkeypatch.setattr(obj_files, "_FORM", obj_files._FORM + 1)
    assert read(meshes) == first
    assert len([*cache.iterdir()]) == 2


def test_full_disk_leaves_no_file(cache, meshes, monkeypatch):
    def fill(path, meshes):
        path.write_bytes(b"begun")
        raise OSError(errno.ENOSPC, "No space left on device")

    expected = read(meshes)
    (kept,) = cache.iterdir()
    kept.unlink()
    monkeypatch.setattr(obj_files, "_write", fill)
    assert read(meshes) == expected
    assert not [*cache.iterdir()]


def test_place_of_the_cache_is_taken(cache, meshes):
    first = read(meshes)
    (kept,) = cache.iterdir()
    kept.unlink()
    kept.mkdir()
    assert read(meshes) == first


def test_user_without_a_cache(meshes, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", "relative")
    assert read(meshes) == read(meshes)


def test_two_readers_at_once(cache, meshes, monkeypatch):
    with ObjFiles() as one, ObjFiles() as other:
        for path in meshes:
            np.testing.assert_array_equal(
                one.surface(path)[0], other.surface(path)[0]
            )
    never_read(monkeypatch)
    assert len(read(meshes)) == NUMBER


def test_too_large_cache_starts_anew(cache, meshes, monkeypatch):
    read(meshes)
    for path in meshes:
        path.write_text(path.read_text(encoding="utf-8") + "# new\n")
    (kept,) = cache.iterdir()
    size = kept.stat().st_size
    read(meshes)
    assert kept.stat().st_size > 1.9 * size
    for path in meshes:
        path.write_text(path.read_text(encoding="utf-8") + "# newer\n")
    monkeypatch.setattr(obj_files, "_LARGEST", size)
    read(meshes)
    assert kept.stat().st_size <= size


def test_few_meshes_are_not_kept(cache, meshes):
    read(meshes[: NUMBER // 2 - 1])
    assert not [*cache.iterdir()]
