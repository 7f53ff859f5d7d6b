"""What does not stand on the ground changes no ground, and has an underside."""

import csv

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter
from helpers.small_opendrive import cubic, straight, write_roads
from helpers.small_osm import OsmWriter
import pytest

from worlds.imports import ImportOptions, import_city


def quarter(add=None):
    osm = OsmWriter()
    osm.way([(-150, -30), (250, -30)], highway="residential")
    for x, y in ((-80, 40), (0, 0), (120, 0), (60, 70)):
        osm.box(x, y, 10, 10, building="yes", height="9")
    if add is not None:
        add(osm)
    return osm


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
