"""Meshes are the same at every place, and with a byte order mark."""

import base64
import json

from helpers.mesh_texts import (
    L_TRIANGLES,
    L_VERTICES,
    SKIN,
    collada_text,
    gltf_text,
    obj_text,
    ply_text,
    stl_text,
)
from helpers.mesh_worlds import read_mesh
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.base import InputError

FAR = np.array([350_000.0155, 4_020_000.12, 60.5])
# Turned by 37 deg about z, in the middle of the places of nodes.
TURN = Rotation.from_euler("z", 37, degrees=True)


def gltf_far(place):
    """Nodes within nodes; glTF's y is up, and its z is -y."""
    x, y, z = place
    u, v, w = TURN.inv().apply(place)
    half = np.deg2rad(37) / 2
    outer = {"translation": [x, z, -y], "children": [1]}
    outer["rotation"] = [0, np.sin(half), 0, np.cos(half)]
    return gltf_text([outer, {"translation": [u, w, -v], "mesh": 0}])[0]


def collada_far(place, skin=""):
    x, y, z = place
    return collada_text(
        L_VERTICES + TURN.inv().apply(place),
        f"<translate>{x} {y} {z}</translate><rotate>0 0 1 37</rotate>",
        skin,
    )


def skin_far(place):
    """A skin of a morph, which names the mesh."""
    skin = SKIN.format("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1")
    morph = '<controller id="m"><morph source="#g"/></controller><controller'
    skin = skin.replace("#g", "#m").replace("<controller", morph)
    return collada_far(place, skin)


# Name of a file -> its text with the mesh at a place, how often it is moved to
# this place, and whether it is turned.
KINDS = {
    "a.obj": (lambda place: obj_text(L_VERTICES + place), 1, False),
    "a.ply": (lambda place: ply_text(L_VERTICES + place, "double"), 1, False),
    "a.stl": (lambda place: stl_text(L_VERTICES + place), 1, False),
    "a.gltf": (gltf_far, 2, True),
    "a.dae": (collada_far, 2, True),
    "skin.dae": (skin_far, 2, True),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_a_mesh_is_the_same_in_survey_coordinates(tmp_path, name, capsys):
    text, times, is_turned = KINDS[name]
    path = tmp_path / name
    path.write_text(text(FAR))
    surface = read_mesh(path)
    local = L_VERTICES
    if name == "a.gltf":  # Its y is up.
        local = np.stack([local[:, 0], -local[:, 2], local[:, 1]], axis=1)
    if is_turned:
        local = TURN.apply(local)
    expected = local[L_TRIANGLES].mean(axis=1) + times * FAR
    found = surface.p_GVset[surface.triangles].mean(axis=1)
    order, other = (np.lexsort(one.round(3).T) for one in (expected, found))
    np.testing.assert_allclose(found[other], expected[order], rtol=0, atol=2e-6)
    assert "coarse" not in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_a_byte_order_mark_changes_no_mesh(tmp_path, name):
    path = tmp_path / name
    text = KINDS[name][0](np.zeros(3))
    path.write_text(text)
    plain = read_mesh(path)
    path.write_text("\ufeff" + text)
    marked = read_mesh(path)
    np.testing.assert_array_equal(marked.p_GVset, plain.p_GVset)
    np.testing.assert_array_equal(marked.triangles, plain.triangles)


def single(name):
    """A file whose own numbers are too coarse, far from the origin."""
    if name == "a.ply":
        return ply_text((L_VERTICES + FAR).astype("f4")).encode()
    head = b" " * 80 + len(L_TRIANGLES).to_bytes(4, "little")
    facets = np.zeros(
        len(L_TRIANGLES), [("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")]
    )
    facets["p"] = (L_VERTICES + FAR)[L_TRIANGLES]
    return head + facets.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.ply", "a.stl"])
def test_coarse_coordinates_of_a_file_are_told(tmp_path, name, capsys):
    path = tmp_path / name
    path.write_bytes(single(name))
    read_mesh(path)
    said = "steps of 0.25 m; export it again with vertices near the origin"
    assert said in capsys.readouterr().err
    path.write_text(KINDS[name][0](np.zeros(3)))
    read_mesh(path)
    assert "coarse" not in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["", ";charset=utf-8", ";base64"])
def test_buffers_are_any_address_of_data(tmp_path, kind):
    _, data = gltf_text()
    text = "".join(f"%{byte:02x}" for byte in data)
    if kind == ";base64":  # Its letters may be escaped, and its end missing.
        text = base64.b64encode(data).decode().rstrip("=").replace("/", "%2F")
    path = tmp_path / "a.gltf"
    path.write_text(
        gltf_text(uri=f"data:application/gltf-buffer{kind},{text}")[0]
    )
    found = read_mesh(path)
    assert len(found.triangles) == len(L_TRIANGLES)
    np.testing.assert_allclose(np.ptp(found.p_GVset, axis=0), (2, 1.5, 2))


def test_data_that_are_no_base64_are_refused(tmp_path):
    top = json.loads(gltf_text()[0])
    top["buffers"][0]["uri"] = "data:;base64,a"
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(top))
    with pytest.raises(InputError, match="its buffer data: is no base64"):
        read_mesh(path)
