"""The road networks of the four maps: numbers, shapes, legal ways."""

from collections import Counter

import numpy as np
import pytest
from shapely.geometry import LineString, Point, Polygon

from worlds.maps import shipped_maps
from worlds.roads import RoadSurface, load_road_network

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
