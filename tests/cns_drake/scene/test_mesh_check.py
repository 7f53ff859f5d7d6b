"""Meshes whose shapes would be misread, and what is not read of others."""

import base64
import json
import struct

from helpers.mesh_texts import L_TRIANGLES, gltf_text
from helpers.mesh_worlds import notes_of, read_mesh, world_of
import numpy as np
import pytest

from evaluation.base import InputError


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


@pytest.mark.parametrize(
    ("name", "required", "is_read"),
    [
        ("KHR_mesh_quantization", False, False),
        ("ACME_folded_space", True, False),
        ("KHR_texture_transform", True, True),
        # Shapes are there without it, too.
        ("KHR_draco_mesh_compression", False, True),
        # No shape uses it.
        ("ACME_folded_space", False, True),
    ],
)
def test_extensions_that_change_shapes_are_refused(
    tmp_path, name, required, is_read
):
    path = write(tmp_path, extension(name, required))
    if is_read:
        assert notes_of(path) == ()
        return
    with pytest.raises(InputError, match=f"needs the extension {name} of glTF"):
        notes_of(path)


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
        (
            lambda top: top["nodes"][0].update(extensions={"ACME_lod": {}}),
            "1 uses of the extension ACME_lod of glTF ignored",
        ),
    ],
)
def test_what_is_not_read_is_named(tmp_path, change, note):
    path = write(tmp_path, change)
    (found,) = world_of(path).notes
    assert found.startswith(f"{path}: {note}")


@pytest.mark.parametrize(
    "text",
    [b"", b"[]", b"glTF", b'{"meshes": 1}', b'{"meshes": [{}]}', b"{", b"\xff"],
)
def test_files_that_are_no_gltf(tmp_path, text):
    path = tmp_path / "thing.gltf"
    path.write_bytes(text)
    with pytest.raises(InputError, match=r"\w"):
        notes_of(path)


SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
FACES = "element face 1\nproperty list uchar int {}\n"
LIST = "property list int int vertex_indices\n"


def ply(elements, rows):
    """A PLY file with four vertices and further elements."""
    return (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
        f"property float y\nproperty float z\n{elements}end_header\n"
        f"{SQUARE}{rows}"
    )


def facet(*corners):
    rows = "".join("vertex {} {} {}\n".format(*p) for p in corners)
    return f"facet normal 0 0 1\nouter loop\n{rows}endloop\nendfacet\n"


def stl(*facets):
    return f"solid a\n{''.join(facet(*one) for one in facets)}endsolid a\n"


# The corners of a square.
A = (0, 0, 0)
B = (1, 0, 0)
C = (1, 1, 0)
D = (0, 1, 0)
BY_INDEX = FACES.format("vertex_index")
VERTICES = "".join(f"v {row}\n" for row in SQUARE.splitlines())


@pytest.mark.parametrize(
    ("name", "text", "fault"),
    [
        (
            "polygon.ply",
            ply("element polygon 1\n" + LIST + BY_INDEX, "3 0 1 2\n3 0 2 3\n"),
            "surfaces in the element polygon of PLY",
        ),
        (
            "lists.ply",
            ply(BY_INDEX + LIST, "3 0 1 2 3 0 2 3\n"),
            "two lists of vertices in each face, vertex_index and vertex_ind",
        ),
        ("quad.stl", stl((A, B, C), (A, B, C, D)), "7 vertices in 2 facets"),
        ("torn.stl", stl((A, B, C))[:-11], "ends within a solid of STL"),
        ("TORN.STL", stl((A, B, C), (A, C, D))[:-40].upper(), "ends within"),
    ],
)
def test_surfaces_that_would_be_missing_are_refused(
    tmp_path, name, text, fault
):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=fault):
        notes_of(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text", "notes"),
    [
        ("plain.ply", ply(BY_INDEX, "4 0 1 2 3\n"), ()),
        (
            "none.ply",
            ply(BY_INDEX + "element tristrips 0\n" + LIST, "4 0 1 2 3\n"),
            (),
        ),
        (
            "uv.ply",
            ply(
                BY_INDEX + "property list uchar float texcoord\n",
                "3 0 1 2 6 0 0 1 0 1 1\n",
            ),
            (),
        ),
        (
            "edge.ply",
            ply(
                BY_INDEX + "element edge 2\nproperty int vertex1\n"
                "property int vertex2\n",
                "3 0 1 2\n0 1\n1 2\n",
            ),
            ("2 elements edge of PLY ignored",),
        ),
        ("whole.stl", stl((A, B, C), (A, C, D)), ()),
        ("two.stl", stl((A, B, C)) + stl((A, C, D)), ()),
    ],
)
def test_what_is_read_as_a_whole_is_not_refused(tmp_path, name, text, notes):
    (tmp_path / name).write_text(text)
    assert notes_of(tmp_path / name) == notes


def binary_ply(order, faces, size="uchar", end="\n", more=b""):
    """The square with faces, one property before their list and one after."""
    kind = {"<": "little", ">": "big"}[order]
    head = (
        f"ply\nformat binary_{kind}_endian 1.0\nelement vertex 4\nproperty"
        " double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty short id\nproperty list {size}"
        " int vertex_indices\nproperty uchar red\nend_header\n"
    )
    length = {"uchar": "B", "int": "i"}[size]
    rows = [struct.pack(order + "3d", *p) for p in (A, B, C, D)]
    rows += [
        struct.pack(f"{order}h{length}{len(f)}iB", 7, len(f), *f, 255)
        for f in faces
    ]
    return head.replace("\n", end).encode() + b"".join(rows) + more


@pytest.mark.parametrize("corners", [0, 1, 2])
def test_faces_of_ply_have_three_corners(tmp_path, corners):
    """Open3D 0.19 reads the other ones from memory that is not theirs."""
    path = tmp_path / "thing.ply"
    few = tuple(range(corners))
    good = (0, 1, 2, 3)
    row = " ".join(map(str, (corners, *few)))
    texts = [ply(FACES.format("vertex_index").replace("face 1", "face 2"),
                 f"4 0 1 2 3\n{row}\n").encode()]  # fmt: skip
    for order in "<>":
        texts.append(binary_ply(order, [good, few, good]))
        texts.append(binary_ply(order, [few], "int", "\r\n", b"more"))
    for text in texts:
        path.write_bytes(text)
        with pytest.raises(InputError, match=f"PLY with {corners} corners"):
            notes_of(path)
    for order in "<>":
        path.write_bytes(binary_ply(order, [good, (2, 1, 0)]))
        assert notes_of(path) == ()


def test_a_binary_stl_may_begin_like_a_text(tmp_path):
    path = tmp_path / "solid.stl"
    facets = [struct.pack("<12fH", *(0.0,) * 3, *A, *B, *C, 0)] * 2
    head = b"solid made by a program".ljust(80)
    path.write_bytes(head + struct.pack("<I", len(facets)) + b"".join(facets))
    assert notes_of(path) == ()


def test_a_mode_that_is_none_of_gltf_is_refused(tmp_path):
    def change(top):
        top["meshes"][0]["primitives"].append(
            {"attributes": {"POSITION": 0}, "mode": 7}
        )

    with pytest.raises(InputError, match="mode is none of glTF"):
        notes_of(write(tmp_path, change))


@pytest.mark.parametrize(
    "name", ["a.off", "a.fbx", "a.3ds", "a.ply.gz", "a", "a.step"]
)
def test_other_formats_are_refused(tmp_path, name):
    (tmp_path / name).write_text("OFF\n")
    with pytest.raises(InputError, match="no mesh of a format that is read"):
        notes_of(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "<asset><unit meter='0,01'/></asset>",
            "has a unit of COLLADA of '0,01' m",
        ),
        (
            "<asset><unit meter='1'/></asset><library_nodes><node><asset>"
            "<unit meter='2'/></asset></node></library_nodes>",
            "parts of COLLADA with another unit or axis",
        ),
        (
            "<library_nodes><node><instance_node url='b.dae#a'/></node>"
            "</library_nodes>",
            r"another file \('b.dae#a'\)",
        ),
    ],
)
def test_collada_whose_places_would_be_wrong_is_refused(tmp_path, text, fault):
    path = tmp_path / "thing.dae"
    path.write_text(f"<COLLADA>{text}</COLLADA>")
    with pytest.raises(InputError, match=fault):
        notes_of(path)
    # A camera may have any place.
    path.write_text(
        "<COLLADA><library_nodes><node><lookat>1 2 3 0 0 0 0 0 1</lookat>"
        "<instance_camera url='#c'/></node></library_nodes></COLLADA>"
    )
    assert notes_of(path) == ()


@pytest.mark.slow
def test_faces_of_gltf_have_their_vertices(tmp_path):
    """Open3D leaves out a face without its vertices, wherever it is shown."""

    def change(top):
        indices = np.array([0, 1, 2, 3, 4, 900], "<u2").tobytes()
        data = base64.b64encode(indices).decode()
        top["buffers"].append(
            {
                "byteLength": len(indices),
                "uri": f"data:application/octet-stream;base64,{data}",
            }
        )
        top["bufferViews"].append({"buffer": 1, "byteLength": len(indices)})
        top["accessors"].append(
            {
                "bufferView": 2,
                "componentType": 5123,
                "count": 6,
                "type": "SCALAR",
            }
        )
        top["meshes"][0]["primitives"][0]["indices"] = 2
        top["nodes"] = [{"children": [1]}, {"mesh": 0}]

    with pytest.raises(InputError, match="of 2 triangles can be read"):
        read_mesh(write(tmp_path, change))


@pytest.mark.parametrize(
    "vertex",
    ["1 2", "1,5 2 3", "nan 2 3", "1 2 inf", "1 2 x", "1 2 3d0", "1 2 \\\n3"],
)
def test_a_vertex_of_obj_that_is_no_numbers_is_refused(tmp_path, vertex):
    """Drake's reader takes such a coordinate for 0."""
    path = tmp_path / "thing.obj"
    path.write_text(f"v 0 0 0\nv {vertex}\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match="line 2: a vertex that is not three"):
        read_mesh(path)


@pytest.mark.parametrize(
    "vertex", ["+1 .5 -2.e-3", "\t1 2 3 ", "1 2 3 1.0", "1 2 3 .1 .2 .3# red"]
)
def test_vertices_of_obj_in_other_forms_are_read(tmp_path, vertex):
    path = tmp_path / "thing.obj"
    path.write_text(f"v 0 0 0\n  v {vertex}\r\nv 0 1 0\nf 1 2 3\nv {vertex}")
    read_mesh(path)


def in_chunk(top, data):
    del top["buffers"][0]["uri"]
    return data


def beside(top, data):
    top["buffers"][0]["uri"] = "my%20data.bin"
    return b""


def as_open3d_writes_it(top, data):
    return b""


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("place", [in_chunk, beside, as_open3d_writes_it])
def test_a_binary_gltf_has_its_buffer_at_any_place(tmp_path, place):
    text, data = gltf_text()
    (tmp_path / "my data.bin").write_bytes(data)
    top = json.loads(text)
    chunk = place(top, data)
    text = json.dumps(top).encode()
    text += b" " * (-len(text) % 4)
    parts = [(text, b"JSON")] + [(chunk, b"BIN\0")] * bool(chunk)
    body = b"".join(
        struct.pack("<I4s", len(part), kind) + part for part, kind in parts
    )
    head = struct.pack("<4sII", b"glTF", 2, 12 + len(body))
    (tmp_path / "thing.glb").write_bytes(head + body)
    surface = read_mesh(tmp_path / "thing.glb")
    assert len(surface.triangles) == len(L_TRIANGLES)


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
@pytest.mark.parametrize(
    "buffers", [None, "abc", {"a": 1}, [1], [{"uri": 5, "byteLength": 3}]]
)
def test_buffers_of_gltf_that_are_none_are_refused(tmp_path, buffers, suffix):
    path = write(tmp_path, lambda top: top.update(buffers=buffers), suffix)
    with pytest.raises(InputError, match="no valid glTF"):
        notes_of(path)


HEAD, ROWS = ply(BY_INDEX, "4 0 1 2 3\n").split("end_header\n")
CORNERS = ROWS.splitlines()[:4]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        ([*CORNERS, "4 0 1 2 3"], None),
        # The lines do not matter.
        ([" ".join([*CORNERS, "4 0 1 2 3"])], None),
        ([*CORNERS[:3], "4 0 1 2 3"], "4 rows of PLY, not 5"),
        ([*CORNERS, CORNERS[0], "4 0 1 2 3"], "6 rows of PLY, not 5"),
        ([*(f"{row} 9" for row in CORNERS), "4 0 1 2 3"], "4 values in a row"),
        ([*(row[:-2] for row in CORNERS), "4 0 1 2 3"], "2 values in a row"),
        ([*CORNERS, "4 0 1 2"], "lists of PLY that are longer or shorter"),
        ([*CORNERS, "-4 0 1 2 3"], "lists of PLY that are longer or shorter"),
    ],
)
def test_rows_of_ply_fit_their_header(tmp_path, rows, fault):
    path = tmp_path / "thing.ply"
    path.write_text("\n".join([f"{HEAD}end_header", *rows, ""]))
    if fault is None:
        assert len(read_mesh(path).triangles) == 2
        return
    with pytest.raises(InputError, match=fault):
        read_mesh(path)
