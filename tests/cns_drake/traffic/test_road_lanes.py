"""Lanes and walkways of a crossing of two roads: closed forms."""

import copy

from helpers.road_crossing import CROSS, load_network
import numpy as np
import pytest
import shapely

from cns_drake.traffic import make_lane_graph, make_walkways


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """The crossing, with wide sidewalks in the east and none in the south.

    The way from the north to the east has a corner, where only two roads meet;
    the road in the north has a limit of its own.
    """
    content = copy.deepcopy(CROSS)
    content["junctions"]["corner"] = {"position": [80, 80], "kerb_radius": 3.0}
    roads = content["roads"]
    del roads["ne"]
    wide = {"sidewalk": 6.2}
    roads["n_corner"] = {"start": "north", "end": "corner", **wide}
    roads["corner_e"] = {"start": "corner", "end": "east", **wide}
    roads["e"] |= {"sidewalk": 5.0, "kerb_height": 0.2}
    roads["n"]["speed_limit"] = 8.0
    roads["s"]["sidewalk"] = 0.0
    network = load_network(content, tmp_path_factory.mktemp("town"))
    graph = make_lane_graph(network)
    return network, graph, make_walkways(network, graph)


def lanes_of(network, graph):
    """Returns each lane's reference and its piece; none ends."""
    return list(zip(network.lanes(), map(graph.pieces.__getitem__, graph.lanes),
                    strict=True))  # fmt: skip


def test_stop_lines_are_before_crossings(town):
    """Or 1 m before a junction of two roads, which has no crossing."""
    network, graph, _ = town
    found = set()
    for ref, lane in lanes_of(network, graph):
        road = network.roads[ref.road]
        line = road.lane_centreline(*ref[1:], 0.5)
        ends = [road.start, road.end]
        if ref.direction == "backward":
            ends.reverse()
        for row, junction in zip((0, -1), ends, strict=True):
            expected = 1.0 if junction == "corner" else 4.5
            apart = np.linalg.norm(lane.points[row] - line[row])
            assert apart == pytest.approx(expected, abs=0.02)
            found.add((row, ref.direction, expected))
    assert len(found) == 8
    assert len(graph.crossings) == 2 * len(network.roads) - 2


def test_ways_join_lanes_and_have_the_least_limit(town):
    network, graph, _ = town
    lanes = dict(enumerate(lanes_of(network, graph)))
    for ref, lane in lanes.values():
        assert lane.limit == network.roads[ref.road].speed_limit
        for number in lane.after:
            way = graph.pieces[number]
            (after,) = way.after
            onto, other = lanes[after]
            assert network.exit_junction(ref) in (
                network.roads[onto.road].start, network.roads[onto.road].end
            )  # fmt: skip
            assert way.junction == lane.junction
            assert way.limit == min(lane.limit, other.limit)
            np.testing.assert_allclose(way.points[0], lane.points[-1])
            np.testing.assert_allclose(way.points[-1], other.points[0])
            assert np.linalg.norm(np.diff(way.points, axis=0), axis=1).max() < (
                0.5 + 1e-9
            )


def test_lanes_are_beside_those_of_their_direction(town):
    network, graph, _ = town
    found = 0
    for ref, lane in lanes_of(network, graph):
        left = (
            np.array([-1.0, 1.0])
            * np.diff(lane.points[:2, :2], axis=0)[0, ::-1]
        )
        left /= np.linalg.norm(left)
        for side, sign in ((lane.left, 1.0), (lane.right, -1.0)):
            if side >= 0:
                other = graph.pieces[side].points[0] - lane.points[0]
                assert other[:2] @ left == pytest.approx(sign * 3.0, abs=1e-6)
                found += 1
        assert (lane.left >= 0) + (lane.right >= 0) == (ref.road in "ew")
    assert found == 8


def test_ways_along_and_across_have_signals_of_their_own(town):
    """Where a road has more than two lanes, and more than two roads meet."""
    network, graph, _ = town
    phases = {}
    for ref, lane in lanes_of(network, graph):
        junction = network.exit_junction(ref)
        (phase,) = {graph.pieces[k].phase for k in lane.after}
        phases.setdefault(junction, {}).setdefault(ref.road, set()).add(phase)
        assert lane.phase == -1
    centre = {road: only for road, (only,) in phases["centre"].items()}
    assert centre["e"] == centre["w"] != centre["n"] == centre["s"]
    assert set(centre.values()) == {0, 1}
    assert phases["corner"] == {"n_corner": {-1}, "corner_e": {-1}}
    assert set(map(frozenset, phases["north"].values())) == {frozenset({-1})}
    assert {p for road in phases["east"].values() for p in road} == {0, 1}


def walkways_of(walkways, road, network):
    """Returns the walkways along a road, from end to end."""
    line = network.roads[road].evaluate(
        [network.roads[road].first_station, network.roads[road].last_station], 0
    )[:, :2]
    length = np.linalg.norm(line[1] - line[0])
    return [
        way
        for way in walkways
        if way.crossing < 0
        and abs(np.linalg.norm(way.points[-1] - way.points[0]) - length + 3.4)
        < 1e-6
        and shapely.LineString(line).distance(
            shapely.Point(way.points[len(way.points) // 2, :2])
        )
        < 12.0
    ]


@pytest.mark.parametrize(
    ("road", "across", "height", "half_width"),
    [("e", 6.0 + 5.0 - 1.5, 0.2, 1.05), ("w", 6.0 + 1.0, None, 0.55)],
)
def test_walkers_use_the_strip_away_from_the_kerb(
    town, road, across, height, half_width
):
    """At most 3 m wide, less 0.45 m on either side; both roads are along x."""
    network, _, walkways = town
    height = network.roads[road].kerb_height if height is None else height
    ways = walkways_of(walkways, road, network)
    assert sorted(w.points[0, 1] for w in ways) == pytest.approx(
        [-across, across]
    )
    for way in ways:
        assert np.ptp(way.points[:, 1]) < 1e-9
        assert way.half_width == pytest.approx(half_width)
        ground = network.roads[road].evaluate([20.0], 0.0)[0, 2]
        assert way.points[:, 2] == pytest.approx(ground + height)


def test_corners_join_the_sidewalks_of_neighbours(town):
    """Where the south has none, its corners have none."""
    network, _, walkways = town
    along = {
        node: (road, way.points[row, :2])
        for road in ("e", "n", "w", "n_corner", "corner_e")
        for way in walkways_of(walkways, road, network)
        for node, row in ((way.start, 0), (way.end, -1))
    }
    joined = []
    for way in walkways:
        if way.crossing < 0 and {way.start, way.end} <= set(along):
            (one, p), (other, q) = along[way.start], along[way.end]
            np.testing.assert_allclose(way.points[0, :2], p, atol=1e-6)
            np.testing.assert_allclose(way.points[-1, :2], q, atol=1e-6)
            if one != other:
                joined.append({one, other})
                # That of the narrower one.
                is_wide = joined[-1] <= {"e", "n_corner", "corner_e"}
                assert way.half_width == pytest.approx(
                    1.05 if is_wide else 0.55
                )
    expected = ["en", "nw", ("n", "n_corner"), ("e", "corner_e")]
    # Inside the corner both strips end at one place.
    expected.append(("n_corner", "corner_e"))
    assert len(joined) == len(expected)
    assert all(set(pair) in joined for pair in expected)


def test_walkers_cross_from_strip_to_strip(town):
    """Where a sidewalk is wide, they wait 1.4 m before the kerb."""
    network, graph, walkways = town
    by_end = {}
    for way in walkways:
        for node, row in ((way.start, 0), (way.end, -1)):
            by_end.setdefault(node, []).append(way.points[row])
    for ends in by_end.values():
        np.testing.assert_allclose(ends, [ends[0]] * len(ends), atol=1e-6)
    over = [way for way in walkways if way.crossing >= 0]
    south = shapely.box(-3.01, -80.0, 3.01, 0.0)
    assert {way.crossing for way in over} == {
        k
        for k, crossing in enumerate(graph.crossings)
        if not south.contains(shapely.LineString(crossing.line[:, :2]))
    }
    # 1.7 m before the end of the road.
    east = network.roads["e"]
    places = shapely.points(
        east.evaluate([east.first_station + 1.7, east.last_station - 1.7], 0.0)[
            :, :2
        ]
    )
    lines = shapely.linestrings([w.points[[0, -1], :2] for w in over])
    apart = shapely.distance(lines[:, None], places)
    assert (apart < 1e-6).sum(axis=0).tolist() == [1, 1]
    for way in over:
        line = graph.crossings[way.crossing].line
        assert way.half_width == 0.8
        kerbs = shapely.LineString(way.points[:, :2])
        for kerb, place in zip(line, way.points[[0, -1]], strict=True):
            assert kerbs.distance(shapely.Point(kerb[:2])) < 0.1
            apart = np.linalg.norm(kerb[:2] - place[:2])
            is_wide = kerb[0] > 3.01 and kerb[1] > -6.01
            assert apart == pytest.approx(1.4 if is_wide else 1.0, abs=1e-6)
        outside = np.linalg.norm(way.points[[0, -1], :2] - line[:, :2], axis=1)
        width = np.linalg.norm(np.diff(line[:, :2], axis=0))
        assert kerbs.length == pytest.approx(width + outside.sum(), abs=0.05)
