"""Ways that lead through buildings, walls and fences of OpenStreetMap."""

from helpers.imported_cities import read_city
from helpers.small_osm import OsmWriter
import numpy as np
import pytest

HOUSE = {"building": "yes", "height": "12"}


def read(osm, tmp_path, dressed=False):
    """Returns the city, and name -> structure; the origin is 0, 0."""
    for x in (-300, 299):
        for y in (-200, 199):
            osm.box(x, y, 1, 1, building="yes")
    city = read_city(osm.write(tmp_path / "a.osm"), dressed=dressed)
    return city, {one.structure.name: one for one in city.objects}


def faults_of(city):
    return {kind: number for kind, number, _ in city.faults.rows()}


def is_solid(one, place):
    """Whether a place is below one more upper side than undersides."""
    corners = one.triangles - np.array(place, float)
    a, b, c = np.moveaxis(corners[..., :2], 1, 0)
    weights = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=1)
    area = weights.sum(axis=1)
    over = (np.sign(weights) == np.sign(area)[:, None]).all(axis=1)
    over &= np.abs(area) > 1e-6
    height = (weights[over] * corners[over, :, 2]).sum(axis=1) / area[over]
    return np.sign(area[over])[height > 0.0].sum() > 0


def cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def volume(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def gatehouse(way, house=HOUSE, ends=(-10, 10)):
    """A building of 20 x 42 m across a way along y = 0."""
    osm = OsmWriter()
    number = osm.way(
        [(-10, -22), (-10, 20), (10, 20), (10, -22)], closed=True, **house
    )
    west, east = (osm.node(x, 0) for x in ends)
    kind = {"highway": "residential", "width": "7"}
    osm.way_of([osm.node(-100, 0), west], **kind)
    inside = osm.way_of([west, east], **(kind | way))
    osm.way_of([east, osm.node(100, 0)], **kind)
    return osm, number, inside


STREET = {"tunnel": "building_passage"}


@pytest.mark.parametrize(
    ("way", "half", "clear"),
    [
        (STREET, 3.5, 4.5),
        ({"covered": "yes"}, 3.5, 4.5),
        ({"covered": "arcade", "maxheight": "3.2"}, 3.5, 3.2),
        (STREET | {"layer": "0", "width": "4", "maxheight": "30"}, 2.0, 11.6),
        (STREET | {"highway": "footway", "width": "3"}, 1.5, 2.8),
        (STREET | {"highway": "", "railway": "tram"}, 1.75, 5.5),
        (STREET | {"maxheight": "default"}, 3.5, 4.5),
        (STREET | {"level": "0"}, 3.5, 4.5),
    ],
)
def test_a_passage_is_open_up_to_its_height(tmp_path, way, half, clear):
    osm, number, _ = gatehouse(way)
    city, found = read(osm, tmp_path)
    house = found[f"building_w{number}"]
    for x in (-9.99, -5.0, 0.0, 9.99):
        for y in (0.0, half, -half):
            assert not is_solid(house, (x, y, 0.1))
            assert not is_solid(house, (x, y, clear - 0.05))
            assert is_solid(house, (x, y, clear + 0.05))
            assert is_solid(house, (x, y, 11.9))
        for y in (half + 0.4, -half - 0.4):
            assert is_solid(house, (x, y, 0.1))
            assert is_solid(house, (x, y, clear - 0.05))
    whole = 20.0 * 42.0 * 12.0
    opening = 20.0 * 2.0 * (half + 0.25) * clear
    assert volume(house) == pytest.approx(whole - opening, rel=2e-3)
    kinds = " ".join(faults_of(city))
    assert "street into a building" not in kinds
    assert "maxheight" not in kinds


@pytest.mark.parametrize("roof", ["gabled", "pyramidal"])
def test_the_roof_above_a_passage_stays_whole(tmp_path, roof):
    house = HOUSE | {"roof:shape": roof, "roof:height": "4"}
    house = {key.replace(":", "__"): value for key, value in house.items()}
    osm, number, _ = gatehouse(STREET, house)
    _, found = read(osm, tmp_path)
    share = {"gabled": 0.5, "pyramidal": 1 / 3}[roof]
    whole = 20.0 * 42.0 * (8.0 + 4.0 * share)
    opening = 20.0 * 7.5 * 4.5
    one = found[f"building_w{number}"]
    assert volume(one) == pytest.approx(whole - opening, rel=2e-3)


def test_the_street_leads_through(tmp_path):
    osm, _, inside = gatehouse(STREET)
    city, found = read(osm, tmp_path)
    assert f"road_w{inside}" in found
    assert f"w{inside}" in {one.name for one in city.streets}
    # That of a tunnel does not, nor is the building opened.
    for way in ({"tunnel": "yes"}, STREET | {"layer": "-1"}):
        osm, number, inside = gatehouse(way)
        city, found = read(osm, tmp_path, dressed=True)
        assert f"road_w{inside}" not in found
        assert is_solid(found[f"building_w{number}"], (0, 0, 1))
        assert faults_of(city)["tunnel, left out"] == 1


def test_an_area_of_people_leads_through(tmp_path):
    osm = OsmWriter()
    number = osm.box(-10, -20, 20, 40, **HOUSE)
    osm.box(-10, -2, 20, 6, highway="pedestrian", area="yes", covered="yes")
    _, found = read(osm, tmp_path)
    house = found[f"building_w{number}"]
    for x in (-9.9, 0.02, 9.9):
        assert not is_solid(house, (x, 1.013, 1))
        assert not is_solid(house, (x, 3.9, 1))
        assert is_solid(house, (x, -3, 1))
        assert is_solid(house, (x, 1.013, 3))


@pytest.mark.parametrize(
    "way", [{"indoor": "yes"}, {"level": "1"}, {"layer": "-1"}, {"level": "-1"}]
)
def test_what_is_inside_or_on_another_level_opens_nothing(tmp_path, way):
    path = {"highway": "footway", "covered": "yes"} | way
    osm, number, _ = gatehouse(path)
    _, found = read(osm, tmp_path)
    assert is_solid(found[f"building_w{number}"], (0.02, 0.013, 1))


def test_a_courtyard_is_reached_through_both_walls(tmp_path):
    osm = OsmWriter()
    rings = [
        osm.way([(-r, -r), (r, -r), (r, r), (-r, r)], closed=True)
        for r in (20, 10)
    ]
    number = osm.relation(
        {"outer": rings[:1], "inner": rings[1:]}, type="multipolygon", **HOUSE
    )
    osm.way([(-60, 0.5), (60, 0.5)], highway="service", width="3", **STREET)
    _, found = read(osm, tmp_path)
    house = found[f"building_r{number}"]
    for x in (-15, 0, 15):
        assert not is_solid(house, (x, 0.5, 1))
        assert is_solid(house, (x, 0.5, 6)) == (x != 0)
        assert is_solid(house, (x, 15.1, 1))


def test_a_street_that_is_walled_up_is_named(tmp_path):
    osm, number, _ = gatehouse({})
    city, found = read(osm, tmp_path)
    assert is_solid(found[f"building_w{number}"], (0, 0, 1))
    assert faults_of(city)["street into a building without a passage"] == 1
    # Below a part that begins higher up there is room.
    osm, _, _ = gatehouse({}, HOUSE | {"min_height": "5"})
    city, _ = read(osm, tmp_path)
    assert "street into a building" not in " ".join(faults_of(city))


def test_a_building_that_is_too_low_stays_shut(tmp_path):
    osm, number, _ = gatehouse(STREET, {"building": "garage", "height": "2.3"})
    city, found = read(osm, tmp_path)
    assert is_solid(found[f"building_w{number}"], (0, 0, 1))
    kind = "building too low for its passage, not opened"
    assert faults_of(city)[kind] == 1


def test_what_a_passage_only_touches_stays_whole(tmp_path):
    osm, _, _ = gatehouse(STREET)
    beside = osm.box(-9, 20.5, 8, 8, **HOUSE)
    opposite = osm.box(10.1, -22, 8, 42, **HOUSE)
    _, found = read(osm, tmp_path)
    for number, size in ((beside, 64.0), (opposite, 8.0 * 42.0)):
        one = found[f"building_w{number}"]
        assert volume(one) == pytest.approx(size * 12.0, rel=2e-3)


def walled(barrier="wall", split=False, beyond=True, **way):
    """A wall along x = 0, and a way along y = 0 with a node in common."""
    osm = OsmWriter()
    gate = osm.node(0, 0, barrier="gate")
    ends = osm.node(0, -20), osm.node(0, 20)
    number = osm.way_of([ends[0], gate, ends[1]], barrier=barrier, height="2.5")
    tags = {"highway": "residential", "width": "6"} | way
    west, east = osm.node(-100, 0), osm.node(100, 0)
    if split or not beyond:
        osm.way_of([west, gate], **tags)
        if beyond:
            osm.way_of([gate, east], **tags)
    else:
        osm.way_of([west, gate, east], **tags)
    return osm, f"{barrier}_w{number}"


@pytest.mark.parametrize("barrier", ["wall", "fence", "hedge", "city_wall"])
@pytest.mark.parametrize("split", [False, True])
def test_a_wall_is_open_where_a_way_leads_through(tmp_path, barrier, split):
    osm, name = walled(barrier, split)
    city, found = read(osm, tmp_path)
    one = found[name]
    for y in (0.0, 2.9, -2.9):
        assert not is_solid(one, (0, y, 1))
    for y in (3.4, -3.4, 19.0, -19.0):
        assert is_solid(one, (0, y, 1))
    assert faults_of(city)["barrier across a way, opened"] == 1


@pytest.mark.parametrize(
    ("beyond", "way"),
    [
        (False, {}),
        (True, {"bridge": "yes", "layer": "1"}),
        (True, {"tunnel": "yes"}),
        (True, {"highway": "", "power": "line"}),
    ],
)
def test_a_wall_stays_whole_where_no_way_leads_through(tmp_path, beyond, way):
    osm, name = walled(beyond=beyond, **way)
    city, found = read(osm, tmp_path)
    assert is_solid(found[name], (0.02, 0.013, 1))
    assert "barrier across a way, opened" not in faults_of(city)


def test_two_walls_that_meet_at_a_gate_are_open(tmp_path):
    osm = OsmWriter()
    gate, west, east = osm.node(0, 0), osm.node(-50, 0), osm.node(50, 0)
    walls = [
        osm.way_of([osm.node(0, y), gate], barrier="wall") for y in (-20, 20)
    ]
    osm.way_of([west, gate], highway="service", width="3")
    osm.way_of([gate, east], highway="service", width="3")
    _, found = read(osm, tmp_path)
    for number, side in zip(walls, (-1, 1), strict=True):
        assert not is_solid(found[f"wall_w{number}"], (0, side * 1.0, 1))
        assert is_solid(found[f"wall_w{number}"], (0.02, side * 5.0, 1))


@pytest.mark.parametrize("closed", [False, True])
def test_ways_on_one_side_of_a_wall_lead_not_through_it(tmp_path, closed):
    osm = OsmWriter()
    foot = osm.node(0, 0)
    nodes = [osm.node(0, -20), foot, osm.node(0, 20)]
    if closed:
        nodes += [osm.node(20, 20), osm.node(20, -20), nodes[0]]
    number = osm.way_of(nodes, barrier="fence")
    for y in (-20, 20):
        osm.way_of([foot, osm.node(-50, y)], highway="footway")
    _, found = read(osm, tmp_path)
    assert is_solid(found[f"fence_w{number}"], (0.02, 0.013, 1))
    osm.way_of([foot, osm.node(10, 3)], highway="footway")
    _, found = read(osm, tmp_path)
    assert not is_solid(found[f"fence_w{number}"], (0.02, 0.013, 1))


def test_a_way_along_a_wall_does_not_remove_it(tmp_path):
    osm = OsmWriter()
    nodes = [osm.node(x, 0) for x in (-40, 0, 40)]
    number = osm.way_of(nodes, barrier="wall")
    osm.way_of(nodes, highway="footway")
    _, found = read(osm, tmp_path)
    assert is_solid(found[f"wall_w{number}"], (-20.03, 0.02, 1))


def test_a_way_across_a_wall_without_a_common_node_is_named(tmp_path):
    osm = OsmWriter()
    hedge = osm.way([(0, -20), (0, 20)], barrier="hedge")
    osm.way([(-50, 5), (50, 5)], highway="footway", width="2")
    # One that ends in front of it is none.
    osm.way([(-50, -5), (-2, -5)], highway="footway", width="2")
    city, found = read(osm, tmp_path)
    assert is_solid(found[f"hedge_w{hedge}"], (0.02, 5.013, 0.5))
    assert faults_of(city)["way across a barrier, without an opening"] == 1
