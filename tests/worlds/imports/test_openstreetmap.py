"""Imports of OpenStreetMap files that are written here."""

import re

from helpers.imported_cities import bounds, import_osm, read_city, volume
from helpers.small_osm import LAT, LON, OsmWriter
import numpy as np
import pytest

from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city

BOMB = """<?xml version="1.0"?>
<!DOCTYPE osm [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>
<osm version="0.6"><node id="1" lat="0" lon="0"><tag k="b" v="&b;"/></node>
</osm>"""


def test_buildings_have_places_and_heights_of_the_file(tmp_path):
    osm = OsmWriter()
    first = osm.box(-100, -50, 20, 10, building="yes", height="12.5 m")
    last = osm.box(80, 40, 20, 10, building="house", start_date="1910")
    city, found = import_osm(osm.write(tmp_path / "city.osm"))
    assert city.origin == (LAT, LON)
    low, high = bounds(found[f"building_w{first}"])
    # The origin is rounded to a millionth of a degree.
    np.testing.assert_allclose(low, [-100, -50, 0], atol=0.06)
    np.testing.assert_allclose(high, [-80, -40, 12.5], atol=0.06)
    assert bounds(found[f"building_w{last}"])[1][2] == 6.0
    assert found[f"building_w{last}"].year == 1910
    assert found[f"building_w{first}"].year is None


def test_a_building_with_parts_is_what_these_are(tmp_path):
    osm = OsmWriter()
    outline = osm.box(0, 0, 20, 20, building="yes", height="50")
    osm.box(0, 0, 10, 20, building__part="yes", height="10")
    osm.box(10, 0, 10, 20, building__part="yes", height="20", min_height="5")
    _, found = import_osm(osm.write(tmp_path / "city.osm"))
    (one,) = found.values()
    assert one.structure.name == f"building_w{outline}"
    assert bounds(one)[1][2] == 20.0
    # The height is not the outline's 50 m, and the raised part has an
    # underside.
    expected = 200.0 * 10.0 + 200.0 * 15.0
    assert volume(one.triangles) == pytest.approx(expected, rel=1e-3)


def test_only_buildings_lack_a_year(tmp_path):
    osm = OsmWriter()
    osm.box(0, 20, 20, 10, building="yes", start_date="1999-04")
    osm.box(40, 20, 20, 10, building="yes")
    osm.way([(-150, 0), (150, 0)], highway="residential")
    osm.node(9, 12, natural="tree")
    report = import_city(
        osm.write(tmp_path / "a.osm"),
        tmp_path / "town",
        ImportOptions(years=(1980, 1995, 2020), undated="last"),
    )
    assert report.undated == 1
    first, second, third = report.stages.values()
    assert (second - first, third - second) == (0, 2)


def test_streets_have_width_and_sidewalks(tmp_path):
    osm = OsmWriter()
    osm.box(-60, 20, 120, 10, building="yes")
    line = [(-50, 0), (50, 0)]
    road = osm.way(line, highway="tertiary", lanes="2", sidewalk="left")
    osm.way([(0, -50), (0, 15)], highway="footway", width="3")
    osm.way([(-50, 8), (50, 8)], highway="primary", tunnel="yes")
    osm.way([(-50, 9), (50, 9)], railway="rail")
    _, found = import_osm(osm.write(tmp_path / "city.osm"))
    kinds = {one.object_type for one in found.values()}
    assert kinds == {"Building", "Road", "Sidewalk"}
    low, high = bounds(found[f"road_w{road}"])
    assert high[1] - low[1] == pytest.approx(6.5, abs=0.01)
    middle = (high[1] + low[1]) / 2
    strip_low, strip_high = bounds(found[f"walk_w{road}_l"])
    assert strip_low[1] == pytest.approx(middle + 3.25, abs=0.01)
    assert strip_high[1] == pytest.approx(middle + 5.25, abs=0.01)
    # A path ends at the street that it crosses.
    (path,) = (
        one
        for name, one in found.items()
        if one.object_type == "Sidewalk" and not name.endswith("_l")
    )
    xy = path.triangles.reshape(-1, 3)[:, 1] - middle
    assert not ((xy > -3.2) & (xy < 3.2)).any()


def test_trees_water_and_hedges(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    number = osm.node(30, 30, natural="tree", height="9")
    water = osm.box(40, 0, 10, 10, natural="water")
    hedge = osm.way([(-30, 0), (-30, 20)], barrier="hedge", height="1.5")
    _, found = import_osm(osm.write(tmp_path / "city.osm"))
    tree = found[f"tree_n{number}"].structure
    assert tree.semantic_class == "vegetation"
    tops = [
        tree.model.meshes[part.shape.mesh].vertices[:, 2].max()
        * part.shape.scale[2]
        for part in tree.model.parts
    ]
    assert max(tops) == pytest.approx(9.0, abs=0.02)
    assert found[f"land_w{water}"].object_type == "WaterBody"
    assert bounds(found[f"hedge_w{hedge}"])[1][2] == 1.5


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "city.osm: "),
        ("<osm", "city.osm: "),
        ('<osm version="0.6"></osm>', "the file has no buildings"),
        (BOMB, "city.osm: "),
        ("\x00\x01", "city.osm: "),
    ],
)
def test_files_that_are_none(tmp_path, text, fault):
    path = tmp_path / "city.osm"
    path.write_text(text)
    with pytest.raises(InputError) as info:
        read_city(path)
    assert fault in str(info.value)
    assert "\n" not in str(info.value)


def building_of(*places):
    """Returns a file with one building, a closed line through places."""
    nodes = "".join(
        f'<node id="{k + 1}" version="1" lat="{lat}" lon="{lon}"/>'
        for k, (lat, lon) in enumerate(places)
    )
    refs = [*range(1, len(places) + 1), 1]
    return (
        f'<osm version="0.6">{nodes}<way id="9" version="1">'
        + "".join(f'<nd ref="{k}"/>' for k in refs)
        + '<tag k="building" v="yes"/></way></osm>'
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (building_of((0, 0), (0, 0), (0, 0)), "without area"),
        (building_of((52, 13), (52.001, 13), (52.002, 13)), "without area"),
        (
            building_of((52, 13), (52.0000001, 13), (52.0000001, 13.0000001)),
            "without area",
        ),
        (
            building_of((52, 13), (52.001, 13)).replace(
                '<nd ref="1"/><tag', "<tag"
            ), "building whose outline does not close, left out",
        ),
        (
            building_of((52, 13), (52.001, 13.001), (52, 13.001), (52.001, 13)),
            "building whose outline crosses itself, left out",
        ),
        (
            building_of((52, 13), (52.001, 13), (52.001, 13.001)).replace(
                "</way>", '<tag k="layer" v="-1"/></way>'
            ),
            "underground building, left out",
        ),
    ],
)  # fmt: skip
def test_why_no_building_is_usable_is_said(tmp_path, text, fault):
    path = tmp_path / "city.osm"
    path.write_text(text)
    with pytest.raises(InputError) as info:
        read_city(path)
    message = str(info.value)
    assert message.startswith(f"{path}: the file has no usable building; ")
    assert fault in message
    assert message.endswith(", left out: 1, such as w9")


@pytest.mark.parametrize(
    "houses",
    [[(179.999, -16.8), (-179.999, -16.8)], [(13.0, 52.0), (13.002, 52.0)]],
)
def test_a_town_on_both_sides_of_the_180th_meridian(tmp_path, houses):
    """Two houses 0.002 deg apart have the same distance as elsewhere."""
    nodes, ways = [], []
    for k, (x, y) in enumerate(houses):
        corners = [(0, 0), (2e-4, 0), (2e-4, 2e-4), (0, 2e-4)]
        first = 10 * k + 1
        nodes += [
            f'<node id="{first + i}" version="1" lon="{x + dx:.6f}"'
            f' lat="{y + dy:.6f}"/>'
            for i, (dx, dy) in enumerate(corners)
        ]
        refs = "".join(f'<nd ref="{first + i}"/>' for i in (0, 1, 2, 3, 0))
        ways.append(
            f'<way id="{k + 1}" version="1">{refs}'
            '<tag k="building" v="yes"/></way>'
        )
    path = tmp_path / "city.osm"
    path.write_text(f'<osm version="0.6">{"".join(nodes + ways)}</osm>')
    city = read_city(path)
    x, y = np.sort(
        [one.triangles[:, :, :2].mean(axis=(0, 1)) for one in city.objects],
        axis=0,
    ).T
    metres = 111_320.0 * np.cos(np.radians(houses[0][1]))
    assert x[1] - x[0] == pytest.approx(0.002 * metres, rel=0.003)
    assert x[0] + x[1] == pytest.approx(0.0, abs=0.1)
    assert np.abs(y).max() < 0.1


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_city(tmp_path / "none.osm")


def test_objects_cut_off_at_the_edge_are_noted(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    street = osm.way([(0, 20), (40, 20), (80, 20)], highway="residential")
    house = osm.box(20, 0, 10, 10, building="yes")
    inner = osm.box(50, 0, 9, 9)
    open_ = osm.relation({"outer": [99]}, type="multipolygon", building="yes")
    osm.relation({"outer": [inner]}, type="multipolygon", landuse="grass")
    path = osm.write(tmp_path / "city.osm")
    # The last place of the street and a corner of the house are elsewhere.
    text = path.read_text()
    for way, place in ((street, -1), (house, 1)):
        refs = re.search(rf'<way id="{way}".*?</way>', text)[0]
        node = re.findall(r'ref="(\d+)"', refs)[place]
        text = re.sub(rf'<node id="{node}".*\n', "", text)
    path.write_text(text)
    city, _ = import_osm(path)
    assert sorted(city.faults.rows()) == [
        (
            "building whose outline does not close or crosses itself, left out",
            1,
            f"r{open_}",
        ),
        ("building whose outline does not close, left out", 1, f"w{house}"),
        ("place of a way that is not in the file, left out", 1, f"w{street}"),
    ]


def test_a_place_off_the_globe_is_named(tmp_path):
    osm = OsmWriter()
    street = osm.way([(0, 20), (40, 20), (80, 20)], highway="residential")
    osm.box(0, 0, 10, 10, building="yes")
    path = osm.write(tmp_path / "city.osm")
    text = path.read_text()
    refs = re.search(rf'<way id="{street}".*?</way>', text)[0]
    node = re.findall(r'ref="(\d+)"', refs)[-1]
    path.write_text(
        re.sub(rf'(<node id="{node}" .*?lat=)"[^"]*"', r'\1"152.5"', text)
    )
    city, _ = import_osm(path)
    assert city.faults.rows() == [
        ("place of a way off the globe, left out", 1, f"w{street}")
    ]


def height_above(one, x, y):
    """Returns the intervals of a solid above a place, from its faces [m]."""
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    p = np.array([x, y])
    u, v, w = (q[:, :2] - p for q in (a, b, c))
    cross = lambda s, t: s[:, 0] * t[:, 1] - s[:, 1] * t[:, 0]  # noqa: E731
    sides = np.stack([cross(u, v), cross(v, w), cross(w, u)])
    area = sides.sum(axis=0)
    inside = ((sides > 0).all(axis=0) | (sides < 0).all(axis=0)) & (
        np.abs(area) > 1e-9
    )
    z = (
        sides[1] * a[:, 2] + sides[2] * b[:, 2] + sides[0] * c[:, 2]
    ) / np.where(inside, area, 1.0)
    return sorted(np.round(z[inside], 3).tolist())


def test_a_part_takes_the_place_of_what_it_covers(tmp_path):
    osm = OsmWriter()
    # Another house puts the origin between the two.
    osm.box(-60, -10, 20, 20, building="yes", height="6")
    tower = osm.box(20, -10, 40, 20, building="yes", height="30")
    osm.box(20, -10, 10, 20, building__part="yes", height="40",
            min_height="30")  # fmt: skip
    porch = osm.box(20, 40, 40, 20, building="yes", height="10")
    osm.box(20, 40, 40, 10, building__part="yes", height="9")
    osm.box(20, 50, 40, 10, building__part="yes", height="8", min_height="4")
    # The origin is the middle: (0, 25).
    city, found = import_osm(osm.write(tmp_path / "city.osm"))
    guessed = [row for row in city.faults.rows() if "parts for some" in row[0]]
    assert [(number, name) for _, number, name in guessed] == [(1, f"w{tower}")]
    one = found[f"building_w{tower}"]
    # The block below the part stands, and the rest of the outline.
    assert height_above(one, 25.0, -25.0) == [30.0, 30.0, 40.0]
    assert height_above(one, 45.0, -25.0) == [30.0]
    expected = 30.0 * 800 + 10.0 * 200
    assert volume(one.triangles) == pytest.approx(expected, rel=2e-3)
    # If parts make up the whole building, the room below an overhang is free.
    one = found[f"building_w{porch}"]
    assert height_above(one, 40.0, 20.0) == [9.0]
    assert height_above(one, 40.0, 30.0) == [4.0, 8.0]


def test_what_has_no_place_in_the_city_is_counted(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes", name="&#10;[red]x")
    for k in range(3):
        osm.node(20 + k, 0, highway="street_lamp")
    osm.node(30, 0, amenity="bench")
    osm.node(30, 1, natural="tree")
    osm.node(30, 2, addr__housenumber="7")
    osm.node(30, 3, shop="&#10;&#x202e;[bold]" + "x" * 200)
    street = [osm.node(x, 30) for x in (0, 40)]
    street.append(osm.node(80, 30, highway="crossing", crossing="unmarked"))
    osm.way_of(street, highway="residential")
    osm.way([(0, 60), (90, 60)], natural="coastline")
    osm.way([(0, 50), (90, 50)], demolished__railway="rail")
    water = osm.way([(0, 70), (90, 70)], waterway="river")
    osm.relation({"": [water]}, type="waterway", name="a")
    path = osm.write(tmp_path / "city.osm")
    city, _ = import_osm(path)
    counts = {kind: number for kind, number, _ in city.faults.rows()}
    (hostile,) = [kind for kind in counts if kind.startswith("shop=")]
    assert hostile.isprintable()
    assert len(hostile) <= 100
    del counts[hostile]
    assert counts == {
        "highway=street_lamp, left out": 3,
        "amenity=bench, left out": 1,
        "address, left out": 1,
        "highway=crossing, left out": 1,
        "natural=coastline, left out": 1,
        "demolished:railway, left out": 1,
        "waterway=river, left out": 1,
        "relation of type waterway, left out": 1,
    }


def test_tags_that_are_not_read_are_counted(tmp_path):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes", roof__angle="40")
    osm.way([(0, 30), (60, 30)], highway="residential", placement="right_of:1")
    osm.way([(0, 60), (60, 60)], highway="residential", oneway="reversible")
    osm.way([(0, 90), (60, 90)], highway="residential", oneway="-1")
    osm.node(5, 40, natural="tree", diameter_crown="9")
    city, _ = import_osm(osm.write(tmp_path / "a.osm"))
    assert {kind: number for kind, number, _ in city.faults.rows()} == {
        "tag roof:angle of building, not read": 1,
        "tag placement of street, not read": 1,
        "tag oneway of street, not read": 1,
        "tag diameter_crown of tree, not read": 1,
    }


@pytest.mark.parametrize(
    ("tags", "is_there"),
    [
        ({}, True),
        ({"level": "0"}, True),
        ({"indoor": "no"}, True),
        ({"level": "-1"}, False),
        ({"layer": "-2"}, False),
        ({"indoor": "yes"}, False),
        ({"location": "underground"}, False),
    ],
)
def test_things_within_buildings_or_the_ground_are_not_seen(
    tmp_path, tags, is_there
):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    osm.node(20, 20, natural="tree", **tags)
    osm.node(30, 20, amenity="bench", **tags)
    city, found = import_osm(osm.write(tmp_path / "a.osm"))
    assert len(found) == 1 + is_there
    assert len(city.small_objects) == is_there
    kinds = {kind for kind, _, _ in city.faults.rows()}
    assert ("natural=tree, left out" in kinds) == (not is_there)


@pytest.mark.parametrize(
    ("direction", "degrees"),
    [("90", 0), ("E", 0), ("sw", -135), ("NNW", 112.5)],
)
def test_things_face_where_their_tag_says(tmp_path, direction, degrees):
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    osm.node(30, 20, amenity="bench", direction=direction)
    city, _ = import_osm(osm.write(tmp_path / "a.osm"))
    (thing,) = city.small_objects
    turn = np.degrees(thing.yaw) - degrees
    assert turn % 360.0 == pytest.approx(0.0, abs=1e-9)
