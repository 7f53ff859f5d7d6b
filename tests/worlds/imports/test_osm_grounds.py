"""Grounds, the sea, bridges and tunnels of OpenStreetMap."""

from helpers.imported_cities import read_city
from helpers.small_osm import OsmWriter
import numpy as np
import pytest

from worlds.imports import ImportOptions, import_city


def read(osm, folder, dressed=True):
    path = osm.write(folder / "city.osm")
    return read_city(path, dressed=dressed)


def area(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def kinds(city):
    return {one.structure.name: one.object_type for one in city.objects}


@pytest.mark.parametrize(
    ("tags", "kind", "plain"),
    [({"natural": "sand"}, "Sand", None),
     ({"leisure": "pitch"}, "Pitch", "LandUse"),
     ({"leisure": "playground"}, "Playground", "LandUse"),
     ({"landuse": "basin"}, "WaterBody", None),
     ({"highway": "footway", "area": "yes"}, "Square", None),
     ({"highway": "footway"}, None, None),
     ({"highway": "pedestrian"}, None, None),
     ({"highway": "pedestrian", "area": "yes"}, "Square", "Square"),
     ({"highway": "pedestrian", "place": "square"}, "Square", "Square"),
     ({"highway": "platform"}, "Square", None),
     ({"amenity": "parking"}, "Parking", "Parking"),
     ({"amenity": "parking", "parking": "underground"}, None, None),
     ({"natural": "water", "layer": "-1"}, None, None),
     ({"landuse": "grass"}, "LandUse", "LandUse")],
)  # fmt: skip
def test_grounds_by_what_they_are_made_of(tmp_path, tags, kind, plain):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    name = f"land_w{osm.box(20, 0, 30, 20, **tags)}"
    dressed, bare = read(osm, tmp_path), read(osm, tmp_path, dressed=False)
    assert kinds(dressed).get(name) == kind
    assert kinds(bare).get(name) == plain
    for one in dressed.objects:
        if one.structure.name == name:
            assert area(one) == pytest.approx(600.0, abs=1.0)
            assert (one.triangles[:, :, 2] < 0.0).all()


@pytest.mark.parametrize(
    ("building", "land", "expected"),
    [
        ({"building": "chapel"}, {"leisure": "park"}, ["church", "park"]),
        (
            {"building": "yes", "amenity": "place_of_worship"},
            {"landuse": "cemetery"},
            ["church", "cemetery"],
        ),
        (
            {"building": "public", "amenity": "townhall"},
            {"natural": "water"},
            ["town_hall", "water_body"],
        ),
        (
            {"building": "yes", "amenity": "cafe"},
            {"landuse": "grass"},
            ["building", "grass"],
        ),
        (
            {"building": "Row House"},
            {"amenity": "parking"},
            ["row_house", "parking"],
        ),
    ],
)
def test_kinds_are_those_of_the_tags(tmp_path, building, land, expected):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, **building)
    osm.box(20, 0, 30, 20, **land)
    for dressed in (False, True):
        found = read(osm, tmp_path, dressed).objects
        assert [one.structure.kind for one in found] == expected


def test_a_multipolygon_of_a_path_is_an_area(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    outer, inner = osm.box(20, 0, 30, 20), osm.box(30, 5, 10, 10)
    square = osm.relation(
        {"outer": [outer], "inner": [inner]},
        type="multipolygon",
        highway="pedestrian",
    )
    (one,) = (
        o for o in read(osm, tmp_path).objects if o.object_type == "Square"
    )
    assert one.structure.name == f"land_r{square}"
    assert area(one) == pytest.approx(500.0, abs=1.0)


def test_the_ground_looks_upwards(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    osm.box(20, 0, 30, 20, landuse="grass")
    crossing = osm.node(0, -20, highway="crossing", crossing="zebra")
    ends = osm.node(-50, -20), osm.node(50, -20)
    osm.way_of(
        [ends[0], crossing, ends[1]], highway="tertiary", sidewalk="both"
    )
    surfaces = [
        o
        for o in read(osm, tmp_path).objects
        if o.is_ground or o.object_type == "Sidewalk"
    ]
    assert {o.object_type for o in surfaces} == {
        "LandUse", "Road", "Sidewalk", "Crossing"
    }  # fmt: skip
    for one in surfaces:
        a, b, c = np.moveaxis(one.triangles, 1, 0)
        assert (np.cross(b - a, c - a)[:, 2] > 0.0).all(), one.object_type


def test_a_pitch_has_the_colour_of_its_surface(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    lawn = osm.box(20, 0, 9, 9, leisure="pitch", sport="soccer")
    hard = osm.box(40, 0, 9, 9, leisure="pitch", sport="basketball")
    found = {o.structure.name: o for o in read(osm, tmp_path).objects}
    assert found[f"land_w{lawn}"].structure.semantic_class == "terrain"
    assert found[f"land_w{hard}"].structure.semantic_class == "other-ground"


@pytest.mark.parametrize("is_eastward", [True, False])
def test_the_sea_lies_right_of_the_coast(tmp_path, is_eastward):
    osm = OsmWriter()
    osm.box(-50, -50, 10, 10, building="yes")
    osm.box(40, 40, 10, 10, building="yes")
    # The coastline ends within the city, where the file was cut.
    line = [(-30, 0), (0, 0), (70, 0)]
    osm.way(line if is_eastward else line[::-1], natural="coastline")
    # A coastline without length has no effect.
    osm.way([(10, 30), (10, 30)], natural="coastline")
    # An island has the land inside its coastline.
    island = [(0, -60), (20, -60), (20, -40), (0, -40)]
    osm.way(island, closed=True, natural="coastline")
    city = read(osm, tmp_path)
    (sea,) = (o for o in city.objects if o.structure.name[:4] == "sea_")
    half = 220.0 * 110.0
    expected = half - 400.0 if is_eastward else half
    assert area(sea) == pytest.approx(expected, rel=0.01)
    y = sea.triangles[:, :, 1].mean()
    assert bool(y < 0.0) is is_eastward
    assert not any("coastline" in kind for kind, _, _ in city.faults.rows())


NO_RAMPS = "bridge over a way, built without ramps and without drives on it"


@pytest.mark.parametrize("dressed", [True, False])
def test_bridges_over_ways_are_decks_and_others_level(tmp_path, dressed):
    osm = OsmWriter()
    osm.box(-60, 20, 10, 10, building="yes")
    below = [osm.node(0, -80), osm.node(0, 80)]
    osm.way_of(below, highway="residential", width="8")
    over = [osm.node(-40, 0), osm.node(40, 0)]
    tags = {"highway": "primary", "width": "10", "sidewalk": "left"}
    over = osm.way_of(over, **tags, bridge="yes")
    level = [osm.node(60, -30), osm.node(60, 30)]
    level = osm.way_of(level, highway="primary", width="10", bridge="yes")
    under = [osm.node(-90, -50), osm.node(-60, -50)]
    under = osm.way_of(under, highway="primary", tunnel="yes", layer="-1")
    city = read(osm, tmp_path, dressed)
    found = {one.structure.name: one for one in city.objects}
    assert f"road_w{over}" not in found
    assert f"w{over}" not in {street.name for street in city.streets}
    faults = {kind: number for kind, number, _ in city.faults.rows()}
    assert faults[NO_RAMPS] == 1
    assert faults["tunnel, left out"] == 1
    assert not any(kind.startswith("highway=") for kind in faults)
    # 0.2 m beside a carriageway of 10 m, 0.25 m thick.
    wall = found[f"parapet_w{level}"].triangles
    x = wall[:, :, 0] - city.streets[-1].line[0, 0]
    assert np.abs(x).min() == pytest.approx(5.075, abs=0.02)
    assert wall[:, :, 2].max() == pytest.approx(1.0)
    # A car passes below the deck, which is no ground, and stays on its street.
    deck = found[f"bridge_w{over}"]
    assert not deck.is_ground
    low, high = deck.triangles.min(axis=(0, 1)), deck.triangles.max(axis=(0, 1))
    np.testing.assert_allclose(high - low, (80, 12, 1), atol=0.05)
    assert low[2] == 5.0
    wall = found[f"parapet_w{over}"].triangles
    assert (wall[:, :, 2].min(), wall[:, :, 2].max()) == (6.0, 7.0)
    assert np.ptp(wall[:, :, 1]) == pytest.approx(12 + 2 * 0.325, abs=0.05)


@pytest.mark.parametrize(
    ("layers", "upper"),
    [
        (("1", "2"), 1),
        (("2", "1"), 0),
        # A bridge is in layer 1 if its tags do not say otherwise.
        ((None, "2"), 1),
        (("0", None), 1),
        (("-1", "-2"), 0),
        (("1", "1"), None),
    ],
)
def test_the_upper_one_of_two_bridges_is_a_deck(tmp_path, layers, upper):
    osm = OsmWriter()
    osm.box(-60, 20, 10, 10, building="yes")
    names = []
    for line, layer in zip(
        ([(-40, 0), (40, 0)], [(0, -40), (0, 40)]), layers, strict=True
    ):
        tags = {"layer": layer} if layer is not None else {}
        names.append(osm.way(line, highway="primary", bridge="yes", **tags))
    city = read(osm, tmp_path)
    built = {
        o.structure.name for o in city.objects if o.object_type != "Building"
    }
    (out,) = (n for n in names if f"road_w{n}" not in built)
    assert upper is None or out == names[upper]
    names.remove(out)
    assert built == {
        f"road_w{names[0]}", f"parapet_w{names[0]}",
        f"bridge_w{out}", f"parapet_w{out}",
    }  # fmt: skip
    assert (NO_RAMPS, 1, f"w{out}") in city.faults.rows()


def test_each_of_three_bridges_that_cross_lies_above_those_below(tmp_path):
    osm = OsmWriter()
    osm.box(-60, 20, 10, 10, building="yes")
    osm.way([(-40, -40), (40, 40)], highway="primary")
    names = [
        osm.way(line, highway="footway", bridge="yes", layer=str(layer))
        for line, layer in (
            ([(-40, 0), (40, 0)], 3),
            ([(0, -40), (0, 40)], 1),
            ([(-40, 40), (40, -40)], 2),
        )
    ]
    found = {
        one.structure.name: one.triangles[:, :, 2].max()
        for one in read(osm, tmp_path).objects
    }
    assert [found[f"bridge_w{name}"] for name in names] == [18.0, 6.0, 12.0]


def test_a_drive_passes_below_a_bridge(tmp_path):
    def drives(name, **more):
        osm = OsmWriter()
        osm.box(-60, 20, 10, 10, building="yes")
        osm.way([(-200, 0), (200, 0)], highway="residential")
        osm.way([(0, -60), (0, 60)], **more)
        path = osm.write(tmp_path / f"{name}.osm")
        options = ImportOptions(dressed=False)
        return import_city(path, tmp_path / name, options).drives

    plain = drives("plain", power="line")
    assert plain[0] > 300.0
    assert drives("below", highway="primary", bridge="yes") == plain
