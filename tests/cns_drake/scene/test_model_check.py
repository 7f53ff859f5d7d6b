"""Models and meshes that would crash Drake's readers, or be changed."""

from pathlib import Path

from helpers.mesh_worlds import read_mesh
from helpers.small_map import box_visual, world_text
from pydrake.geometry import ReadObjToTriangleSurfaceMesh
import pytest

from cns_drake.scene import load_world, read_perception_geometry
from evaluation.base import InputError

_SHAPES = {
    "sphere": "<sphere><radius>{}</radius></sphere>",
    "box": "<box><size>1 {} 1</size></box>",
    "cylinder": "<cylinder><radius>{}</radius><length>2</length></cylinder>",
    "cylinder's length": "<cylinder><radius>1</radius><length>{}</length>"
    "</cylinder>",
    "capsule": "<capsule><radius>1</radius><length>{}</length></capsule>",
    "ellipsoid": "<ellipsoid><radii>1 1 {}</radii></ellipsoid>",
    "drake:capsule": "<drake:capsule><radius>{}</radius><length>1</length>"
    "</drake:capsule>",
    "drake:ellipsoid": "<drake:ellipsoid><a>1</a><b>{}</b><c>1</c>"
    "</drake:ellipsoid>",
}
_TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
_MESH = "<mesh><uri>wedge.obj</uri></mesh>"


def write(folder: Path, geometry: str, kind: str = "visual") -> Path:
    path = folder / "world.sdf"
    body = f'<{kind} name="a/b"><geometry>\n{geometry}</geometry></{kind}>'
    path.write_text(
        world_text(
            [box_visual("ground/x", (0, 0, 0, 0, 0, 0), (1, 1, 1)), body]
        )
    )
    return path


def read_geometry(path: Path):
    inspector = load_world(path).scene_graph.model_inspector()
    return read_perception_geometry(inspector)


@pytest.mark.parametrize("shape", _SHAPES)
@pytest.mark.parametrize(
    "value",
    ["nan", "inf", "-inf", "0", "-3", "abc", "1,5", "1.5m", "1e400", "", "0x3"],
)
def test_sizes_that_are_none(tmp_path, shape, value):
    path = write(tmp_path, _SHAPES[shape].format(value))
    with pytest.raises(InputError) as refusal:
        load_world(path)
    message = str(refusal.value)
    assert message.startswith(f"{path}: line ")
    assert f"{shape.split(chr(39))[0]}: " in message
    assert value in message
    assert "\n" not in message


@pytest.mark.parametrize("shape", _SHAPES)
@pytest.mark.parametrize("value", ["1.5", " 2 ", "1e-3", "+.5", "3.e2"])
def test_sizes_are_read_as_they_are(tmp_path, shape, value):
    _, geometry = read_geometry(write(tmp_path, _SHAPES[shape].format(value)))
    surface = geometry.surface
    sizes = (
        2 * surface.p_GVset[:, 1].max()
        if shape == "box"
        else list(vars(surface).values())
    )
    flat = [
        one
        for size in (sizes if isinstance(sizes, list) else [sizes])
        for one in (size if isinstance(size, tuple) else (size,))
    ]
    assert any(one == pytest.approx(float(value), rel=1e-12) for one in flat)


@pytest.mark.parametrize(
    ("geometry", "fault"),
    [
        ("<drake:capsule/>", "drake:capsule: no radius"),
        ("<polyline/><box><size>1 1 1</size></box>", "two shapes, polyline"),
        ("<plane><size>1 0</size></plane>", "1 0 is not a valid size"),
        ("<plane><normal>0 0 0</normal></plane>", "0 0 0 is no direction"),
        ("<sphere><radius>1</radius><radius>2</radius></sphere>", "2 times"),
        ("<box><size>1 2</size></box>", "size: 2 numbers, not 3"),
        (
            "<sphere><radius>1</radius></sphere><box><size>1 1 1</size></box>",
            "geometry: two shapes",
        ),
        ("<mesh><uri>a.obj</uri><scale>1 1,5 1</scale></mesh>", "1,5 is no"),
    ],
)
def test_other_contradictions(tmp_path, geometry, fault):
    with pytest.raises(InputError, match=fault):
        load_world(write(tmp_path, geometry))


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("<pose>1 ", "<pose>1,5 ", "pose: 1,5 is no number"),
        ("<pose>1 ", "<pose>1e39 ", "pose: 1e.39 is beyond"),
        ("body", "b" * 100_000, "name of 100000 letters"),
        ('"city"', f'"{"c" * 100_000}"', "name of 100000 letters"),
        ("<sdf", "<!DOCTYPE a><sdf", "document type"),
        ("</sdf>", "<a>" * 100_000 + "</a>" * 100_000 + "</sdf>", "nested"),
        ("</sdf>", "", "no element|unclosed|mismatched"),
    ],
)
def test_other_text_of_a_world(tmp_path, old, new, fault):
    text = world_text([box_visual("body", (1, 2, 3, 0, 0, 0), (4, 5, 6))])
    assert old in text
    path = tmp_path / "world.sdf"
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=fault) as refusal:
        load_world(path)
    assert len(str(refusal.value)) < 2000


def test_what_a_vehicle_includes_is_checked(tmp_path):
    world = write(tmp_path, _SHAPES["box"].format(1))
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "model.sdf").write_text(
        world.read_text().replace("1 1 1", "1 -1 1")
    )
    vehicle = tmp_path / "car.sdf"
    for uri in ("inner", "inner/model.sdf"):
        vehicle.write_text(
            '<sdf version="1.9"><model name="m"><include>'
            f"<uri>{uri}</uri></include></model></sdf>"
        )
        with pytest.raises(InputError, match=r"model\.sdf: line .*: -1|1 -1 1"):
            load_world(world, vehicle=vehicle)


def test_a_vehicle_that_includes_itself(tmp_path):
    vehicle = tmp_path / "car.sdf"
    vehicle.write_text(
        '<sdf version="1.9"><model name="m"><include>'
        "<uri>car.sdf</uri></include></model></sdf>"
    )
    world = write(tmp_path, _SHAPES["box"].format(1))
    with pytest.raises(InputError, match=r"car\.sdf: "):
        load_world(world, vehicle=vehicle)


_FACES = [
    "f 1 2 99999999999",
    "f 1 2 2147483647",
    "f 1 2 999999999",
    "f 1 2 5",
    "f 1 2 0",
    "f 1 2 -5",
    "f\t1 2 3 4 99999999",
    " f 1/1 2/2 7/1",
    "f 1 2 3e9",
    "f 1 2 3\\",
    "f 1 2 3\rf 1 2 8888",
    "f 1 2 3 # fine\nf 1 2 77 # not",
    "f 1 2 1-2",
]


@pytest.mark.parametrize("face", _FACES)
@pytest.mark.parametrize("kind", ["visual", "collision"])
def test_faces_without_their_vertices(tmp_path, face, kind):
    (tmp_path / "wedge.obj").write_text(f"{_TETRAHEDRON}{face}\n")
    path = write(tmp_path, _MESH, kind)
    with pytest.raises(
        InputError, match=r"wedge\.obj: .*line \d: .* (not there|next line)"
    ):
        read_geometry(path)


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 3",
        "f -1 -2 -3",
        "f 1//7 2//7 3//7",
        "f 1/2/3 2 3 4",
        "f 1 2 3 # 99",
        "# f 99\nf 1 2 3",
        "g f 99\nf 1 2 3",
        " f  1\t2 3 ",
    ],
)
def test_faces_that_drake_reads(tmp_path, face):
    path = tmp_path / "wedge.obj"
    path.write_text(f"{_TETRAHEDRON}vn 0 0 1\n{face}\n")
    assert len(read_mesh(path).triangles) >= 1
    assert ReadObjToTriangleSurfaceMesh(path).num_triangles() >= 1


def test_rows_that_match_nothing_are_noted(tmp_path):
    path = write(tmp_path, _SHAPES["box"].format(1))
    text = path.read_text()
    table = tmp_path / "structures.csv"
    table.write_text("instance,name,class\n1,a,building\n2,ground,terrain\n")
    assert load_world(path).notes == ()
    # Rows of structures in another stage.
    table.write_text(table.read_text() + "3,tower,building\n")
    assert load_world(path).notes == ()
    path.write_text(text.replace("a/b", "a").replace("ground/x", "ground"))
    (note,) = load_world(path).notes
    assert note.startswith(f"{table}: 3 of 3 rows match nothing (such as a)")
    assert "1 of 1 structures have no row" in note
    assert "<structure>/<part>" in note


@pytest.mark.parametrize("version", ["1.0", "1.1", "1.13", "2.0", "9", "x", ""])
@pytest.mark.parametrize("root", ["sdf", "gazebo"])
@pytest.mark.parametrize("is_included", [False, True])
def test_versions_of_sdf_that_are_not_read(
    tmp_path, version, root, is_included
):
    old = tmp_path / "old.sdf"
    old.write_text(
        f'<{root} version="{version}"><model name="m"><link name="l">'
        f"{box_visual('a/b', (0, 0, 0, 0, 0, 0), (1, 1, 1))}</link></model>"
        f"</{root}>"
    )
    world = tmp_path / "world.sdf" if is_included else old
    if is_included:
        world.write_text(
            '<sdf version="1.9"><world name="w"><include><uri>old.sdf</uri>'
            "</include></world></sdf>"
        )
    with pytest.raises(InputError) as refusal:
        load_world(world)
    assert str(refusal.value) == (
        f"{old}: line 1: {root}: version {version} of SDF is not read, but 1.2"
        " to 1.12"
    )


@pytest.mark.parametrize("minor", range(2, 13))
def test_versions_of_sdf_that_are_read(tmp_path, minor):
    path = write(tmp_path, "<box><size>1 1 1</size></box>")
    path.write_text(path.read_text().replace('"1.9"', f'"1.{minor}"'))
    assert f'"1.{minor}"' in path.read_text()
    assert len(read_geometry(path)) == 2


@pytest.mark.parametrize("fault", ["", "nan"])
@pytest.mark.parametrize("name", ["a crate.sdf", "a%20crate.sdf"])
@pytest.mark.parametrize(
    "uri",
    ["{}", "package://stock/{}", "model://stock/{}", "file://{folder}/{}"],
)
def test_included_files_are_found_and_checked(tmp_path, uri, name, fault):
    folder = tmp_path / "shelf/stock"
    folder.mkdir(parents=True)
    side = f"<box><size>2 2 {fault or 2}</size></box>"
    model = world_text(
        [f'<visual name="side"><geometry>{side}</geometry></visual>']
    )
    model = model.replace("<world", "<model").replace("</world", "</model")
    (folder / "a crate.sdf").write_text(model)
    world = (folder if uri == "{}" else tmp_path) / "world.sdf"
    uri = uri.format(name, folder=folder)
    world.write_text(
        '<sdf version="1.9"><world name="w"><include><name>one</name><uri>'
        f"{uri}</uri></include></world></sdf>"
    )
    if fault:
        with pytest.raises(InputError, match=r"a crate\.sdf: line .*nan"):
            load_world(world, model_paths=[tmp_path / "shelf"])
    else:
        read = load_world(world, model_paths=[tmp_path / "shelf"])
        assert not read.notes
        assert len(read_perception_geometry(read.scene_graph.model_inspector()))


@pytest.mark.parametrize("name", ["world.sdf.erb", "world.sdf"])
def test_templates_are_named(tmp_path, name):
    path = tmp_path / name
    path.write_text('<% n = 1 %>\n<sdf version="1.9"></sdf>')
    with pytest.raises(
        InputError, match="template is not read; the program erb"
    ):
        load_world(path)
