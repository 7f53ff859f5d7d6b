"""Where objects stand, as their file, its terrain and other roads say."""

import csv

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter
from helpers.small_opendrive import cubic, straight, write_roads
from helpers.small_osm import OsmWriter
import numpy as np
import pytest

from worlds.imports import ImportOptions, import_city
from worlds.shapes import read_mesh


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


def write_crossing(path, z, above, spans="", reach=25):
    """Writes two roads that cross, at different heights."""
    return write_roads(
        path,
        *(
            straight(
                name, *ends, elevation=cubic("elevation", 0, h, key="s"),
                more=f"<objects>{more}</objects>",
            )
            for name, ends, h, more in (
                ("low", (-reach, 0, reach, 0), z, ""),
                ("high", (0, -reach, 0, reach), z + above, spans),
            )
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("above", "bridges", "merged"),
    [(0.9, 0, 0), (2.9, 0, 1), (3.0, 1, 0), (3.1, 1, 0)],
)
@pytest.mark.parametrize("z", [0.0, 101.3])
@pytest.mark.slow
def test_a_road_with_the_headroom_is_a_bridge(
    tmp_path, above, bridges, merged, z
):
    path = write_crossing(tmp_path / "a.xodr", z, above)
    report = import_city(path, tmp_path / "a", ImportOptions(dressed=False))
    assert report.kinds.get("bridges", 0) == bridges
    kinds = {kind: number for kind, number, _ in report.faults}
    kind = "road 1 to 3 m above another, merged with it"
    assert kinds.get(kind, 0) == merged


@pytest.mark.parametrize(
    ("start", "length", "low"),
    [
        # Over the low road, beside it, over all, and not on the road.
        (10, 30, 0.0), (60, 30, 2.2), (-9, 999, 0.0), (999, 9, 0.0),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_a_bridge_of_the_file_has_room_below(tmp_path, start, length, low):
    span = f'<bridge id="1" s="{start}" length="{length}" type="steel"/>'
    path = write_crossing(tmp_path / "a.xodr", 0.0, 6.0, span, reach=100)
    import_city(path, tmp_path / "a", ImportOptions(dressed=False))
    folder = tmp_path / "a/meshes"
    deck = read_mesh(folder / "bridge_high_road_deck.obj").vertices
    # The road below and its sidewalks are at y = 0, within 16 m of the bridge.
    first, last = np.clip([start - 100, start + length - 100], -100, 100)
    is_there = first < last
    assert deck[:, 1].min() == pytest.approx(
        min(-16.0, first if is_there else 0.0), abs=2.1
    )
    assert deck[:, 1].max() == pytest.approx(
        max(16.0, last if is_there else 0.0), abs=2.1
    )
    grounds = [read_mesh(p).vertices for p in folder.glob("ground_*")]
    below = np.concatenate(grounds)
    near = np.abs(below[:, 1] - (start + length / 2 - 100)) < length / 2 - 5
    if low:
        under = below[near & (np.abs(below[:, 0]) < 3)]
        assert under[:, 2] == pytest.approx(low, abs=0.01)


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
