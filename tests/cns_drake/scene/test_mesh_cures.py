"""What a message about a mesh tells you to do is enough to read the mesh."""

import json

from helpers.mesh_texts import (
    L_TRIANGLES,
    collada_text,
    gltf_text,
    obj_text,
    ply_text,
    stl_text,
)
from helpers.mesh_worlds import read_mesh
import pytest

from evaluation.base import InputError

GLTF = gltf_text()[0]


def gltf(**more):
    return json.dumps({**json.loads(GLTF), **more})


def shorts():
    top = json.loads(GLTF)
    top["accessors"][0] |= {"componentType": 5122, "normalized": True}
    return json.dumps(top)


def swapped():
    return (
        ply_text().replace("float x", "float u").replace("float y", "float x")
    )


# Message -> name of a file, its text, and the file that the message asks for.
REFUSED = [
    ("export it without", "a.gltf", gltf(extensionsRequired=["ACME"]), GLTF),
    ("export it without", "a.gltf", shorts(), GLTF),
    (
        "write it in one line",
        "a.obj",
        obj_text().replace("f 3 2 1", "f 3 2 \\\n1"),
        obj_text(),
    ),
    (
        "export it with faces",
        "a.obj",
        obj_text() + "cstype bezier\n",
        obj_text(),
    ),
    ("export it again", "a.ply", swapped(), ply_text()),
    (
        "export it again",
        "a.ply",
        ply_text().replace("vertex_indices", "corners"),
        ply_text(),
    ),
    (
        "export it once",
        "a.ply",
        ply_text().replace(
            "end_header",
            "element face 0\nproperty list uchar int x\nend_header",
        ),
        ply_text(),
    ),
    (
        "export it with faces",
        "a.ply",
        ply_text().replace(
            "end_header",
            "element tristrips 1\nproperty list int int vertex_indices\n"
            "end_header",
        )
        + "3 0 1 2\n",
        ply_text(),
    ),
    (
        "export it with valid triangles",
        "a.obj",
        # A square with a hole and its outline in one polygon.
        "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nv 0 0 0\nv 1 1 0\nv 1 2 0\n"
        "v 2 2 0\nv 2 1 0\nv 1 1 0\nf 1 2 3 4 5 6 7 8 9 10\n",
        obj_text(),
    ),
    (
        "export it with triangles and matrices",
        "a.dae",
        collada_text(place="<lookat>0 0 0 1 0 0 0 0 1</lookat>"),
        collada_text(place="<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"),
    ),
    (
        r"or as glTF",
        "a.dae",
        collada_text().replace("<mesh>", "<convex_mesh/><mesh>"),
        (".gltf", GLTF),
    ),
    (r"Blender or trimesh writes these", "a.fbx", "x", (".stl", stl_text())),
]


@pytest.mark.slow
@pytest.mark.parametrize(("said", "name", "bad", "good"), REFUSED)
def test_what_a_message_asks_for_is_read(tmp_path, said, name, bad, good):
    path = tmp_path / name
    path.write_text(bad)
    with pytest.raises(InputError, match=said):
        read_mesh(path)
    if isinstance(good, tuple):
        path = path.with_suffix(good[0])
        good = good[1]
    path.write_text(good)
    assert len(read_mesh(path).triangles) == len(L_TRIANGLES)
