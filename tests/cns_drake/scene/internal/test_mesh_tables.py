"""Meshes are read as the tables of docs/formats.md say, element by element."""

import copy
import json
from pathlib import Path
import re

from helpers.mesh_texts import (
    L_TRIANGLES,
    L_VERTICES,
    SKIN,
    collada_text,
    gltf_text,
    obj_text,
)
from helpers.mesh_worlds import notes_of
import numpy as np
from pydrake.geometry import Mesh
import pytest

from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.mesh_files import MeshFiles
from cns_drake.scene.obj_files import ObjFiles
from evaluation.base import InputError

PAGE = Path(__file__).parents[4] / "docs" / "formats.md"


@pytest.fixture(scope="module")
def files():
    with ForeignMeshes() as foreign:
        yield MeshFiles(foreign, ObjFiles())


def obj_with(tag):
    """The prism with a statement of OBJ."""
    more = {
        "p": "p 1",
        "l": "l 1 2",
        "vt": "vt 0 0",
        "vn": "vn 0 0 1",
        "fo": "fo 1 2 3",
        "call": "call a.obj",
    }
    return obj_text() + more.get(tag, f"{tag} a") + "\n"


# Part of glTF -> a change of the prism that adds it.
GLTF = {
    "sparse": lambda top: top["accessors"][0].update(
        sparse={
            "count": 1,
            "indices": {"bufferView": 2, "componentType": 5125},
            "values": {"bufferView": 3},
        }
    ),
    "matrix": lambda top: top["nodes"][0].update(
        matrix=np.eye(4).ravel().tolist()
    ),
    "translation": lambda top: top["nodes"][0].update(translation=[0, 0, 0]),
    "rotation": lambda top: top["nodes"][0].update(rotation=[0, 0, 0, 1]),
    "scale": lambda top: top["nodes"][0].update(scale=[1, 1, 1]),
    "skins": lambda top: top["nodes"][0].update(skin=0),
    "weights": lambda top: top["meshes"][0].update(weights=[0.5]),
    "animations": lambda top: top.update(animations=[{}]),
    "alphaMode": lambda top: top.update(materials=[{"alphaMode": "BLEND"}]),
    "materials": lambda top: top.update(materials=[{}]),
    "doubleSided": lambda top: top.update(materials=[{"doubleSided": True}]),
    "textures": lambda top: top.update(textures=[{}]),
    "images": lambda top: top.update(images=[{"uri": "a.png"}]),
    "samplers": lambda top: top.update(samplers=[{}]),
    "cameras": lambda top: top.update(
        cameras=[
            {
                "type": "perspective",
                "perspective": {"yfov": 1.0, "znear": 0.1},
            }
        ]
    ),
    "targets": lambda top: top["meshes"][0]["primitives"][0].update(
        targets=[{"POSITION": 0}]
    ),
    "extras": lambda top: top["nodes"][0].update(extras={"a": 1}),
    "KHR_draco_mesh_compression": lambda top: top.update(
        extensionsRequired=["KHR_draco_mesh_compression"]
    ),
    "EXT_meshopt_compression": lambda top: top.update(
        extensionsRequired=["EXT_meshopt_compression"]
    ),
}


def gltf_with(tag):
    top = json.loads(gltf_text()[0])
    # The first vertex, once more, as values of a sparse accessor.
    top["bufferViews"] += [
        {"buffer": 1, "byteOffset": 0, "byteLength": 4},
        {"buffer": 0, "byteOffset": 0, "byteLength": 12},
    ]
    zero = "data:application/octet-stream;base64,AAAAAA=="
    top["buffers"].append({"byteLength": 4, "uri": zero})
    if tag in GLTF:
        GLTF[tag](top)
    elif tag.startswith(("KHR_", "EXT_")):
        top["nodes"][0]["extensions"] = {tag: {}}
    return json.dumps(top)


INPUT = "<input semantic='VERTEX' source='#v' offset='0'/>"
CORNERS = " ".join(map(str, L_TRIANGLES.ravel()))
NUMBER = len(L_TRIANGLES)
# Element of COLLADA -> the same triangles by other means.
PRIMITIVES = {
    "polylist": f"<polylist count='{NUMBER}'>{INPUT}<vcount>"
    f"{'3 ' * NUMBER}</vcount><p>{CORNERS}</p></polylist>",
    "polygons": f"<polygons count='{NUMBER}'>{INPUT}"
    + "".join("<p>{} {} {}</p>".format(*t) for t in L_TRIANGLES)
    + "</polygons>",
    **{
        tag: "".join(
            f"<{tag} count='1'>{INPUT}<p>{a} {b} {c}</p></{tag}>"
            for a, b, c in L_TRIANGLES
        )
        for tag in ("tristrips", "trifans")
    },
}
IN_NODE = {
    "matrix": "<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>",
    "translate": "<translate>0 0 0</translate>",
    "rotate": "<rotate>0 0 1 0</rotate>",
    "scale": "<scale>1 1 1</scale>",
    "skew": "<skew>45 0 1 0 1 0 0</skew>",
    "lookat": "<lookat>1 2 3 0 0 0 0 0 1</lookat>",
    "instance_camera": "<instance_camera url='#c'/>",
    "instance_light": "<instance_light url='#c'/>",
    "extra": "<extra><technique profile='X'><mesh/></technique></extra>",
}


def collada_with(tag):
    text = collada_text()
    show = '<instance_geometry url="#g"/>'
    # What is put before an element, or in its place.
    before = {}
    if tag in PRIMITIVES:
        return re.sub(
            "<triangles.*</triangles>", PRIMITIVES[tag], text, flags=re.DOTALL
        )
    if tag in ("instance_controller", "bind_shape_matrix"):
        eye = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
        return collada_text(
            skin=SKIN.format(eye if tag[0] == "i" else eye.replace("1", "2"))
        )
    if tag == "instance_node":
        library = f"<library_nodes><node id='k'>{show}</node></library_nodes>"
        text = text.replace(show, "<instance_node url='#k'/>")
        before["<library_visual_scenes>"] = library
    elif tag == "bind_material":
        bound = "<bind_material><technique_common/></bind_material>"
        text = text.replace(show, f"{show[:-2]}>{bound}</instance_geometry>")
    elif tag in IN_NODE:
        before[show] = IN_NODE[tag]
    elif tag in ("lines", "linestrips"):
        before["</mesh>"] = f"<{tag} count='1'>{INPUT}<p>0 1</p></{tag}>"
    elif tag == "ph":
        before["</mesh>"] = f"<polygons count='1'>{INPUT}<ph/></polygons>"
    elif tag in ("brep", "convex_mesh", "spline"):
        geometry = f"<geometry id='h'><{tag}/></geometry>"
        before["</library_geometries>"] = geometry
    elif tag == "animation":
        library = "<library_animations><animation/></library_animations>"
        before["<library_geometries>"] = library
    elif tag.startswith("library_"):
        before["<library_geometries>"] = f"<{tag}/>"
    elif tag == "contributor":
        before["<unit"] = "<contributor/>"
    for place, more in before.items():
        text = text.replace(place, more + place)
    return text


def ply_with(tag):
    more = {
        "red": "property uchar red\n",
        "nx": "property float nx\n",
    }.get(tag, "")
    corners = "vertex_index" if tag == "vertex_index" else "vertex_indices"
    kind = tag if tag.startswith("binary_") else "ascii"
    order = ">" if tag == "binary_big_endian" else "<"
    behind = {
        "edge": "element edge 1\nproperty int vertex1\nproperty int vertex2\n",
        "material": "element material 1\nproperty int a\nproperty int b\n",
        "camera": "element camera 1\nproperty int a\nproperty int b\n",
        "tristrips": "element tristrips 1\nproperty list int int"
        " vertex_indices\n",
    }.get(tag, "")
    texcoord = tag == "texcoord"
    face_more = "property list uchar float texcoord\n" if texcoord else ""
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex 12\nproperty float x\n"
        f"property float y\nproperty float z\n{more}element face {NUMBER}\n"
        f"property list uchar int {corners}\n{face_more}{behind}end_header\n"
    ).encode()
    if kind != "ascii":
        faces = np.zeros(NUMBER, [("n", "u1"), ("t", f"{order}i4", 3)])
        faces["n"], faces["t"] = 3, L_TRIANGLES
        return (
            head + L_VERTICES.astype(f"{order}f4").tobytes() + (faces.tobytes())
        )
    rows = [
        " ".join(map(str, row)) + (" 1" if more else "") for row in L_VERTICES
    ]
    rows += [
        "3 " + " ".join(map(str, t)) + (" 2 0 0" if texcoord else "")
        for t in L_TRIANGLES
    ]
    if behind:
        rows.append("3 0 1 2" if tag == "tristrips" else "0 1")
    return head + ("\n".join(rows) + "\n").encode()


def stl_with(tag):
    del tag  # All of them are in each file.
    facets = [
        "facet normal 0 0 1\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*p) for p in L_VERTICES[t])
        + "endloop\nendfacet\n"
        for t in L_TRIANGLES
    ]
    return (
        f"solid a\n{''.join(facets[:5])}endsolid a\n"
        f"solid b\n{''.join(facets[5:])}endsolid b\n"
    )


FORMATS = {
    "OBJ": ("a.obj", obj_with),
    "glTF": ("a.gltf", gltf_with),
    "COLLADA": ("a.dae", collada_with),
    "PLY": ("a.ply", ply_with),
    "STL": ("a.stl", stl_with),
}
# Statements that show something else than the prism, or are in each file.
OTHERWISE = {("OBJ", "v"), ("OBJ", "f")}


def rows():
    """Format, how it is treated, and tag of each element in the tables."""
    text = PAGE.read_text("utf-8")
    for name in FORMATS:
        table = re.search(rf"\| \| elements of {name} .*\n((?:\|.*\n)+)", text)
        for row in table[1].splitlines()[1:]:
            _, treated, what, _ = row.split("|")
            for tag in re.findall(r"`([\w:]+)`", what):
                if (name, tag) not in OTHERWISE:
                    yield name, treated.strip(), tag


def sorted_triangles(corners):
    """Triangles, each from its least corner on, in order: (N, 9)."""
    found = []
    for one in np.asarray(corners, float).reshape(-1, 3, 3).round(5) + 0.0:
        first = min(range(3), key=lambda k: tuple(one[k]))
        found.append(tuple(np.roll(one, -first, axis=0).ravel()))
    return sorted(found)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "treated", "tag"), list(rows()))
def test_elements_are_treated_as_the_tables_say(
    tmp_path, files, name, treated, tag
):
    file, make = FORMATS[name]
    path = tmp_path / file
    content = make(tag)
    path.write_bytes(
        content if isinstance(content, bytes) else content.encode()
    )
    shape = Mesh(str(path))
    if treated == "refused":
        with pytest.raises(InputError, match=re.escape(tag)) as error:
            files.read("g", shape)
        assert "\n" not in str(error.value)
        return
    notes = notes_of(path)
    assert bool(notes) == (treated == "noted"), notes
    if tag == "skins":
        return  # Open3D needs a whole skin.
    surface = files.read("g", shape)
    expected = copy.copy(L_VERTICES)
    if name == "glTF":
        expected = np.stack(
            [expected[:, 0], -expected[:, 2], expected[:, 1]], axis=1
        )
    assert sorted_triangles(
        surface.p_GVset[surface.triangles]
    ) == sorted_triangles(expected[L_TRIANGLES])
