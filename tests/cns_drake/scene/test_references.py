"""References of worlds and meshes to other files, in all their spellings."""

import json

from helpers.mesh_texts import obj_text
import numpy as np
import pytest

from cns_drake.scene import load_world, read_perception_geometry, structures_in
from evaluation.base import InputError

VISUAL = "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry>"
LINK = f"<link name='l'>{VISUAL}</visual></link>"
MESH = (
    "<model name='m'><link name='l'><visual name='v'><geometry><mesh><uri>{}"
    "</uri></mesh></geometry></visual></link></model>"
)


def model(name):
    return f"<sdf version='1.9'><model name='{name}'>{LINK}</model></sdf>"


def world(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"<sdf version='1.9'><world name='w'>{text}</world></sdf>")
    return path


@pytest.mark.parametrize(
    ("uri", "name"),
    [
        ("https://fuel.gazebosim.org/1.0/Some One/models/Big Crate", "v10"),
        ("https://fuel.gazebosim.org/1.0/some%20one/models/Big%20Crate", "v10"),
        ("https://fuel.gazebosim.org/1.0/Some One/models/Big Crate/2", "v2"),
        ("https://fuel.gazebosim.org/1.0/Some One/models/Big Crate/tip", "v10"),
    ],
)
def test_models_of_fuel_come_from_its_cache(tmp_path, monkeypatch, uri, name):
    monkeypatch.setenv("GZ_FUEL_CACHE_PATH", str(tmp_path))
    folder = tmp_path / "fuel.gazebosim.org/some one/models/big crate"
    for number in ("2", "10"):
        (folder / number).mkdir(parents=True)
        (folder / number / "model.sdf").write_text(model(f"v{number}"))
    path = world(
        tmp_path / "w" / "w.sdf", f"<include><uri>{uri}</uri></include>"
    )
    assert structures_in(load_world(path)) == {name}


@pytest.mark.parametrize(
    "uri", ["model://a%20b", "model://a b", "a%20b", "a b"]
)
def test_percent_escapes_are_decoded(tmp_path, uri):
    (tmp_path / "a b").mkdir()
    (tmp_path / "a b" / "model.sdf").write_text(model("crate"))
    path = world(tmp_path / "w.sdf", f"<include><uri>{uri}</uri></include>")
    assert structures_in(load_world(path)) == {"crate"}


def test_a_name_is_taken_as_written_before_it_is_decoded(tmp_path):
    for name in ("a%20b", "a b"):
        (tmp_path / name).mkdir()
        kind = "written" if "%" in name else "decoded"
        (tmp_path / name / "model.sdf").write_text(model(kind))
    text = "<include><uri>model://a%20b</uri></include>"
    path = world(tmp_path / "w.sdf", text)
    assert structures_in(load_world(path)) == {"written"}


def test_a_folder_without_a_model_is_a_missing_model(tmp_path):
    (tmp_path / "models" / "empty").mkdir(parents=True)
    path = world(
        tmp_path / "w.sdf",
        f"<model name='m'>{LINK}</model>"
        "<include><uri>model://empty</uri></include>",
    )
    (note,) = load_world(path).notes
    assert "1 models not found, and left out: model://empty" in note


def test_the_highest_version_of_a_model_is_read(tmp_path):
    folder = tmp_path / "models" / "crate"
    folder.mkdir(parents=True)
    (folder / "model.config").write_text(
        "<model><sdf version='1.9'>a.sdf</sdf>"
        "<sdf version='1.10'>b.sdf</sdf></model>"
    )
    for name in "ab":
        (folder / f"{name}.sdf").write_text(model(name))
    text = "<include><uri>model://crate</uri></include>"
    assert structures_in(load_world(world(tmp_path / "w.sdf", text))) == {"b"}


def test_a_reference_that_is_too_long_for_a_name_is_not_found(tmp_path):
    name = "data:model/stl;base64," + "A" * 5000
    path = world(tmp_path / "w.sdf", MESH.format(name))
    with pytest.raises(InputError, match="1 meshes not found"):
        load_world(path)


def test_a_buffer_of_gltf_that_is_missing_is_named(tmp_path):
    top = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "gone%20away.bin", "byteLength": 12}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(top))
    path = world(tmp_path / "w.sdf", MESH.format("a.gltf"))
    loaded = load_world(path)
    with pytest.raises(InputError, match=r"buffer gone%20away\.bin does not"):
        read_perception_geometry(loaded.scene_graph.model_inspector())


@pytest.mark.parametrize(
    ("more", "is_read"),
    [
        ("", True),
        (" 1", True),
        (" 1.0", True),
        (" 0.5 0.2 0.1", True),
        (" 2", False),
        (" 1 0", False),
        (" 1 0 0 1", False),
    ],
)
def test_vertices_of_obj_have_a_weight_of_one_or_a_colour(
    tmp_path, more, is_read
):
    lines = obj_text().splitlines()
    text = "\n".join(
        line + more if line.startswith("v ") else line for line in lines
    )
    (tmp_path / "a.obj").write_text(text + "\n")
    path = world(tmp_path / "w.sdf", MESH.format("a.obj"))
    if is_read:
        inspector = load_world(path).scene_graph.model_inspector()
        (one,) = read_perception_geometry(inspector)
        assert np.isfinite(one.surface.p_GVset).all()
    else:
        with pytest.raises(InputError, match=r"a\.obj: line 1: a vertex that"):
            load_world(path)
