"""CityJSON files, right ones and wrong ones."""

import json
from types import SimpleNamespace

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter
import numpy as np
import pytest

from evaluation.base import InputError

ORIGIN = np.array([85000.0, 446000.0, 3.0])


def structures(path, lod=None, year_attribute=None):
    """Returns the city, and name -> structure about ORIGIN."""
    city = read_city(path, lod=lod, year_attribute=year_attribute)
    return city, {
        one.structure.name: SimpleNamespace(
            structure=one.structure,
            year=one.year,
            triangles=one.triangles + np.subtract(city.origin, ORIGIN),
        )
        for one in city.objects
    }


def area(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def volume(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize("version", ["1.0", "1.1", "2.0"])
def test_a_box_is_where_it_is(tmp_path, version):
    city = CityWriter(version)
    city.box("a", 10.0, -5.0, (4.0, 3.0, 2.0), z=0.5)
    _, found = structures(city.write(tmp_path / "city.json"))
    corners = found["a"].triangles.reshape(-1, 3)
    np.testing.assert_allclose(corners.min(axis=0), [10, -5, 0.5], atol=1e-9)
    np.testing.assert_allclose(corners.max(axis=0), [14, -2, 2.5], atol=1e-9)
    assert volume(found["a"]) == pytest.approx(24.0)
    assert area(found["a"]) == pytest.approx(52.0)
    parts = {p.name for p in found["a"].structure.model.parts}
    assert parts == {"body", "roof"}
    assert found["a"].structure.semantic_class == "building"


def test_every_type_of_geometry(tmp_path):
    city = CityWriter()
    box = city.box_faces(0, 0, 0, (4, 4, 4))
    hole = city.box_faces(1, 1, 1, (2, 2, 2))
    far = city.box_faces(20, 0, 0, (1, 1, 1))
    roof = city.ring([(0, 0, 9), (9, 0, 9), (9, 9, 9), (0, 9, 9)])
    gap = city.ring([(1, 1, 9), (1, 2, 9), (2, 2, 9), (2, 1, 9)])
    for name, kind, boundaries in (
        ("surfaces", "MultiSurface", [[roof, gap]]),
        ("composite", "CompositeSurface", box),
        ("solid", "Solid", [box, hole]),
        ("solids", "MultiSolid", [[box], [far]]),
        ("joined", "CompositeSolid", [[box], [far]]),
    ):
        geometry = {"type": kind, "lod": 2, "boundaries": boundaries}
        city.add(name, "Building", geometry)
    line = {"type": "MultiLineString", "lod": 0, "boundaries": [roof]}
    city.add("line", "Road", line)
    read, found = structures(city.write(tmp_path / "city.json"))
    assert area(found["surfaces"]) == pytest.approx(80.0)
    assert area(found["composite"]) == pytest.approx(96.0)
    # The inner shell is a part of the solid.
    assert area(found["solid"]) == pytest.approx(96.0 + 24.0)
    assert area(found["solids"]) == area(found["joined"])
    assert area(found["joined"]) == pytest.approx(96.0 + 6.0)
    assert "line" not in found
    notes = {kind for kind, _, _ in read.faults.rows()}
    assert "geometry of type MultiLineString, left out" in notes
    assert "object without a surface, left out" in notes


def test_templates_are_placed(tmp_path):
    city = CityWriter()
    shape = CityWriter()
    faces = shape.box_faces(0, 0, 0, (1, 1, 1))
    city.templates = {
        "templates": [{"type": "MultiSurface", "lod": 2, "boundaries": faces}],
        "vertices-templates": [[v / 1000 for v in p] for p in shape.vertices],
    }
    turn = [[0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]
    instance = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [city.vertex(100, 0, 0)],
        "transformationMatrix": np.ravel(turn).tolist(),
    }
    city.add("tree", "SolitaryVegetationObject", instance)
    _, found = structures(city.write(tmp_path / "city.json"))
    corners = found["tree"].triangles.reshape(-1, 3)
    np.testing.assert_allclose(corners.min(axis=0), [103, 0, 0], atol=1e-9)
    np.testing.assert_allclose(corners.max(axis=0), [105, 2, 2], atol=1e-9)
    assert found["tree"].structure.semantic_class == "vegetation"


def test_a_building_and_its_parts_are_one_structure(tmp_path):
    city = CityWriter()
    flat = {
        "type": "MultiSurface",
        "lod": "0",
        "boundaries": [[city.ring([(0, 0, 0), (9, 0, 0), (9, 9, 0)])]],
    }
    attributes = {"oorspronkelijkbouwjaar": 1931}
    city.add(
        "NL.1/2", "Building", flat, children=["p", "q"], attributes=attributes
    )
    city.box("p", 0, 0, (2, 2, 2), kind="BuildingPart", parents=["NL.1/2"])
    city.box("q", 5, 0, (2, 2, 2), kind="BuildingPart", parents=["NL.1/2"])
    _, found = structures(city.write(tmp_path / "city.json"))
    (one,) = found.values()
    assert one.structure.name == "NL.1_2"
    assert one.year == 1931
    # The footprint gives no wall if the parts are solids.
    assert area(one) == pytest.approx(48.0)


def test_levels_of_detail(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2))
    low = {
        "type": "Solid",
        "lod": "1.2",
        "boundaries": [city.box_faces(0, 0, 0, (2, 2, 1))],
    }
    city.objects["a"]["geometry"].append(low)
    path = city.write(tmp_path / "city.json")
    assert volume(structures(path)[1]["a"]) == pytest.approx(8.0)
    assert volume(structures(path, lod=1.2)[1]["a"]) == pytest.approx(4.0)
    read, found = structures(path, lod=3.0)
    assert found == {}
    notes = {kind for kind, _, _ in read.faults.rows()}
    assert notes == {"object without level of detail 3, left out"}


def test_a_solid_inside_out_is_turned_back(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2))
    (shell,) = city.objects["a"]["geometry"][0]["boundaries"]
    city.objects["a"]["geometry"][0]["boundaries"] = [
        [[ring[::-1] for ring in face] for face in shell]
    ]
    read, found = structures(city.write(tmp_path / "city.json"))
    assert volume(found["a"]) == pytest.approx(8.0)
    assert "reversed" in read.faults.rows()[0][0]


def test_a_drive_has_vertices_of_each_feature(tmp_path):
    lines = []
    for k in range(3):
        city = CityWriter()
        city.box(f"a{k}", 10.0 * k, 0, (1, 1, 1 + k))
        document = city.document()
        if k == 0:
            first = document | {"CityObjects": {}, "vertices": []}
            lines.append(json.dumps(first))
        lines.append(
            json.dumps(
                {
                    "type": "CityJSONFeature",
                    "id": f"a{k}",
                    "CityObjects": document["CityObjects"],
                    "vertices": document["vertices"],
                }
            )
        )
    path = tmp_path / "city.city.jsonl"
    path.write_text("\n".join(lines) + "\n\n")
    _, found = structures(path)
    assert [volume(one) for one in found.values()] == pytest.approx([1, 2, 3])


def test_features_share_the_templates_of_their_file(tmp_path):
    city = CityWriter()
    shape = {"type": "MultiSurface", "lod": 2, "boundaries": [[[0, 1, 2]]]}
    corners = [[0, 0, 0], [2, 0, 0], [0, 2, 0]]
    city.templates = {"templates": [shape], "vertices-templates": corners}
    head = city.document()
    lines = [head | {"CityObjects": {}}]
    for k in range(3):
        instance = {
            "type": "GeometryInstance",
            "template": 0,
            "boundaries": [0],
            "transformationMatrix": np.eye(4).ravel().tolist(),
        }
        tree = {"type": "SolitaryVegetationObject", "geometry": [instance]}
        vertices = [[1000 * k, 0, 0]]
        feature = {"type": "CityJSONFeature", "CityObjects": {f"t{k}": tree}}
        lines.append(feature | {"vertices": vertices})
    path = tmp_path / "city.city.jsonl"
    path.write_text("\n".join(map(json.dumps, lines)))
    _, found = structures(path)
    for k in range(3):
        corner = found[f"t{k}"].triangles.reshape(-1, 3).min(axis=0)
        np.testing.assert_allclose(corner, [k, 0, 0], atol=1e-9)


def broken(change):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2))
    document = city.document()
    change(document)
    return json.dumps(document)


def set_in(*keys):
    *path, last, value = keys

    def change(document):
        for key in path:
            document = document[key]
        document[last] = value

    return change


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("{", "no JSON"),
        ("[" * 200_000, "nested too deep"),
        ("[1]", "no JSON object"),
        ('{"type": "Feature"}', "type 'Feature' is not CityJSON"),
        (broken(set_in("version", "3.0")), "version '3.0'"),
        (broken(set_in("CityObjects", [])), "CityObjects: not an object"),
        (broken(set_in("CityObjects", {})), "the file has no objects"),
        (
            broken(set_in("vertices", [[1, 2]])),
            "vertices: every item must be three numbers",
        ),
        (broken(set_in("vertices", [[1e300, 0, 0]])), "beyond 1e+08 m"),
        (
            broken(set_in("vertices", "abc")),
            "vertices: every item must be three numbers",
        ),
        (
            broken(set_in("transform", "scale", [1e300] * 3)),
            "beyond 1e+08 m",
        ),
        (
            broken(
                set_in(
                    "metadata", "referenceSystem", "urn:ogc:def:crs:EPSG::4326"
                )
            ),
            "is in degrees; project it",
        ),
        (
            broken(set_in("metadata", "referenceSystem", "EPSG:3031")),
            "EPSG:3031 (WGS 84 / Antarctic Polar Stereographic) has the axes",
        ),
        (
            broken(set_in("metadata", "referenceSystem", "the moon's")),
            "referenceSystem: the moon's is not a known reference system",
        ),
        (broken(set_in("CityObjects", "a", "geometry", [])), "no object has a"),
    ],
)
def test_files_that_are_none(tmp_path, text, fault):
    path = tmp_path / "city.json"
    path.write_text(text)
    with pytest.raises(InputError) as info:
        read_city(path)
    assert str(info.value).startswith(str(path))
    assert fault in str(info.value)
    assert "\n" not in str(info.value)


@pytest.mark.parametrize(
    ("change", "notes"),
    [
        (
            set_in("CityObjects", "a", "geometry", 0, "boundaries", 7),
            "is not an object",
        ),
        (set_in("CityObjects", "a", "geometry", 0, None), "is not an object"),
        (
            set_in(
                "CityObjects", "a", "geometry", 0, "boundaries", 0, 0,
                [[0, 1, 99999]],
            ),
            "unknown vertices",
        ),
        (
            set_in(
                "CityObjects", "a", "geometry", 0, "boundaries", 0, 0,
                [[0, 1, -1]],
            ),
            "unknown vertices",
        ),
        (set_in("CityObjects", "b", {"type": 5}), "without a type"),
    ],
)  # fmt: skip
def test_unusable_parts_are_noted(tmp_path, change, notes):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2))
    city.box("ok", 5, 5, (2, 2, 2))
    document = city.document()
    change(document)
    path = tmp_path / "city.json"
    path.write_text(json.dumps(document))
    read, found = structures(path)
    assert "ok" in found
    assert any(notes in kind for kind, _, _ in read.faults.rows())


def test_parents_in_a_circle(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2), parents=["b"])
    city.box("b", 5, 0, (2, 2, 2), parents=["a"])
    _, found = structures(city.write(tmp_path / "city.json"))
    assert sum(volume(one) for one in found.values()) == pytest.approx(16.0)


def solid(city, lod, *box):
    faces = city.box_faces(*box)
    return {"type": "Solid", "lod": lod, "boundaries": [faces]}


@pytest.mark.parametrize(
    ("whole", "parts", "expected", "count"),
    [
        # A block around its parts, which are better.
        (("1", 0, 0, 0, (20, 10, 9)), ["2.2", "2.2"], 1100.0, 1),
        (("2", 0, 0, 0, (20, 10, 9)), ["2.2", "2.2"], 1100.0, 1),
        # Parts that are worse than the whole.
        (("2.2", 0, 0, 0, (20, 10, 9)), ["1", "1"], 1800.0, 2),
        # Both are there at equal levels, or beside each other.
        (("2.2", 0, 0, 0, (20, 10, 9)), ["2.2", "2.2"], 2900.0, 0),
        (("1", 0, 30, 0, (20, 10, 9)), ["2.2", "2.2"], 2900.0, 0),
        (("2.2", 0, 30, 0, (20, 10, 9)), ["1", "2.2"], 2900.0, 0),
        # A part of a similar level.
        (("2.2", 0, 0, 0, (20, 30, 9)), ["2.0"], 5800.0, 0),
    ],
)
@pytest.mark.parametrize("link", ["parents", "children"])
def test_a_building_and_its_parts_of_different_levels(
    tmp_path, whole, parts, expected, count, link
):
    """The parts are 400 and 700 m3, beside each other."""
    city = CityWriter()
    names = [f"p{k}" for k in range(len(parts))]
    more = {"children": names} if link == "children" else {}
    city.add("house", "Building", solid(city, whole[0], *whole[1:]), **more)
    for k, (name, lod) in enumerate(zip(names, parts, strict=True)):
        one = solid(city, lod, 10 * k, 0, 0, (10, 10, 4 + 3 * k))
        more = {"parents": ["house"]} if link == "parents" else {}
        city.add(name, "BuildingPart", one, **more)
    read, found = structures(city.write(tmp_path / "city.json"))
    assert volume(found["house"]) == pytest.approx(expected)
    counts = {kind: number for kind, number, _ in read.faults.rows()}
    kind = "geometry with a better one inside, left out"
    assert counts.get(kind, 0) == count


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (set_in("transform", "rotate", [0, 0, 1]), "transform.rotate is not"),
        (set_in("transform", "scale", [1, 0, 1]), "transform.scale: not above"),
        (set_in("transform", "scale", [1, -1, 1]), "transform.scale: not"),
        (set_in("transform", [1, 1, 1]), "transform: not an object"),
    ],
)
def test_transforms_that_are_not_read(tmp_path, change, fault):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2))
    document = city.document()
    change(document)
    path = tmp_path / "city.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=fault):
        read_city(path)


def test_members_of_objects_that_are_not_read_are_counted(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2), translation=[9, 9, 9], address=[{}])
    read, _ = structures(city.write(tmp_path / "city.json"))
    assert read.faults.rows() == [("translation of object, not read", 1, "a")]


def test_faces_that_only_close_a_solid_are_not_seen(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (2, 2, 2))
    (geometry,) = city.objects["a"]["geometry"]
    for one in geometry["semantics"]["surfaces"]:
        if one["type"] == "RoofSurface":
            one["type"] = "ClosureSurface"
    read, found = structures(city.write(tmp_path / "city.json"))
    assert area(found["a"]) == pytest.approx(20.0)
    kind = "face that only closes a solid, left out"
    assert read.faults.rows() == [(kind, 1, "a")]


@pytest.mark.parametrize(("lods"), [("2", "3"), ("3", "1")])
def test_a_roof_garden_replaces_no_house(tmp_path, lods):
    city = CityWriter()
    city.add("house", "Building", solid(city, lods[0], 0, 0, 0, (10, 10, 9)))
    garden = solid(city, lods[1], 0, 0, 9, (10, 10, 1))
    city.add("top", "BuildingInstallation", garden, parents=["house"])
    read, found = structures(city.write(tmp_path / "city.json"))
    assert volume(found["house"]) == pytest.approx(1000.0)
    assert read.faults.rows() == []
