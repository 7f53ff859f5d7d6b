"""What does not stand on the ground changes no ground, and has an underside."""

import csv

from helpers.imported_cities import bounds, read_city, volume
from helpers.small_cityjson import CityWriter
from helpers.small_opendrive import cubic, straight, write_roads
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
import yaml

from worlds.imports import ImportOptions, import_city
from worlds.shapes import read_mesh


def ground_of(path, folder, dressed):
    """Returns the vertices of an import's guessed ground, as in its source."""
    import_city(path, folder, ImportOptions(dressed=dressed))
    facts = yaml.safe_load((folder / "import.yaml").read_text())
    mesh = read_mesh(folder / "meshes/ground.obj")
    return mesh.vertices + np.array([0.0, 0.0, (*facts["origin"], 0.0)[2]])


def quarter(add=None):
    osm = OsmWriter()
    osm.way([(-150, -30), (250, -30)], highway="residential")
    for x, y in ((-80, 40), (0, 0), (120, 0), (60, 70)):
        osm.box(x, y, 10, 10, building="yes", height="9")
    if add is not None:
        add(osm)
    return osm


def box(**tags):
    return lambda osm: osm.box(50, 0, 20, 10, **tags)


@pytest.mark.parametrize("dressed", [False, True])
@pytest.mark.parametrize(
    "add",
    [
        box(building="roof", height="5.5"),
        box(building="carport"),
        box(building="yes", wall="no"),
        box(building="yes", height="7", min_height="4"),
        box(building="yes", height="7", building__min_level="1"),
        box(building__part="yes", height="20", min_height="10"),
        box(building="yes", location="underground"),
        box(building="yes", layer="-1"),
        box(amenity="parking", parking="underground"),
        box(amenity="parking", parking="multi-storey"),
        box(amenity="parking", location="underground"),
        box(amenity="parking", layer="-2"),
        box(natural="water", tunnel="culvert"),
        lambda osm: osm.way(
            [(50, 0), (70, 0)], barrier="fence", min_height="3", height="4"
        ),
        lambda osm: osm.way(
            [(60, -31), (60, 50)], highway="tertiary", bridge="yes", layer="1"
        ),
        lambda osm: osm.way(
            [(60, -60), (60, 0)], highway="tertiary", tunnel="yes"
        ),
    ],
)  # fmt: skip
def test_the_ground_of_openstreetmap_is_level(tmp_path, add, dressed):
    without, with_it = (
        ground_of(osm.write(tmp_path / f"{k}.osm"), tmp_path / k, dressed)
        for k, osm in (("a", quarter()), ("b", quarter(add)))
    )
    np.testing.assert_array_equal(with_it, without)


def town(kind=None, z=0.0, lowest="WallSurface", **terrain):
    city = CityWriter()
    for k, (x, y) in enumerate([(0, 0), (80, 0), (0, 60), (80, 60)]):
        city.box(f"house_{k}", x, y, (12, 9, 8), z=0.02 * x)
    if terrain:
        slope = [(x, y, 0.02 * x) for x, y in ((-9, -9), (99, -9), (99, 79))]
        land = {"type": "MultiSurface", "lod": "1", "boundaries": [
            [city.ring(slope)],
            [city.ring([slope[0], slope[2], (-9, 79, -0.18)])],
        ]}  # fmt: skip
        city.add("land", "TINRelief", land)
    if kind is not None:
        city.box("more", 40, 30, (12, 9, 2), z=z, kind=kind)
        semantics = city.objects["more"]["geometry"][0]["semantics"]
        semantics["surfaces"][0]["type"] = lowest
    return city


@pytest.mark.parametrize(
    ("kind", "z", "lowest"),
    [
        ("Bridge", 6.0, "GroundSurface"),
        ("Tunnel", -7.0, "GroundSurface"),
        ("Building", 5.5, "OuterCeilingSurface"),
        ("BuildingPart", 5.5, "OuterFloorSurface"),
        ("OtherConstruction", 4.0, "RoofSurface"),
    ],
)
def test_the_ground_of_cityjson_is_that_of_what_stands_on_it(
    tmp_path, kind, z, lowest
):
    without, with_it = (
        ground_of(city.write(tmp_path / f"{k}.city.json"), tmp_path / k, False)
        for k, city in (("a", town()), ("b", town(kind, z, lowest)))
    )
    np.testing.assert_allclose(with_it, without, atol=1e-9)


@pytest.mark.parametrize(
    ("z", "base"),
    [(6.0, "RAISED"), (0.9, "GROUND"), (-1.0, "GROUND"), (-9.0, "UNDERGROUND")],
)
def test_terrain_shows_what_stands_on_it(tmp_path, z, base):
    city = town("Building", z, "GroundSurface", terrain=True)
    read = read_city(city.write(tmp_path / "a.city.json"))
    bases = {one.structure.name: one.base.name for one in read.objects}
    assert bases == {"more": base} | {
        name: "GROUND" for name in bases if name != "more"
    }


@pytest.mark.parametrize("z", [-12.0, 0.0, 7.0, 300.0])
@pytest.mark.parametrize(
    ("shape", "area"),
    [
        ('length="2" width="12" height="1"/>', 24),
        (
            '><outline><cornerLocal u="-4" v="-8" z="0" height="1"/>'
            '<cornerLocal u="4" v="-8" z="0" height="1"/>'
            '<cornerLocal u="4" v="8" z="0" height="1"/></outline></object>',
            64,
        ),
        (
            'height="1"><outline><cornerLocal u="0" v="0" z="2" height="1"/>'
            '<cornerLocal u="4" v="0" z="2" height="1"/>'
            '<cornerLocal u="4" v="8" z="2" height="1"/></outline></object>',
            16,
        ),
        (
            'height="1"><outline><cornerRoad s="50" t="0" dz="5" height="1"/>'
            '<cornerRoad s="54" t="0" dz="5" height="1"/>'
            '<cornerRoad s="54" t="3" dz="5" height="1"/></outline></object>',
            6,
        ),
    ],
    ids=["box", "outline", "raised corners", "outline on the road"],
)
def test_raised_objects_of_opendrive_are_closed(tmp_path, z, shape, area):
    element = f'<object id="1" s="50" t="0" zOffset="5" hdg="0" {shape}'
    level = {"elevation": cubic("elevation", 0.0, z, key="s")}
    names = {}
    for name, more in (("a", ""), ("b", f"<objects>{element}</objects>")):
        path = tmp_path / f"{name}.xodr"
        write_roads(path, straight("r", 0, 0, 120, 0, more=more, **level))
        import_city(path, tmp_path / name, ImportOptions(dressed=False))
        names[name] = {p.name for p in (tmp_path / name / "meshes").iterdir()}
    (mesh,) = (p for p in names["b"] if p.startswith("object_"))
    mesh = read_mesh(tmp_path / "b/meshes" / mesh)
    assert volume(mesh.vertices[mesh.triangles()]) == pytest.approx(area)
    rise = 7.0 if 'z="2"' in shape else 5.0
    assert mesh.vertices[:, 2].min() == pytest.approx(z + rise)
    # The roads are as they were.
    for name in names["a"] & names["b"]:
        if name.startswith(("road", "carriageway", "street")):
            same = [tmp_path / k / "meshes" / name for k in "ab"]
            assert same[0].read_bytes() == same[1].read_bytes()


@pytest.mark.parametrize(
    "tags",
    [
        {"building": "yes", "min_height": "4"},
        {"building": "roof"},
        {"building__part": "yes", "min_height": "10"},
    ],
)
def test_raised_buildings_of_openstreetmap_are_closed(tmp_path, tags):
    osm = quarter(box(height="20", **tags))
    city = read_city(osm.write(tmp_path / "a.osm"))
    (raised,) = (one for one in city.objects if one.base.name == "RAISED")
    low, high = bounds(raised)
    assert volume(raised.triangles) == pytest.approx(
        np.prod(high - low), rel=1e-3
    )


@pytest.mark.parametrize(("above", "bridges"), [(2.9, 0), (3.0, 1), (3.1, 1)])
@pytest.mark.parametrize("z", [0.0, 0.1, 101.3])
def test_a_road_with_the_headroom_is_a_bridge(tmp_path, above, bridges, z):
    path = write_roads(
        tmp_path / "a.xodr",
        *(
            straight(name, *ends, elevation=cubic("elevation", 0.0, h, key="s"))
            for name, ends, h in (
                ("low", (-80, 0, 80, 0), z),
                ("high", (0, -80, 0, 80), z + above),
            )
        ),
    )
    report = import_city(path, tmp_path / "a", ImportOptions(dressed=False))
    assert report.kinds.get("bridges", 0) == bridges


@pytest.mark.parametrize("dressed", [False, True])
def test_each_structure_has_an_origin(tmp_path, dressed):
    path = quarter().write(tmp_path / "a.osm")
    import_city(path, tmp_path / "a", ImportOptions(dressed=dressed))
    with (tmp_path / "a/structures.csv").open() as file:
        origins = {row["name"]: row["origin"] for row in csv.DictReader(file)}
    assert origins["ground"] == "guess"
    assert set(origins.values()) >= {"guess", "file"}
