"""Lanes of other maps: their successors, and their files."""

import copy
from dataclasses import replace
import json

import numpy as np
import pytest

from cns_drake.base import InputError
from cns_drake.traffic import (
    DirectedLane,
    LaneGraph,
    Walkway,
    join_lanes,
    lane_text,
    make_crossing,
    read_lanes,
)


def straight(start, end, limit=10.0, connects=False):
    points = np.linspace((*start, 1.0), (*end, 1.0), 5)
    return DirectedLane(points, limit, connects)


# A ring of two streets, each cut in two, with two ways through junctions. A
# dead end leads away from the first street, and a short lane leads back to its
# start.
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
    # A lane and its only successor are one, less a metre at each end.
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
    found, walkways, in_the_way = read_lanes(path)
    assert in_the_way == ()
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


def test_lanes_beside_each_other_stay_so():
    """Lanes of two pieces each, and a third that is longer than the others."""
    lanes = [
        straight((0, 0), (20, 0)),
        straight((0, -3), (20, -3)),
        straight((20, 0), (50, 0)),
        straight((20, -3), (50, -3)),
        straight((50, 0), (0, 0), connects=True),
        straight((50, -3), (0, -3), connects=True),
    ]
    links = [(0, 2), (1, 3), (2, 4), (3, 5), (4, 0), (5, 1)]
    # A lane does not lead to itself.
    links += [(4, 1), (5, 0)]
    graph = join_lanes(lanes, links, {0: 1, 2: 3})
    left, right = (k for k in graph.lanes)
    assert graph.pieces[left].right == right
    assert graph.pieces[right].left == left
    assert graph.pieces[left].left == graph.pieces[right].right == -1
    partly = join_lanes(lanes, links, {0: 1})
    assert all(partly.pieces[k].right == -1 for k in partly.lanes)


def test_a_file_keeps_signals_and_crossings(graph, tmp_path):
    first, second, way, other = graph.pieces
    full = LaneGraph(
        (
            replace(first, right=1),
            replace(second, left=0),
            replace(way, phase=1),
            replace(other, phase=0),
        ),
        (make_crossing(np.array([(9, -4, 1.0), (9, 4.0, 1.0)]), 2.4),),
    )
    over = Walkway(np.array([(9, -5, 1.0), (9, 5, 1.0)]), 0.8, 0, 1, 0)
    path = tmp_path / "lanes.json"
    path.write_text(lane_text(full, [over], ["car_1"]))
    found, (walk,), in_the_way = read_lanes(path)
    assert in_the_way == ("car_1",)
    assert walk.crossing == 0
    assert [(p.left, p.right, p.phase) for p in found.pieces] == [
        (p.left, p.right, p.phase) for p in full.pieces
    ]
    (crossing,) = found.crossings
    assert crossing.area.bounds == pytest.approx((7.8, -4, 10.2, 4))
    content = json.loads(path.read_text())
    for part, row, key, value, fault in (
        ("lanes", 0, "right", 2, "lanes: 0: right: 2 is no lane"),
        ("lanes", 0, "left", 4, "lanes: 0: left: 4 is no lane"),
        ("lanes", 2, "phase", 8, "phase"),
        ("walkways", 0, "crossing", 1, "walkways: 0: crossing: 1 is none"),
        ("crossings", 0, "width", 0.0, "width"),
    ):
        wrong = copy.deepcopy(content)
        wrong[part][row][key] = value
        path.write_text(json.dumps(wrong))
        with pytest.raises(InputError, match=fault):
            read_lanes(path)


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
def test_files_of_lanes_that_are_none(graph, tmp_path, field, value, fault):
    path = tmp_path / "lanes.json"
    content = json.loads(lane_text(graph, []))
    content["lanes"][0][field] = value
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=fault) as error:
        read_lanes(path)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


@pytest.mark.parametrize("through_junction", [False, True])
def test_a_ring_that_is_one_lane_follows_itself(through_junction):
    angle = np.linspace(0.0, 2.0 * np.pi, 201)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * 40.0
    if through_junction:
        lanes = [
            DirectedLane(ring[:190], 10.0, False),
            DirectedLane(ring[189:], 10.0, True),
        ]
        graph = join_lanes(lanes, [(0, 1), (1, 0)])
    else:
        graph = join_lanes([DirectedLane(ring, 10.0, False)], [(0, 0)])
    lane, way = graph.pieces
    assert not lane.is_way
    assert way.is_way
    assert lane.after == (1,)
    assert way.after == (0,)
    assert lane.length + way.length == pytest.approx(80.0 * np.pi, rel=2e-3)


def test_one_way_leads_to_each_lane():
    """Parallel short lanes add no ways, and no turn is lost behind them."""
    short, ends = range(1, 4), range(4, 11)
    lanes = [
        straight((0, 0), (40, 0)),
        *(straight((40, 0), (43, 0), connects=True) for _ in short),
        *(straight((43, 0), (90, 10 * k)) for k in ends),
    ]
    links = [(0, k) for k in short] + [(k, 0) for k in ends]
    # Two short lanes lead to the same six lanes, the third to the last one.
    links += [(k, end) for k in (1, 2) for end in ends[:-1]] + [(3, ends[-1])]
    graph = join_lanes(lanes, links)
    reached = [graph.pieces[way].after[0] for way in graph.pieces[0].after]
    assert reached == list(range(1, len(ends) + 1))
