"""The road networks of the four maps: numbers, shapes, legal ways."""

from collections import Counter

import numpy as np
import pytest
from shapely.geometry import LineString, Point, Polygon

from cns_drake.roads import RoadSurface, load_road_network
from cns_drake.scenarios import shipped_maps

# Figures of CARLA's towns: extents of the centrelines in x and y [m], length
# between junctions and lanes on it [m], junctions by number of arms, lane
# and sidewalk width [m]. Downtown has one arm and one dead end more: a stub
# of 10 m that the original's junction does not count. Riverside's lanes are
# 4 m wide in the original: here two cars pass each other at a greater distance.
FACTS = {
    "riverside": (
        (-0.1, 394.4), (-328.6, 0.0), 2480, 4960, {3: 12}, 4.5, 4.0
    ),
    "suburbia": (
        (-5.5, 191.7), (-304.6, -107.4), 1056, 2112, {3: 8}, 4.0, 4.0
    ),
    "downtown": (
        (-157.5, 243.7), (-202.4, 202.6), 3075, 9024,
        {1: 1, 2: 1, 3: 24, 4: 8, 5: 1}, 3.5, 2.0,
    ),
    "metropolis": (
        (-109.3, 104.7), (-136.0, 63.5), 823, 3108, {3: 8, 4: 1}, 3.5, 6.0
    ),
}  # fmt: skip

# Points read off the towns' centrelines, all round each network.
POINTS = {
    "riverside": [
        (365.4, 0.0), (290.4, 0.0), (209.5, 0.0), (121.1, 0.0), (44.2, 0.0),
        (157.0, -131.4), (268.1, -131.5), (45.8, -328.6), (155.2, -328.6),
        (270.6, -328.6), (366.9, -328.6), (394.3, -267.1), (394.3, -165.3),
        (394.3, -63.0), (125.2, -57.5), (207.2, -57.5), (283.2, -57.5),
        (391.8, -2.7), (157.0, -197.2), (268.1, -197.2), (2.8, -2.4),
        (391.5, -326.1), (0.0, -61.7), (0.0, -163.5), (0.0, -264.7),
        (336.9, -30.6), (336.8, -96.8), (336.8, -163.7), (336.7, -264.3),
        (2.6, -325.3), (90.4, -30.6), (90.4, -96.0), (90.4, -165.0),
        (90.4, -263.8), (156.0, -30.6),
    ],
    "suburbia": [
        (-5.4, -270.8), (-5.4, -224.8), (-5.4, -151.4), (-2.6, -302.3),
        (188.7, -110.3), (19.0, -189.6), (87.9, -189.6), (164.8, -189.6),
        (43.9, -272.9), (43.8, -212.4), (134.1, -214.7), (162.8, -238.9),
        (89.8, -238.9), (149.6, -107.4), (91.6, -107.4), (38.2, -107.4),
        (191.7, -266.8), (191.7, -214.7), (191.7, -151.9), (-2.1, -110.0),
        (188.2, -301.9), (19.6, -304.6), (87.8, -304.5), (149.4, -304.5),
    ],
    "downtown": [
        (119.9, 196.2), (46.2, 198.1), (-67.5, 195.2), (-79.9, 95.2),
        (-79.7, 35.8), (-79.4, -72.7), (223.7, -4.1), (188.8, -3.6),
        (115.3, -2.5), (56.0, -1.6), (117.3, 134.0), (46.0, 135.5),
        (-39.1, 137.4), (-132.4, 126.8), (-147.2, 53.5), (-147.3, -28.2),
        (-147.3, -87.9), (-127.6, -134.4), (-42.4, -133.2), (-0.1, 87.1),
        (1.9, 166.5), (-0.6, -82.4), (-0.1, -154.7), (0.1, -183.6),
        (84.4, 164.8), (82.4, 104.5), (80.1, 39.1), (-115.5, -33.9),
        (201.5, -60.6), (131.9, -60.7), (-35.4, -175.1), (117.4, 74.6),
        (-53.9, 1.1), (-115.4, 1.5), (-154.0, 1.7), (204.6, 202.2),
        (243.7, 137.7), (241.7, 54.0), (239.6, -33.5), (237.6, -115.6),
        (210.5, -185.6), (132.4, -202.0), (50.9, -202.2), (-32.3, -202.4),
        (-80.9, -172.4), (153.0, 179.0), (152.7, 158.0), (151.7, 102.3),
        (150.6, 38.6), (49.6, -132.1), (116.8, -131.2), (166.7, -104.8),
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def networks():
    return {
        name: load_road_network(folder / "roads.yaml")
        for name, folder in shipped_maps().items()
    }


@pytest.fixture(scope="module")
def downtown(networks):
    return networks["downtown"]


@pytest.mark.parametrize("town", FACTS)
def test_a_town_has_the_dimensions_of_its_original(networks, town):
    x, y, length, lane_length, arms, lane_width, sidewalk = FACTS[town]
    network = networks[town]
    roads = network.roads.values()
    lines = np.concatenate(
        [
            road.evaluate(np.linspace(0, road.full_length, 2000))
            for road in roads
        ]
    )
    np.testing.assert_allclose(lines[:, 0].min(), x[0], atol=0.3)
    np.testing.assert_allclose(lines[:, 0].max(), x[1], atol=0.3)
    np.testing.assert_allclose(lines[:, 1].min(), y[0], atol=0.3)
    np.testing.assert_allclose(lines[:, 1].max(), y[1], atol=0.3)
    found = sum(road.length for road in roads)
    # The roundabout's approaches are shorter here: 6 % of Downtown.
    assert found == pytest.approx(length, rel=0.065)
    lanes = sum(road.length * sum(road.lanes.values()) for road in roads)
    assert lanes == pytest.approx(lane_length, rel=0.055)
    found_arms = Counter(len(j.arms) for j in network.junctions.values())
    assert found_arms == arms
    assert {road.lane_width for road in roads} == {lane_width}
    assert {road.sidewalk for road in roads} == {sidewalk}


@pytest.mark.parametrize("town", POINTS)
def test_centrelines_pass_through_the_original_ones(networks, town):
    lines = [
        LineString(road.evaluate(np.arange(0, road.full_length, 0.5))[:, :2])
        for road in networks[town].roads.values()
    ]
    for point in POINTS[town]:
        off = min(line.distance(Point(point)) for line in lines)
        assert off < 0.7, point


@pytest.mark.parametrize("town", FACTS)
def test_every_legal_way_stays_on_the_carriageway(networks, town):
    network = networks[town]
    area = network.areas.lane_area.buffer(0.02)
    for junction in network.junctions:
        for way in network.connections(junction):
            swept = LineString(way.points[:, :2]).buffer(1.0, cap_style="flat")
            assert area.contains(swept), way


@pytest.mark.parametrize("town", FACTS)
def test_every_lane_comes_from_somewhere_and_leads_on(networks, town):
    network = networks[town]
    ways = [
        way
        for junction in network.junctions
        for way in network.connections(junction)
    ]
    reached = {way.outgoing for way in ways}
    left = {way.incoming for way in ways}
    for lane in network.lanes():
        # Only the stub in Downtown ends.
        if lane.road == "bulge_dead_end":
            continue
        assert lane in left, lane
        assert lane in reached, lane


@pytest.mark.parametrize("town", FACTS)
def test_streets_are_one_piece_and_sidewalks_line_them(networks, town):
    network = networks[town]
    (carriageway,) = network.areas.carriageway.geoms
    assert carriageway.is_valid
    assert network.areas.sidewalks.intersection(carriageway).area < 1e-6
    # The area has no slit, and no island too small for a sign.
    filled = carriageway.buffer(0.2, join_style="mitre").buffer(
        -0.2, join_style="mitre"
    )
    assert filled.difference(carriageway.buffer(0.01)).area < 1e-3
    assert all(Polygon(hole).area > 5 for hole in carriageway.interiors)
    for road in network.roads.values():
        # There is another road beside the roundabout's short ones.
        if road.name.startswith("circle_"):
            continue
        middle = [(road.first_station + road.last_station) / 2]
        for side in (-1, 1):
            offset = side * (road.half_width + road.parking + 0.1)
            x, y = road.evaluate(middle, offset)[0, :2]
            assert network.areas.sidewalks.contains(Point(x, y)), road.name


def test_towns_without_hills_are_flat(networks):
    for town in ("riverside", "suburbia", "metropolis"):
        for road in networks[town].roads.values():
            assert np.all(road.centreline()[:, 2] == 0.0)


def test_speed_limits_are_those_of_the_originals(networks):
    for town in ("riverside", "suburbia"):
        for road in networks[town].roads.values():
            assert road.speed_limit == pytest.approx(25 * 0.44704, abs=0.05)
    limits = Counter()
    for road in networks["downtown"].roads.values():
        limits[round(road.speed_limit / 0.44704)] += 1
    # 55 mph, some 50, and 25 in the close's loop.
    assert limits.keys() == {55, 50, 25}
    assert limits[25] == 1


def test_downtown_rises_where_its_original_does(downtown):
    surface = RoadSurface(downtown)
    # Points of Town03's centrelines with their heights.
    known = [
        (119.9, 196.2, 0.0), (-79.8, 71.5, -0.9), (-79.7, 35.8, -0.4),
        (-79.4, -72.7, 0.8), (188.8, -3.6, 0.0), (117.3, 134.0, 8.0),
        (61.5, 135.2, 7.1), (46.0, 135.5, 4.0), (30.5, 135.9, 1.1),
        (-132.4, 126.8, 0.9), (-147.2, 53.5, 0.1), (-0.1, 87.1, 0.0),
        (82.4, 104.5, 8.0), (117.4, 74.6, 8.0),
        (152.8, 165.7, 2.9), (152.6, 154.2, 5.7), (151.7, 102.3, 8.0),
        (237.6, -115.6, 0.6), (210.5, -185.6, 2.2), (174.0, -200.0, 2.8),
        (132.4, -202.0, 2.0), (50.9, -202.2, 0.2), (116.8, -131.2, 0.3),
    ]  # fmt: skip
    points = np.array(known)
    np.testing.assert_allclose(
        surface.heights(points[:, :2]), points[:, 2], atol=0.5
    )
    # The two southern ramps end 2 m earlier than the original's, so that
    # their junctions are level; the north-western one is less steep.
    ramps = np.array(
        [(80.1, 39.1, 3.3), (150.6, 38.6, 2.9), (84.4, 164.8, 4.7)]
    )
    np.testing.assert_allclose(
        surface.heights(ramps[:, :2]), ramps[:, 2], atol=1.2
    )


def test_ramps_are_smooth(downtown):
    for road in downtown.roads.values():
        stations = np.arange(road.first_station, road.last_station, 0.25)
        z = road.evaluate(stations)[:, 2]
        grade = np.diff(z) / 0.25
        # The original reaches 38 %.
        assert np.abs(grade).max() < 0.27, road.name
        bend = np.diff(grade) / 0.25
        assert np.abs(bend).max() < 0.1, road.name
        # Level where it meets its junctions.
        assert np.abs(grade[[0, -1]]).max() < 0.02, road.name


def test_the_surface_is_level_across_and_continuous_along(downtown):
    surface = RoadSurface(downtown)
    for name in ("ramp_north_west", "bulge_north", "ring_south_east"):
        road = downtown.roads[name]
        stations = np.linspace(road.first_station, road.last_station, 500)
        z = road.evaluate(stations)[:, 2]
        for offset in (0.0, 3.0, -5.0):
            places = road.evaluate(stations, offset)[:, :2]
            np.testing.assert_allclose(
                surface.heights(places), z, atol=2e-3, err_msg=name
            )


def test_the_roundabout_turns_one_way(downtown):
    centre = np.array([-0.5, -0.4])
    ring = [road for name, road in downtown.roads.items() if "circle_" in name]
    ring = [road for road in ring if road.name[-1].isdigit()]
    assert len(ring) == 6
    angles = []
    for road in ring:
        assert road.lanes == {"forward": 2, "backward": 0}
        points = road.evaluate(np.linspace(0, road.full_length, 50))[:, :2]
        radius = np.linalg.norm(points - centre, axis=1)
        np.testing.assert_allclose(radius, 21.7, atol=0.1)
        angles.append(np.unwrap(np.arctan2(*(points - centre).T[::-1])))
    # Traffic on the right goes round once, counter-clockwise.
    assert all(np.all(np.diff(angle) > 0) for angle in angles)
    turn = sum(angle[-1] - angle[0] for angle in angles)
    assert turn == pytest.approx(2 * np.pi, abs=0.01)
    # Routes lead from each avenue to each other one, in legal directions.
    for side in ("north", "east", "south", "west"):
        entry = downtown.roads[f"circle_entry_{side}"]
        leaving = downtown.roads[f"circle_exit_{side}"]
        assert entry.start == leaving.end == f"fork_{side}"
        assert not any(
            way.incoming.road == leaving.name
            and way.outgoing.road == entry.name
            for way in downtown.connections(f"fork_{side}")
        )
        assert any(
            way.incoming.road == entry.name
            and way.outgoing.road.startswith("circle_")
            for way in downtown.connections(entry.end)
        )


def test_downtown_has_its_special_places(downtown):
    five = downtown.junctions["five_ways"]
    assert len(five.arms) == 5
    box = downtown.junction_areas["five_ways"].bounds
    middle = (np.array(box[:2]) + box[2:]) / 2
    np.testing.assert_allclose(middle, [-83.3, -6.7], atol=4.0)
    loop = downtown.roads["close_loop"]
    assert loop.start == loop.end == "loop"
    points = loop.centreline()
    np.testing.assert_allclose(points.mean(axis=0)[:2], [80, -60], atol=3.0)
    # West of x = -100 only the bulge, with two lanes.
    for name in ("bulge_north", "bulge_middle", "bulge_south"):
        assert sum(downtown.roads[name].lanes.values()) == 2
    corners = [
        "grid_north_west",
        "grid_north_east",
        "grid_south_west",
        "grid_south_east",
    ]
    assert [downtown.junctions[name].height for name in corners] == [8.0] * 4
