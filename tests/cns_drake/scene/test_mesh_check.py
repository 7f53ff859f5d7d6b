"""Meshes whose shapes would be misread, and what is not read of others."""

import json
import struct

from helpers.mesh_texts import gltf_text
from helpers.small_map import world_text
import pytest

from cns_drake.base.errors import InputError
from cns_drake.scene.mesh_files import check_gltf, unread_parts
from cns_drake.scene.world import load_world


def write(tmp_path, change, suffix=".gltf"):
    """Writes the prism with a change of the file's top."""
    top = json.loads(gltf_text()[0])
    change(top)
    text = json.dumps(top).encode()
    if suffix == ".glb":
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 20 + len(text))
        text = head + struct.pack("<I4s", len(text), b"JSON") + text
    path = tmp_path / f"thing{suffix}"
    path.write_bytes(text)
    return path


def extension(name, required=True):
    keys = ["extensionsUsed"] + ["extensionsRequired"] * required
    return lambda top: top.update({key: [name] for key in keys})


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
@pytest.mark.parametrize(
    ("name", "required"),
    [
        ("KHR_draco_mesh_compression", True),
        ("EXT_meshopt_compression", True),
        ("KHR_mesh_quantization", True),
        ("KHR_mesh_quantization", False),
        ("EXT_mesh_gpu_instancing", False),
        ("KHR_node_visibility", False),
        ("ACME_folded_space", True),
    ],
)
def test_extensions_that_change_shapes_are_refused(
    tmp_path, name, required, suffix
):
    path = write(tmp_path, extension(name, required), suffix)
    with pytest.raises(ValueError, match=f"needs the extension {name} of glTF"):
        check_gltf(path)


@pytest.mark.parametrize(
    ("name", "required"),
    [
        ("KHR_texture_transform", True),
        ("KHR_materials_unlit", True),
        ("KHR_texture_basisu", True),
        ("KHR_lights_punctual", True),
        # Shapes are there without it, too.
        ("KHR_draco_mesh_compression", False),
        ("ACME_folded_space", False),
    ],
)
def test_other_extensions_are_no_matter(tmp_path, name, required):
    assert check_gltf(write(tmp_path, extension(name, required))) == ()


def test_numbers_that_are_no_floats_are_refused(tmp_path):
    def change(top):
        top["accessors"][0] |= {"componentType": 5122, "normalized": True}

    with pytest.raises(ValueError, match="no floats"):
        check_gltf(write(tmp_path, change))


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (lambda top: top["nodes"][0].update(skin=0), "1 skins of"),
        (
            lambda top: top["meshes"][0].update(weights=[0, 0.5]),
            "1 weights of morph targets",
        ),
        (lambda top: top.update(animations=[{}, {}]), "2 animations of"),
        (
            lambda top: top["meshes"][0]["primitives"].append(
                {"attributes": {"POSITION": 0}, "mode": 0}
            ),
            "1 points or lines of",
        ),
        (
            lambda top: top.update(materials=[{"alphaMode": "BLEND"}]),
            "1 see-through materials of glTF taken as solid",
        ),
        (lambda top: top["scenes"].append({"nodes": []}), "1 further scenes"),
    ],
)
def test_what_is_not_read_is_named(tmp_path, change, note):
    path = write(tmp_path, change)
    mesh = "<geometry><mesh><uri>thing.gltf</uri></mesh></geometry>"
    sdf = tmp_path / "world.sdf"
    sdf.write_text(world_text([f'<visual name="thing">{mesh}</visual>']))
    (found,) = load_world(sdf).notes
    assert found.startswith(f"{path}: {note}")


@pytest.mark.parametrize(
    "text",
    [b"", b"[]", b"glTF", b'{"meshes": 1}', b'{"meshes": [{}]}', b"{", b"\xff"],
)
def test_files_that_are_no_gltf(tmp_path, text):
    path = tmp_path / "thing.gltf"
    path.write_bytes(text)
    with pytest.raises(ValueError, match=r"\w"):
        check_gltf(path)


def test_a_world_names_the_file_and_the_extension(tmp_path):
    path = write(tmp_path, extension("KHR_mesh_quantization"))
    mesh = "<geometry><mesh><uri>thing.gltf</uri></mesh></geometry>"
    sdf = tmp_path / "world.sdf"
    sdf.write_text(world_text([f'<visual name="thing">{mesh}</visual>']))
    with pytest.raises(InputError, match="KHR_mesh_quantization") as refusal:
        load_world(sdf)
    assert str(refusal.value).startswith(str(path))


@pytest.mark.parametrize(
    ("element", "note"),
    [
        ("<instance_controller url='#c'/>", "1 skins or morphs of COLLADA"),
        ("<animation/><animation/>", "2 animations of COLLADA"),
        ("<lines count='1'/><linestrips/>", "2 lines of COLLADA"),
        ("<instance_geometry url='#g'/>", None),
    ],
)
def test_what_is_not_read_of_collada_is_named(tmp_path, element, note):
    path = tmp_path / "thing.dae"
    path.write_text(f"<COLLADA>{element}</COLLADA>")
    expected = () if note is None else (f"{note} ignored",)
    assert unread_parts(path) == expected
