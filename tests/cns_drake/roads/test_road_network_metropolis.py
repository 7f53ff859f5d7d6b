"""The road network of Metropolis has the numbers of its model."""

import numpy as np
import pytest
from shapely.geometry import LineString, Point

from cns_drake.roads import load_road_network
from cns_drake.scenarios import worlds_folder


@pytest.fixture(scope="module")
def metropolis():
    return load_road_network(worlds_folder() / "metropolis" / "roads.yaml")


def test_metropolis_has_the_dimensions_of_town10(metropolis):
    centrelines = np.concatenate(
        [
            road.evaluate(np.linspace(0, road.full_length, 2000))
            for road in metropolis.roads.values()
        ]
    )
    low, high = centrelines.min(axis=0), centrelines.max(axis=0)
    np.testing.assert_allclose(low[:3], [-109.3, -136.0, 0], atol=0.3)
    np.testing.assert_allclose(high[:3], [104.7, 63.5, 0], atol=0.3)
    # Roads between junctions 0.82 km, 3.1 lane-km; with the ways through
    # the junctions about 1.3 km.
    roads = metropolis.roads.values()
    length = sum(road.length for road in roads)
    assert length == pytest.approx(823, rel=0.05)
    lanes = sum(road.length * sum(road.lanes.values()) for road in roads)
    assert lanes == pytest.approx(3108, rel=0.05)
    assert sum(road.full_length for road in roads) == pytest.approx(1300, 0.1)


def test_metropolis_has_the_junctions_of_town10(metropolis):
    # Position and size of the junction areas, as OpenDRIVE bounds them.
    expected = {
        "north": ((-47.5, 55.1), 3, (39.4, 23.7)),
        "inner_middle": ((42.6, -60.3), 3, (30.9, 15.6)),
        "centre": ((-47.8, -20.4), 4, (38.2, 44.3)),
        "south": ((-50.1, -125.1), 3, (43.2, 20.4)),
        "east": ((95.6, -18.8), 3, (25.1, 46.7)),
        "inner_east": ((95.1, -68.1), 3, (18.3, 29.7)),
        "west": ((-100.6, -20.9), 3, (23.9, 46.2)),
        "boulevard": ((41.9, -30.5), 3, (31.0, 23.0)),
        "inner_west": ((-37.0, -67.2), 3, (19.9, 30.9)),
    }
    assert metropolis.junctions.keys() == expected.keys()
    for name, (centre, arms, size) in expected.items():
        junction = metropolis.junctions[name]
        assert len(junction.arms) == arms
        box = metropolis.junction_areas[name].bounds
        found = np.array([box[2] - box[0], box[3] - box[1]])
        # The reference bounds lane paths, not kerbs: up to a lane and its
        # shoulder of difference on each side.
        np.testing.assert_allclose(found, size, atol=9.0)
        middle = np.array([box[0] + box[2], box[1] + box[3]]) / 2
        np.testing.assert_allclose(middle, centre, atol=6.5)


def test_metropolis_centrelines_pass_through_town10(metropolis):
    # Points read off Town10HD's centrelines, all round the network.
    points = [
        (-108.2, 22.0), (-97.5, 51.1), (-68.8, 63.5), (-9.1, 62.8),
        (67.2, 62.6), (98.3, 44.9), (104.7, 13.6), (104.3, -45.9),
        (103.9, -94.1), (92.9, -122.7), (64.7, -136.0), (-7.8, -135.4),
        (-71.7, -134.0), (-98.3, -114.8), (-109.3, -75.8), (-109.0, -43.9),
        (-47.0, 28.4), (-46.9, -48.0), (-46.8, -99.8), (-78.0, -18.7),
        (-1.1, -18.9), (73.2, -19.1), (0.1, -68.0), (74.0, -68.1),
        (42.2, -45.5),
    ]  # fmt: skip
    lines = [
        LineString(road.evaluate(road.stations())[:, :2])
        for road in metropolis.roads.values()
    ]
    for point in points:
        assert min(line.distance(Point(point)) for line in lines) < 0.4


def test_every_legal_way_of_metropolis_stays_on_the_carriageway(metropolis):
    area = metropolis.areas.lane_area.buffer(0.02)
    for junction in metropolis.junctions:
        for way in metropolis.connections(junction):
            swept = LineString(way.points[:, :2]).buffer(1.0, cap_style="flat")
            assert area.contains(swept), way


def test_metropolis_blocks_and_sidewalks(metropolis):
    # Nine arms' worth of streets enclose seven blocks, and three medians.
    assert len(metropolis.areas.medians.geoms) == 3
    (carriageway,) = metropolis.areas.carriageway.geoms
    blocks = len(carriageway.interiors) - 3
    assert blocks == 6
    # One sidewalk round each block and one outside the ring.
    assert len(metropolis.areas.sidewalks.geoms) == blocks + 1
    for road in metropolis.roads.values():
        assert (road.sidewalk, road.lane_width) == (6.0, 3.5)
