"""Lanes of other maps: what follows what, and files of them."""

import json

import numpy as np
import pytest

from cns_drake.base.errors import InputError
from cns_drake.traffic.lane_file import lane_text, read_lanes
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.lane_joining import DirectedLane, join_lanes
from cns_drake.traffic.walkways import Walkway


def straight(start, end, limit=10.0, connects=False):
    points = np.linspace((*start, 1.0), (*end, 1.0), 5)
    return DirectedLane(points, limit, connects)


# A ring of two streets, each cut in two, and two ways through junctions; from
# the first street a dead end leads away, and a short lane back to its start.
LANES = [
    straight((0, 0), (20, 0)),
    straight((20, 0), (50, 0), 8.0),
    straight((50, 0), (55, 5), connects=True),
    straight((55, 5), (30, 40)),
    straight((30, 40), (0, 40)),
    straight((0, 40), (0, 0), 5.0, connects=True),
    straight((50, 0), (90, 0), connects=True),
    straight((90, 0), (140, 0)),
]
LINKS = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0), (1, 6), (6, 7)]


@pytest.fixture(scope="module")
def graph():
    return join_lanes(LANES, LINKS)


def test_a_ring_without_its_dead_end(graph):
    first, second, *ways = graph.pieces
    assert not first.is_way
    assert not second.is_way
    assert [way.is_way for way in ways] == [True, True]
    # Lanes that go on alone are one, without a metre at each end.
    assert first.length == pytest.approx(50.0 - 2.0, abs=0.1)
    assert first.limit == 8.0
    following = [graph.pieces[k] for k in first.after]
    assert [way.limit for way in following] == [8.0]
    assert following[0].after == (1,)
    assert graph.pieces[second.after[0]].limit == 5.0
    assert graph.pieces[graph.pieces[second.after[0]].after[0]] is first


def test_pieces_follow_without_a_gap(graph):
    for piece in graph.pieces:
        for k in piece.after:
            after = graph.pieces[k]
            assert np.linalg.norm(after.points[0] - piece.points[-1]) < 1e-9
            assert after.junction == piece.junction or not after.is_way
        steps = np.linalg.norm(np.diff(piece.points, axis=0), axis=1)
        assert steps.max() <= 0.5 + 1e-9


def test_nothing_is_left_of_a_street_that_ends():
    assert join_lanes(LANES[:2], LINKS[:1]) == LaneGraph(())


def test_a_file_gives_the_same_graph(graph, tmp_path):
    path = tmp_path / "lanes.json"
    walk = Walkway(np.array([(0, -3, 1.1), (9.0, -3, 1.1)]), 0.6, 4, 5)
    path.write_text(lane_text(graph, [walk]))
    found, walkways = read_lanes(path)
    assert found.phases == graph.phases
    assert len(found.pieces) == len(graph.pieces)
    for one, other in zip(found.pieces, graph.pieces, strict=True):
        assert (one.is_way, one.after, one.limit, one.junction) == (
            other.is_way, other.after, other.limit, other.junction
        )  # fmt: skip
        np.testing.assert_allclose(one.points[0], other.points[0], atol=1e-3)
        np.testing.assert_allclose(one.points[-1], other.points[-1], atol=1e-3)
        assert one.length == pytest.approx(other.length, abs=0.3)
    (found_walk,) = walkways
    assert (found_walk.start, found_walk.end) == (4, 5)
    assert found_walk.half_width == 0.6


@pytest.mark.parametrize(
    ("field", "value", "fault"),
    [
        ("after", [9], "lanes: 0: after: 9 is no lane"),
        ("after", [], "lanes: 0: after: nothing is no lane"),
        ("limit", 0.0, "limit"),
        ("points", [[0, 0, 0]], "points"),
        ("points", [[0, 0, 0], [1, 0, 1e9]], "points"),
        ("more", 1, "more"),
    ],
)
def test_what_is_no_file_of_lanes(graph, tmp_path, field, value, fault):
    path = tmp_path / "lanes.json"
    content = json.loads(lane_text(graph, []))
    content["lanes"][0][field] = value
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=fault) as error:
        read_lanes(path)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)
