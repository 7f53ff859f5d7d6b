"""The files of a model, and changes of one of them."""

import os
from pathlib import Path

import pytest

from cns_drake.scene import FileWatch, referenced_files

_MODEL = """<sdf version="1.9"><model name="m"><link name="l">
<visual name="v"><geometry><mesh><uri>a.obj</uri></mesh></geometry></visual>
<visual name="w"><geometry><mesh><uri>none.obj</uri></mesh></geometry></visual>
</link></model></sdf>"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "model.sdf"
    path.write_text(_MODEL)
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\n")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    (tmp_path / "a.png").write_bytes(b"12345")
    return path


def test_a_model_leads_to_what_its_meshes_name(model: Path) -> None:
    found = referenced_files(model, FileWatch())
    assert {name: size for name, (_, size) in found.items()} == {
        name: (model.parent / name).stat().st_size
        for name in ("a.obj", "a.mtl", "a.png")
    }


@pytest.mark.parametrize("name", ["model.sdf", "a.obj", "a.mtl", "a.png"])
def test_a_change_of_any_of_its_files_is_noticed(
    model: Path, name: str
) -> None:
    watch = FileWatch()
    referenced_files(model, watch)
    assert watch.changed() is None
    path = model.parent / name
    status = path.stat()
    # Other content of the same size, and a clock that stands still.
    path.write_bytes(path.read_bytes()[::-1])
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert watch.changed() == str(path)


def test_a_file_that_appears_or_goes_away_has_changed(model: Path) -> None:
    watch = FileWatch()
    referenced_files(model, watch)
    missing = model.parent / "none.obj"
    missing.write_text("v 0 0 0\n")
    assert watch.changed() == str(missing)
    missing.unlink()
    (model.parent / "a.png").unlink()
    assert watch.changed() == str(model.parent / "a.png")
