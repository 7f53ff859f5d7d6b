"""Road networks: geometry, legality, areas."""

import numpy as np
import pytest
from shapely.geometry import Point

from worlds.shapes import LaneRef


def test_roads_are_cut_back_to_the_kerb_tangents(load, cross):
    network = load(cross)
    # Along e: half of n (3 m) plus the kerb radius. Along n: half of e.
    assert network.roads["e"].first_station == pytest.approx(3 + 6)
    assert network.roads["n"].first_station == pytest.approx(6 + 6)
    # w and s end in the centre: their setback is at the far end.
    road = network.roads["w"]
    assert road.full_length - road.last_station == pytest.approx(9)


def test_a_given_setback_replaces_the_derived_one(load, cross):
    cross["roads"]["e"]["start_setback"] = 20.0
    assert load(cross).roads["e"].first_station == 20.0


def test_lanes_keep_right_and_count_from_the_middle(load, cross):
    road = load(cross).roads["w"]
    # Heading east: forward lanes lie south of the centreline.
    for direction, side in (("forward", -1), ("backward", 1)):
        for lane in (1, 2):
            points = road.lane_centreline(direction, lane)
            expected = side * (lane - 0.5) * 3.0
            np.testing.assert_allclose(points[:, 1], expected, atol=1e-9)
    assert np.all(np.diff(road.lane_centreline("forward", 1)[:, 0]) > 0)
    assert np.all(np.diff(road.lane_centreline("backward", 1)[:, 0]) < 0)
    with pytest.raises(ValueError, match="no lane 3"):
        road.lane_offset("forward", 3)


def test_lanes_leave_room_for_a_median(load, cross):
    cross["roads"]["w"]["median"] = 4.0
    network = load(cross)
    road = network.roads["w"]
    assert road.half_width == 8.0
    assert road.lane_offset("forward", 1) == pytest.approx(-3.5)
    assert road.lane_offset("backward", 2) == pytest.approx(6.5)
    median = network.areas.medians
    assert median.area == pytest.approx(4 * (road.length - 4) + 4 * np.pi, 1e-3)
    # Its noses touch the ends of the road.
    ends = road.evaluate([road.first_station, road.last_station])[:, 0]
    np.testing.assert_allclose(median.bounds, [ends[0], -2, ends[1], 2])
    assert median.intersection(network.areas.carriageway).area < 1e-6


@pytest.mark.parametrize(
    ("lanes", "forward", "backward"),
    [
        ([1, 0], [0.0], []),
        ([2, 0], [1.5, -1.5], []),
        ([2, 1], [0.0, -3.0], [3.0]),
    ],
)
def test_the_centreline_is_the_middle_of_the_carriageway(
    load, cross, lanes, forward, backward
):
    cross["roads"]["w"]["lanes"] = lanes
    road = load(cross).roads["w"]
    assert road.half_width == 1.5 * sum(lanes)
    offsets = {
        direction: [
            road.lane_offset(direction, lane + 1)
            for lane in range(road.lanes[direction])
        ]
        for direction in ("forward", "backward")
    }
    assert offsets == {"forward": forward, "backward": backward}


def test_turns_are_legal_from_and_to_their_own_lanes(load, cross):
    network = load(cross)
    ways = {
        (way.incoming, way.outgoing): way.turn
        for way in network.connections("centre")
    }
    from_west = {k: v for k, v in ways.items() if k[0].road == "w"}
    west = [LaneRef("w", "forward", lane) for lane in (1, 2)]
    assert from_west == {
        (west[0], LaneRef("e", "forward", 1)): "straight",
        (west[1], LaneRef("e", "forward", 2)): "straight",
        (west[0], LaneRef("n", "forward", 1)): "left",
        (west[1], LaneRef("s", "backward", 1)): "right",
    }
    # From each single-lane arm: left, straight, right.
    assert len(ways) == 2 * 4 + 2 * 3


def test_connections_join_lane_ends_tangentially(load, cross):
    network = load(cross)
    for junction in network.junctions:
        for way in network.connections(junction):
            for lane, end, point, edge in (
                (way.incoming, "exit", 0, way.points[1] - way.points[0]),
                (way.outgoing, "entry", -1, way.points[-1] - way.points[-2]),
            ):
                x, y, z, heading = network.roads[lane.road].lane_end(
                    lane.direction, lane.lane, end
                )
                np.testing.assert_allclose(
                    way.points[point], [x, y, z], atol=1e-9
                )
                edge = edge[:2] / np.linalg.norm(edge[:2])
                along = [np.cos(heading), np.sin(heading)]
                assert edge @ along > np.cos(np.radians(5.0))


def test_a_right_turn_follows_the_kerb(load, cross):
    network = load(cross)
    way = network.connection(
        LaneRef("w", "forward", 2), LaneRef("s", "backward", 1)
    )
    # The kerb's arc has its centre 6 m from both kerbs.
    centre = np.array([-3.0 - 6.0, -6.0 - 6.0])
    distance = np.linalg.norm(way.points[:, :2] - centre, axis=1)
    np.testing.assert_allclose(distance, 6.0 + 1.5, atol=1e-9)


def test_lanes_that_do_not_meet_are_refused(load, cross):
    network = load(cross)
    with pytest.raises(ValueError, match="ends at centre"):
        network.connection(
            LaneRef("w", "forward", 1), LaneRef("ne", "forward", 1)
        )
    with pytest.raises(ValueError, match="U-turn from road w to road w"):
        network.connection(
            LaneRef("w", "forward", 1), LaneRef("w", "backward", 1)
        )


def test_kerb_corners_are_arcs(load, cross):
    carriageway = load(cross).areas.carriageway
    # The corner between e and n: centre of the arc, 6 m from both kerbs.
    centre = np.array([3 + 6, 6 + 6.0])
    towards_corner = -np.array([1, 1]) / np.sqrt(2)
    assert carriageway.contains(Point(centre + 6.05 * towards_corner))
    assert not carriageway.contains(Point(centre + 5.90 * towards_corner))


def test_areas_tile_without_overlap(load, cross):
    cross["roads"]["w"]["parking"] = 1.0
    network = load(cross)
    carriageway, sidewalks = network.areas.carriageway, network.areas.sidewalks
    assert carriageway.is_valid
    assert sidewalks.is_valid
    assert carriageway.intersection(sidewalks).area < 1e-6
    # No gap between the kerb and the sidewalk along e.
    assert carriageway.distance(Point(40, 6 + 1e-3)) < 2e-3
    assert sidewalks.contains(Point(40, 6.05))
    assert sidewalks.contains(Point(40, 7.95))
    assert not sidewalks.contains(Point(40, 8.05))
    # Bays are carriageway, but not where vehicles drive.
    bays = network.areas.parking_bays
    assert set(bays) == {("w", "left"), ("w", "right")}
    for side, y in (("left", 6.5), ("right", -6.5)):
        assert bays["w", side].contains(Point(-40, y))
        assert carriageway.contains(Point(-40, y))
        assert not network.areas.lane_area.contains(Point(-40, y))
    assert sidewalks.contains(Point(-40, 7.05))
    assert not sidewalks.contains(Point(-40, 8.05))


def test_heights_pass_through_the_profile_and_level_off(load, cross):
    cross["junctions"]["east"]["height"] = 3.0
    cross["junctions"]["north"]["height"] = 1.0
    cross["roads"]["e"]["heights"] = [[40, 2.0]]
    network = load(cross)
    road = network.roads["e"]
    first, last = road.first_station, road.last_station
    z = road.evaluate([0, first, 40, last, road.full_length])[:, 2]
    np.testing.assert_allclose(z, [0, 0, 2, 3, 3], atol=1e-12)
    z = road.height(road.stations(0.01))
    assert np.all(np.diff(z) >= -1e-12)
    # Level at the junctions: no kink where a connection takes over.
    assert abs(z[1] - z[0]) < 1e-5
    assert abs(z[-1] - z[-2]) < 1e-5
    way = network.connection(
        LaneRef("e", "forward", 1), LaneRef("ne", "backward", 1)
    )
    np.testing.assert_array_equal(way.points[:, 2], 3.0)


def test_a_loop_road_and_a_joint_of_two_roads(load):
    network = load(
        {
            "junctions": {
                "a": {"position": [0, 0], "kerb_radius": 4.0},
                "b": {"position": [60, 0], "kerb_radius": 4.0},
                "c": {"position": [120, 0], "kerb_radius": 4.0},
            },
            "roads": {
                "to_b": {"start": "a", "end": "b"},
                "to_c": {"start": "b", "end": "c"},
                "loop_a": {
                    "start": "a",
                    "end": "a",
                    "via": [
                        [0, 30, 10],
                        [-40, 30, 10],
                        [-40, -30, 10],
                        [0, -30, 10],
                    ],
                },
                "loop_c": {
                    "start": "c",
                    "end": "c",
                    "lanes": [1, 0],
                    "via": [
                        [120, 30, 10],
                        [160, 30, 10],
                        [160, -30, 10],
                        [120, -30, 10],
                    ],
                },
            },
        }
    )
    assert [way.turn for way in network.connections("b")] == ["straight"] * 2
    ways = {
        (*way.incoming[:2], *way.outgoing[:2]): way.turn
        for way in network.connections("a")
    }
    # Round the loop either way is straight through its own junction.
    assert ways["loop_a", "forward", "loop_a", "forward"] == "straight"
    assert ways["to_b", "backward", "loop_a", "forward"] == "right"
    assert ways["to_b", "backward", "loop_a", "backward"] == "left"
    # The road is one-way: entry at the start, exit at the end.
    into_loop = [
        way
        for way in network.connections("c")
        if way.outgoing.road == "loop_c" and way.incoming.road == "to_c"
    ]
    assert [way.turn for way in into_loop] == ["left"]


def test_a_dead_end_is_a_disc(load, cross):
    cross["junctions"]["yard"] = {
        "position": [0, 130],
        "kerb_radius": 9.0,
        "dead_end": True,
    }
    cross["roads"]["alley"] = {"start": "north", "end": "yard"}
    network = load(cross)
    assert len(network.junctions["yard"].arms) == 1
    assert network.connections("yard") == []
    area = network.junction_areas["yard"]
    # The disc, and up to the road's end the corners beside the road.
    assert area.area == pytest.approx(9**2 * np.pi, rel=0.04)
    disc = Point(0, 130).buffer(8.9)
    assert area.contains(disc.difference(Point(0, 121).buffer(4.0)))
    road = network.roads["alley"]
    assert road.full_length - road.last_station == 9.0


def test_directions_that_part_do_not_lead_back(load, cross):
    # East of the centre, e parts into an entry and an exit.
    cross["junctions"]["fork"] = {"position": [30, 0], "kerb_radius": 6.0}
    cross["roads"]["e"].update(end="fork")
    for name, ends, y in (("out", ("fork", "east"), -6), ("in", None, 6)):
        start, end = ends or ("east", "fork")
        via = [[42, y, 8], [68, y, 8]]
        cross["roads"][name] = {
            "start": start,
            "end": end,
            "lanes": [2, 0],
            "via": via if name == "out" else via[::-1],
            "start_setback": 17.0,
            "end_setback": 17.0,
        }
    network = load(cross)
    ways = network.connections("fork")
    pairs = {(way.incoming.road, way.outgoing.road) for way in ways}
    assert pairs == {("e", "out"), ("in", "e")}
    with pytest.raises(ValueError, match="U-turn from road in to road out"):
        network.connection(
            LaneRef("in", "forward", 1), LaneRef("out", "forward", 1)
        )


def test_lanes_of_one_way_roads_are_counted_from_the_kerb(load, cross):
    for name, lanes in (("w", [2, 0]), ("e", [2, 0]), ("n", [1, 0])):
        cross["roads"][name]["lanes"] = lanes
    network = load(cross)
    ways = {
        (way.incoming, way.outgoing.road, way.outgoing.lane): way.turn
        for way in network.connections("centre")
        if way.incoming.road == "w"
    }
    first, second = (LaneRef("w", "forward", lane) for lane in (1, 2))
    assert ways == {
        (first, "e", 1): "straight",
        (second, "e", 2): "straight",
        # The only lane of n is its outermost.
        (second, "n", 1): "left",
        # South is a two-way road: right from the outermost lane.
        (second, "s", 1): "right",
    }
