"""Walkers who cross streets between crossings: where, when, how often."""

from helpers.vehicle_records import make_vehicles
import numpy as np
import pytest
import shapely
import shapely.affinity

from cns_drake.roads import load_road_network
from cns_drake.scenarios import shipped_maps
from cns_drake.traffic import (
    WALKER_SIZE,
    EgoBox,
    LaneGraph,
    Piece,
    Walkway,
    make_crossing,
    make_lane_graph,
    make_walkways,
    plan_traffic,
    with_unmarked_crossings,
)
from cns_drake.traffic.car_following import accelerations
from cns_drake.traffic.giving_way import find_prior
from cns_drake.traffic.occupants import find_occupants
from cns_drake.traffic.right_of_way import grant_ways
from cns_drake.traffic.streets import make_streets
from cns_drake.traffic.vehicle_records import begin_traffic, make_crossings
from cns_drake.traffic.vehicle_steps import advance

BOX = EgoBox(-1.05, 3.75, 1.03)
TURN = 0.4
C = np.cos(TURN)
S = np.sin(TURN)
R = np.array([[C, -S, 0.0], [S, C, 0.0], [0.0, 0.0, 1.0]])


def turned(*corners):
    """Returns points half a metre apart on a line, turned by 0.4 rad."""
    start, end = np.array(corners)
    count = round(np.linalg.norm(end - start) / 0.5) + 1
    return np.linspace(start, end, count) @ R.T


def street(lanes=1, length=80.0, side=8.0):
    """Returns a street along x and sidewalks beside it."""
    pieces = []
    for k in range(lanes):
        y = -1.75 - 3.5 * k
        for row in ((0, y, 1), (length, y, 1)), ((length, -y, 1), (0, -y, 1)):
            pieces.append(Piece(turned(*row), 10.0, False, (len(pieces),)))
    walks = [
        Walkway(turned((0, y, 1.2), (length, y, 1.2)), 0.6, 2 * k, 2 * k + 1)
        for k, y in enumerate((side, -side))
    ]
    return LaneGraph(tuple(pieces)), walks


def box(*bounds):
    thing = shapely.box(*bounds)
    return shapely.affinity.rotate(thing, TURN, (0, 0), use_radians=True)


@pytest.mark.parametrize("lanes", [1, 2])
def test_a_way_over_the_middle_of_a_street(lanes):
    graph, walks = street(lanes)
    found, ways = with_unmarked_crossings(graph, walks)
    (crossing,) = found.crossings
    assert not crossing.marked
    assert found.pieces is graph.pieces
    # Both sidewalks are cut at 40 m, and the way leads from one to the other.
    (over,) = (way for way in ways if way.crossing >= 0)
    assert over.crossing == 0
    places = over.points @ R
    ends = sorted(places[[0, -1], 1])
    np.testing.assert_allclose(ends, [-8.0, 8.0], atol=1e-9)
    np.testing.assert_allclose(places[:, 0], 40.0, atol=1e-9)
    # On the road it is as high as the lanes.
    on_lanes = np.abs(places[:, 1]) < 3.5 * lanes
    np.testing.assert_allclose(places[on_lanes, 2], 1.0, atol=1e-9)
    np.testing.assert_allclose(places[[0, -1], 2], 1.2, atol=1e-9)
    parts = [way for way in ways if way.crossing < 0]
    assert len(parts) == 4
    for k, walk in enumerate(walks):
        before, after = parts[2 * k : 2 * k + 2]
        assert (before.start, after.end) == (walk.start, walk.end)
        assert before.end == after.start in {over.start, over.end}
        points = np.concatenate([before.points, after.points[1:]])
        np.testing.assert_array_equal(points, walk.points)


@pytest.mark.parametrize(
    ("thing", "place"),
    [
        # It leaves 1.03 m free on either side of the way.
        ((39.0, -6.0, 39.9, 6.0), 42.0),
        ((36.0, -6.0, 38.9, 6.0), 40.0),
        # As far beyond the sidewalk's middle, where walkers wait.
        ((39.5, 9.5, 40.5, 9.9), 38.0),
        ((39.5, 10.1, 40.5, 10.5), 40.0),
        ((0.0, 4.0, 80.0, 5.0), None),
    ],
)
def test_nothing_stands_in_the_way(thing, place):
    found, ways = with_unmarked_crossings(*street(), [box(*thing)])
    middles = [way.points @ R for way in ways if way.crossing >= 0]
    if place is None:
        assert found.crossings == ()
        assert len(ways) == 2
    else:
        assert middles[0][:, 0] == pytest.approx(place, abs=1e-6)


def test_narrow_streets_alone_and_away_from_junctions():
    wide = street(3, side=14.0)
    assert not with_unmarked_crossings(*wide)[0].crossings
    assert with_unmarked_crossings(*street(1, 31.0))[0].crossings
    assert not with_unmarked_crossings(*street(1, 29.0))[0].crossings
    graph, walks = street()
    way = Piece(turned((40, 12, 1), (40, 7, 1)), 5.0, True, (0,))
    (crossing,) = with_unmarked_crossings(
        LaneGraph((*graph.pieces, way)), walks
    )[0].crossings
    apart = abs((crossing.line @ R)[:, 0] - 40.0)
    assert (apart > 5.0).all()
    assert (apart < 7.5).all()


def vehicles(*states):
    """Returns vehicles in the first lane: the place on it, the speed."""
    return make_vehicles(*(((0, 1), s, v) for s, v in states))


def lane_with_crossing(cars, marked=False, ego=1e4):
    """Traffic on 200 m, with a crossing of 2.4 m width at their 100 m."""
    pieces = (
        Piece(turned((0, 0, 0), (200, 0, 0)), 10.0, False, (1,)),
        Piece(turned((200, 0, 0), (240, 0, 0)), 10.0, True, (0,)),
    )
    line = np.array([[100.0, 6.0, 0.0], [100.0, -6.0, 0.0]]) @ R.T
    graph = LaneGraph(pieces, (make_crossing(line, 2.4, marked),))
    # The ego car stands there.
    xy = np.tile((np.array([ego, 1.0, 0.0]) @ R.T)[:2], (1200, 1))
    streets = make_streets(graph, BOX, xy, np.full(1200, TURN))
    return begin_traffic(streets, cars, make_crossings(graph), 1)


@pytest.mark.parametrize(
    ("s", "v", "opens"),
    [
        # The area begins at 98.8 m. A gap of 6 s at 5 m/s, and 24 m at 4 m/s.
        (68.9, 5.0, False),
        (68.7, 5.0, True),
        (74.9, 4.0, False),
        (74.7, 4.0, True),
        # A driver who starts may be 1 m before it.
        (97.9, 0.0, False),
        (97.7, 0.0, True),
        # The rear leaves it at 101.2 m.
        (105.1, 5.0, False),
        (105.3, 5.0, True),
    ],
)
def test_walkers_begin_in_a_gap(s, v, opens):
    traffic = lane_with_crossing(vehicles((s, v)))
    traffic.crossings["waits"] = 0.0
    find_occupants(traffic, 1)
    grant_ways(traffic, 1)
    assert traffic.crossings["is_open"].tolist() == [opens]
    assert traffic.crossings["users"].tolist() == [opens]
    # No vehicle waits for walkers who wait.
    stop, *_ = find_prior(traffic, 0)
    if opens and s < 98.8:
        assert stop == pytest.approx(98.8 - s, abs=1e-6)
    else:
        assert stop == np.inf


def test_no_walker_begins_where_the_ego_car_is():
    for ego, opens in ((100.0, False), (120.0, True)):
        traffic = lane_with_crossing(vehicles((10.0, 0.0)), ego=ego)
        traffic.crossings["waits"] = 0.0
        grant_ways(traffic, 1)
        assert traffic.crossings["is_open"].tolist() == [opens]


def test_drivers_stop_for_walkers_on_the_lane():
    """From the smallest gap at all speeds, with comfort."""
    for v in (2.0, 6.0, 10.0):
        gap = 6.0 * v if v > 2.0 else 12.0
        cars = vehicles((98.8 - gap, v))
        traffic = lane_with_crossing(cars)
        crossings = traffic.crossings
        crossings["order"] = 1
        hardest = 0.0
        for k in range(400):
            find_occupants(traffic, k)
            wanted = accelerations(traffic)
            hardest = min(hardest, wanted.min())
            advance(traffic, wanted)
        assert -3.2 <= hardest < -0.5
        assert 97.0 < cars["s"][0] < 98.8
        # Behind walkers who have passed them, they go on.
        crossings["to_end"], crossings["to_start"] = 8.1, -np.inf
        assert find_prior(traffic, 0)[0] == np.inf
        crossings["to_end"] = 7.9
        assert find_prior(traffic, 0)[0] < 2.0


def far(t):
    return np.tile((9000.0, 0.0), (len(t), 1)), np.zeros(len(t))


def boxes(poses, half):
    """Returns polygons of boxes at poses (N, 4), of half sizes (N, 2) [m]."""
    c, s = np.cos(poses[:, 3]), np.sin(poses[:, 3])
    ahead, left = np.stack([c, s], axis=1), np.stack([-s, c], axis=1)
    corners = [
        poses[:, :2] + a * half[:, :1] * ahead + b * half[:, 1:] * left
        for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]
    return shapely.polygons(np.stack(corners, axis=1))


def crossers(walkers, crossing):
    """Returns how often walkers (T, N, 2) cross the middle of a crossing."""
    start, end = crossing.line[:, :2]
    length = np.linalg.norm(end - start)
    along = (end - start) / length
    place = (walkers - start) @ along - length / 2
    aside = np.abs((walkers - start) @ (-along[1], along[0])) < 1.5
    is_on = aside & (np.abs(place) < length / 2)
    passes = (place[:-1] < 0.0) != (place[1:] < 0.0)
    return int((passes & is_on[1:] & is_on[:-1]).sum())


@pytest.mark.slow
@pytest.mark.night
def test_few_walkers_cross_between_crossings_and_none_is_touched():
    name = "suburbia"
    network = load_road_network(shipped_maps()[name] / "roads.yaml")
    graph, walkways = with_unmarked_crossings(
        graph := make_lane_graph(network), make_walkways(network, graph)
    )
    times = np.arange(0.0, 200.0, 0.5)
    traffic = plan_traffic(
        graph,
        walkways,
        vehicles=60,
        walkers=100,
        seed=1,
        duration=200.0,
        ego=far,
        ego_box=BOX,
    )
    assert traffic.left_out == 0
    walkers, vehicles = (
        tracks.at(times)[0] for tracks in (traffic.walkers, traffic.vehicles)
    )
    counts = [crossers(walkers[..., :2], one) for one in graph.crossings]
    are_marked = np.array([one.marked for one in graph.crossings])
    marked = np.array(counts)[are_marked].sum()
    unmarked = np.array(counts)[~are_marked].sum()
    sizes = [*[WALKER_SIZE[:2]] * 100, *(k.size[:2] for k in traffic.kinds)]
    for poses in np.concatenate([walkers, vehicles], axis=1)[::2]:
        bodies = boxes(poses, np.array(sizes) / 2)
        pairs = shapely.STRtree(bodies).query(bodies, "intersects")
        assert (pairs[0] == pairs[1]).all()
    change = np.diff(
        traffic.walkers.at(np.arange(0.0, 200.0, 0.05))[1][..., :2], axis=0
    )
    assert np.linalg.norm(change, axis=2).max() / 0.05 < 3.0
    speeds = np.linalg.norm(
        traffic.vehicles.at(np.arange(0.0, 200.0, 0.05))[1][..., :3], axis=2
    )
    change = np.diff(speeds, axis=0) / 0.05
    assert change.min() > -6.0
    assert (change < -3.5).mean() < 1e-3
    assert 0.01 <= unmarked / marked <= 0.08
