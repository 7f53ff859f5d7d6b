"""Where objects stand, as their file, its terrain and other roads say."""

import csv

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter
from helpers.small_opendrive import cubic, straight, write_roads
from helpers.small_osm import OsmWriter
import pytest

from worlds.imports import ImportOptions, import_city


@pytest.mark.parametrize(
    ("z", "base"),
    [(6.0, "RAISED"), (0.9, "GROUND"), (-1.0, "GROUND"), (-9.0, "UNDERGROUND")],
)
def test_terrain_shows_what_stands_on_it(tmp_path, z, base):
    city = CityWriter()
    for k, (x, y) in enumerate([(0, 0), (80, 0), (0, 60), (80, 60)]):
        city.box(f"house_{k}", x, y, (12, 9, 8), z=0.02 * x)
    city.box("more", 40, 30, (12, 9, 2), z=z)
    slope = [(x, y, 0.02 * x) for x, y in ((-9, -9), (99, -9), (99, 79))]
    land = {"type": "MultiSurface", "lod": "1", "boundaries": [
        [city.ring(slope)],
        [city.ring([slope[0], slope[2], (-9, 79, -0.18)])],
    ]}  # fmt: skip
    city.add("land", "TINRelief", land)
    read = read_city(city.write(tmp_path / "a.city.json"))
    bases = {one.structure.name: one.base.name for one in read.objects}
    assert bases == dict.fromkeys(bases, "GROUND") | {"more": base}


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
    osm = OsmWriter()
    osm.way([(-150, -30), (250, -30)], highway="residential")
    osm.box(0, 0, 10, 10, building="yes", height="9")
    path = osm.write(tmp_path / "a.osm")
    import_city(path, tmp_path / "a", ImportOptions(dressed=dressed))
    with (tmp_path / "a/structures.csv").open() as file:
        origins = {row["name"]: row["origin"] for row in csv.DictReader(file)}
    assert origins["ground"] == "guess"
    assert set(origins.values()) >= {"guess", "file"}
