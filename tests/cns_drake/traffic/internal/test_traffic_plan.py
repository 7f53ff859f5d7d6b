"""Planned traffic: no boxes overlap, and all traffic obeys the roads."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree
import shapely
import shapely.affinity

from cns_drake.roads import load_road_network, make_lane_path
from cns_drake.scenarios import load_scenario, shipped_maps
from cns_drake.traffic import (
    WALKER_SIZE,
    EgoBox,
    LaneGraph,
    Piece,
    Walkway,
    kept_clear,
    make_crossing,
    make_lane_graph,
    make_walkways,
    plan_traffic,
    room_for_vehicles,
    traffic_planning,
)
from cns_drake.traffic.conflicts import find_conflicts
from cns_drake.traffic.traffic_planning import Trial
from cns_drake.traffic.vehicle_kinds import LARGEST, SMALL_SIZE
from cns_drake.traffic.vehicle_records import make_crossings
from cns_drake.traffic.walkers import Crowd

BOX = EgoBox(-1.05, 3.75, 1.03)


@cache
def roads(name):
    network = load_road_network(shipped_maps()[name] / "roads.yaml")
    graph = make_lane_graph(network)
    return network, graph, make_walkways(network, graph)


def ego(drive):
    """Returns a drive along a drive's route at 12 m/s."""
    scenario = load_scenario(drive)
    network = roads(scenario.map)[0]
    path = make_lane_path(network, scenario.route, 0.5)
    along = path.spacing * np.arange(len(path.points))
    yaw = np.unwrap(
        np.arctan2(*np.gradient(path.points[:, :2], axis=0).T[::-1])
    )

    def at(t):
        s = 12.0 * t
        xy = [np.interp(s, along, x) for x in path.points[:, :2].T]
        return np.column_stack(xy), np.interp(s, along, yaw)

    return at


def plan(drive, number, duration, seed=1):
    _, graph, walkways = roads(load_scenario(drive).map)
    return plan_traffic(
        graph,
        walkways,
        vehicles=number,
        walkers=number,
        seed=seed,
        duration=duration,
        ego=ego(drive),
        ego_box=BOX,
    )


def boxes(centres, yaw, sizes):
    """Returns polygons of boxes (N, 2), (N,), (N, 2)."""
    c, s = np.cos(yaw), np.sin(yaw)
    corners = [
        (
            centres[:, 0] + x * c - y * s,
            centres[:, 1] + x * s + y * c,
        )
        for x, y in (
            (sizes / 2 * signs).T
            for signs in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        )
    ]
    return shapely.polygons(np.array(corners).transpose(2, 0, 1))


def all_boxes(traffic, path, t):
    """Returns everybody's box at a time, the ego car's first."""
    xy, yaw = path(np.array([t]))
    ahead = np.column_stack([np.cos(yaw), np.sin(yaw)])
    middle = xy + (BOX.rear + BOX.front) / 2 * ahead
    vehicles, walkers = traffic.vehicles.at(t)[0], traffic.walkers.at(t)[0]
    return boxes(
        np.concatenate([middle, vehicles[:, :2], walkers[:, :2]]),
        np.concatenate([yaw, vehicles[:, 3], walkers[:, 3]]),
        np.array(
            [
                (BOX.front - BOX.rear, 2 * BOX.half_width),
                *(kind.size[:2] for kind in traffic.kinds),
                *[WALKER_SIZE[:2]] * len(walkers),
            ]
        ),
    )


def meetings(traffic, path, times):
    """Returns the number of pairs that overlap at any of the times."""
    count = 0
    for t in times:
        found = all_boxes(traffic, path, t)
        a, b = shapely.STRtree(found).query(found, predicate="intersects")
        count += int((a < b).sum())
    return count


@pytest.mark.slow
@pytest.mark.night
def test_no_boxes_overlap_for_ten_minutes():
    traffic = plan("downtown_03", 100, 600.0)
    assert len(traffic.kinds) == traffic.walkers.values.shape[1] == 100
    times = np.arange(0.0, 600.0, 0.7)
    assert meetings(traffic, ego("downtown_03"), times) == 0


@pytest.fixture(scope="module")
def short():
    return plan("metropolis_04", 40, 60.0)


def test_no_boxes_overlap(short):
    assert short.left_out == 0
    assert meetings(short, ego("metropolis_04"), np.arange(0, 60, 0.05)) == 0


@pytest.mark.slow
def test_equal_arguments_give_an_equal_plan(short):
    again = plan("metropolis_04", 40, 60.0)
    assert again.kinds == short.kinds
    assert (again.vehicles.values == short.vehicles.values).all()
    assert (again.walkers.values == short.walkers.values).all()
    other = plan("metropolis_04", 40, 5.0, seed=2)
    assert other.kinds != short.kinds


@pytest.mark.slow
@pytest.mark.night
def test_a_trial_given_up_early_changes_no_plan(monkeypatch):
    _, graph, walkways = roads("suburbia")
    low, high = (
        f([f(p.points[:, :2], axis=0) for p in graph.pieces], axis=0)
        for f in (np.min, np.max)
    )

    def across(t):
        """Crosses the city six times, through whatever is there."""
        part = np.abs((t / 5.0 + 1.0) % 2.0 - 1.0)
        xy = low + part[:, None] * (high - low)
        return xy, np.full(len(t), np.arctan2(*(high - low)[::-1]))

    found, calls = [], []
    run = Trial.run
    monkeypatch.setattr(Trial, "run", lambda *a: calls.append(a) or run(*a))
    for part in (20, 10**6):
        monkeypatch.setattr(traffic_planning, "_PART", part)
        found.append(
            plan_traffic(
                graph,
                walkways,
                vehicles=60,
                walkers=60,
                seed=1,
                duration=30.0,
                ego=across,
                ego_box=BOX,
            )
        )
    early, whole = found
    assert early.left_out == whole.left_out > 0
    assert early.kinds == whole.kinds
    assert (early.vehicles.values == whole.vehicles.values).all()
    assert (early.walkers.values == whole.walkers.values).all()
    # All trials of the second plan run to their end, and not all of the first.
    steps = [len(arguments[-1]) for arguments in calls]
    assert 0 < sum(steps[:-4]) < sum(steps[-4:])


def test_keeps_to_lanes_and_walkways(short):
    network = roads("metropolis")[0]
    lanes = network.areas.lane_area.buffer(0.2)
    wheels = short.vehicles.values[::10, :, :2].reshape(-1, 2)
    assert shapely.contains_xy(lanes, *wheels.T).all()
    walked = network.areas.sidewalks.union(
        shapely.union_all([c.area for c in roads("metropolis")[1].crossings])
    )
    feet = short.walkers.values[::10, :, :2].reshape(-1, 2)
    assert shapely.contains_xy(walked.buffer(0.3), *feet.T).mean() > 0.99


def test_moves_plausibly(short):
    velocity = np.diff(short.vehicles.values[..., :3], axis=0) / 0.1
    speed = np.linalg.norm(velocity, axis=2)
    assert speed.max() < 1.1 * 22.4
    assert (speed > 0.5).mean() > 0.2
    # No heading jumps by a turn.
    for tracks, rate in ((short.vehicles, 2.0), (short.walkers, 3.0)):
        turned = np.diff(tracks.values[..., 3], axis=0)
        assert 0.01 < np.abs(turned).max() < rate * 0.1
    # Walkers face their direction of motion.
    yaw = short.vehicles.values[:-1, :, 3]
    ahead = np.cos(yaw) * velocity[..., 0] + np.sin(yaw) * velocity[..., 1]
    assert (ahead[speed > 2] > 0.97 * speed[speed > 2]).all()
    walking = np.linalg.norm(
        np.diff(short.walkers.values[..., :2], axis=0), axis=2
    )
    assert 0.9 < np.median(walking) / 0.1 < 1.6
    assert walking.max() / 0.1 < 4.0


def rates_of(tracks, duration):
    """Returns velocities (T, N, 3) at each frame, from first to last."""
    times = np.append(np.arange(0.0, duration, 0.05), duration)
    return tracks.at(times)[1][..., :3]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drive", "number"),
    [
        ("metropolis_04", 40),
        pytest.param("downtown_02", 50, marks=pytest.mark.night),
    ],
)
def test_nobody_accelerates_beyond_bounds(short, drive, number):
    """From the first frame to the last, and while lanes are changed."""
    traffic = short if number == 40 else plan(drive, number, 60.0)
    speed = np.linalg.norm(rates_of(traffic.vehicles, 60.0), axis=2)
    change = np.diff(speed, axis=0) / 0.05
    assert -6.0 < change.min() < -1.0
    assert (change < -3.5).mean() < 1e-3
    assert 1.0 < change.max() < 3.0
    velocity = rates_of(traffic.walkers, 60.0)[..., :2]
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=2) / 0.05
    assert 1.0 < change.max() < 3.0


def test_traffic_is_under_way_in_the_first_and_the_last_frame(short):
    for tracks in (short.vehicles, short.walkers):
        speed = np.linalg.norm(rates_of(tracks, 60.0), axis=2)
        moving = (speed > 0.5).mean(axis=1)
        assert moving[0] > 0.5 * moving.mean()
        assert moving[-1] > 0.5 * moving.mean()
        # A LiDAR that takes a fifth of a second for its last turn.
        _, (first, *_, last) = tracks.at(np.linspace(60.0, 60.2, 5))
        assert np.abs(last - first)[:, :2].max() < 0.2 * 6.0


@pytest.mark.night
@pytest.mark.slow
def test_walkers_pass_what_stands_on_sidewalks():
    _, graph, walkways = roads("riverside")
    rng = np.random.default_rng(3)
    points = np.concatenate([w.points[:, :2] for w in walkways[::2]])
    places = points[rng.choice(len(points), 150)]
    things = shapely.points(places + rng.uniform(-1, 1, (150, 2)))
    things = shapely.buffer(things, 0.2)

    def far(t):
        return np.tile((900.0, 0.0), (len(t), 1)), np.zeros(len(t))

    traffic = plan_traffic(
        graph,
        kept_clear(walkways, things),
        vehicles=0,
        walkers=60,
        seed=2,
        duration=40.0,
        ego=far,
        ego_box=BOX,
    )
    tree = shapely.STRtree(things)
    met = 0
    near = 0
    for t in np.arange(0.0, 40.0, 0.5):
        walkers = traffic.walkers.at(t)[0]
        sizes = np.tile(WALKER_SIZE[:2], (len(walkers), 1))
        found = boxes(walkers[:, :2], walkers[:, 3], sizes)
        met += len(tree.query(found, "intersects")[0])
        near += len(tree.query(found, "dwithin", 0.5)[0])
    assert near > 100
    # Where ways meet, a walker may touch something.
    assert met < 2e-4 * 80 * 60
    moved = np.ptp(traffic.walkers.values[..., :2], axis=0).max(axis=1)
    assert (moved > 5.0).mean() > 0.9


def test_a_third_of_walkers_walks_in_groups(short):
    """Most of two who begin near each other still are a minute later."""
    walkers = short.walkers.values[..., :2]
    apart = np.linalg.norm(walkers[:, :, None] - walkers[:, None], axis=3)
    apart[:, np.arange(40), np.arange(40)] = np.inf
    first, last = (a.min(axis=1) < 5.0 for a in (apart[0], apart[-1]))
    assert 0.2 < (first & last).mean() < 0.7


@pytest.mark.night
@pytest.mark.slow
def test_seeds_mix_all_kinds():
    traffic = plan("downtown_03", 120, 1.0)
    classes = {kind.semantic_class for kind in traffic.kinds}
    assert classes == {"car", "truck", "bus", "motorcyclist", "bicyclist"}


@pytest.mark.parametrize("name", ["metropolis", "suburbia", "riverside"])
def test_graphs_have_no_dead_end(name):
    _, graph, _ = roads(name)
    assert room_for_vehicles(graph) > 50
    for piece in graph.pieces:
        assert piece.after
        assert all(graph.pieces[a].is_way != piece.is_way for a in piece.after)
        for after in piece.after:
            gap = graph.pieces[after].points[0] - piece.points[-1]
            assert np.linalg.norm(gap) < 1e-3


def test_ways_that_cross_exclude_each_other():
    _, graph, _ = roads("suburbia")
    _, (small, large), _ = find_conflicts(graph)
    num = len(graph.pieces)
    lines = [shapely.LineString(p.points[:, :2]) for p in graph.pieces]
    for a in range(num):
        for b in range(a):
            if graph.pieces[a].is_way and graph.pieces[b].is_way:
                meets = lines[a].distance(lines[b]) < 1.5
                assert not meets or small[a, b] > 0.0
    ways, crossed = small[:, :num], small[:, num:]
    assert ((ways[:num] > 0.0) == (ways[:num].T > 0.0)).all()
    assert (crossed[:num] > 0.0).any()
    assert not small[num:].any()
    assert (small <= large + 1.0)[small == 0.0].all()


def test_a_way_is_free_behind_the_last_place_where_it_meets_another():
    """Two straight ways of 40 m that cross at right angles at 20 m."""
    x = np.arange(0.0, 40.1, 0.5)
    c, s = np.cos(0.4), np.sin(0.4)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    ways = [
        Piece(line @ R.T, 10.0, True)
        for line in (
            np.column_stack([x, 0 * x, 0 * x]),
            np.column_stack([20 + 0 * x, x - 20, 0 * x]),
        )
    ]
    begin, (small, large), joint = find_conflicts(LaneGraph(tuple(ways)))
    assert not joint.any()
    for first, size, found in zip(
        begin, (SMALL_SIZE, LARGEST.size), (small, large), strict=True
    ):
        # They are mirror images of each other, but for the length.
        before = 20.0 - size[1] / 2 - 0.25
        assert before - 1.01 <= first[0, 1] <= before
        assert np.isinf(first[0, 0])
        # Half a vehicle with 0.25 m beside it on either way, and the step.
        expected = 20.0 + size[1] / 2 + 0.25
        assert expected <= found[0, 1] <= expected + 1.01
        assert found[1, 0] == pytest.approx(found[0, 1], abs=1.0)
        assert found[0, 0] == found[1, 1] == 0.0


def vehicles_in_streets(graph, xy):
    """Returns the vehicles (T, S) in each direction of streets over 60 m."""
    lanes = [k for k in graph.lanes if graph.pieces[k].left < 0]
    beside = {graph.pieces[k].left: k for k in graph.lanes}
    streets = []
    for lane in lanes:
        streets.append([lane])
        while streets[-1][-1] in beside:
            streets[-1].append(beside[streets[-1][-1]])
    owner = {k: row for row, own in enumerate(streets) for k in own}
    points = [piece.points[:, :2] for piece in graph.pieces]
    of_point = np.repeat(
        [owner.get(k, -1) for k in range(len(points))],
        [len(line) for line in points],
    )
    _, near = cKDTree(np.concatenate(points)).query(xy)
    found = of_point[near]
    count = np.stack(
        [(found == row).sum(axis=1) for row in range(len(streets))], axis=1
    )
    long = [graph.pieces[own[0]].length > 60.0 for own in streets]
    return count[:, long]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param("downtown", marks=pytest.mark.night),
        "metropolis",
        pytest.param("riverside", marks=pytest.mark.night),
        pytest.param("suburbia", marks=pytest.mark.night),
    ],
)
def test_traffic_flows(name):
    """Signals and walkers hold vehicles up for a while, and never for ever."""
    _, graph, walkways = roads(name)

    def far(t):
        return np.tile((9000.0, 0.0), (len(t), 1)), np.zeros(len(t))

    traffic = plan_traffic(
        graph,
        walkways,
        vehicles=60,
        walkers=60,
        seed=1,
        duration=300.0,
        ego=far,
        ego_box=BOX,
    )
    assert traffic.left_out == 0
    xy = traffic.vehicles.values[:, :, :2]
    stands = np.linalg.norm(np.diff(xy, axis=0), axis=2) < 0.05
    if name == "metropolis":
        # No street is empty while vehicles queue in others.
        is_empty = vehicles_in_streets(graph, xy[::10]) == 0
        assert is_empty.mean(axis=0).max() < 0.3
        assert not is_empty.all(axis=0).any()
    assert 0.1 < stands.mean() < 0.4
    assert stands.mean(axis=0).max() < 0.8
    # No vehicle stays within ten metres for more than two and a half minutes.
    for first in range(0, len(xy) - 1500, 250):
        apart = np.linalg.norm(xy[first : first + 1501] - xy[first], axis=2)
        assert (apart.max(axis=0) > 10.0).all()


@pytest.mark.parametrize(("apart", "turns"), [(1.2, True), (2.0, False)])
def test_who_waits_lets_others_off_a_crossing(apart, turns):
    """Slow walkers: one has been held up on a crossing, one waits for it."""
    x = np.arange(0.0, 14.1, 0.5)
    points = np.column_stack([x, 0 * x, 0 * x])
    crossing = Walkway(points, 0.8, 0, 1, crossing=0)
    y = np.arange(8.0, -0.1, -0.5)
    walk = Walkway(np.column_stack([0 * y, y, 0 * y]), 0.8, 2, 0)
    graph = LaneGraph((), (make_crossing(crossing.points[[0, -1]], 1.6),))
    crossings = make_crossings(graph)
    crossings["users"] = 1
    crowd = Crowd(2, [walk, crossing], crossings, np.random.default_rng(1))
    walkers = crowd.walkers
    walkers["speed"], walkers["velocity"] = 0.1, 0.0
    walkers["xy"] = (apart, 0.5), (0.0, 0.5)
    walkers["path"], walkers["stuck"] = (3, 0), (4.0, 0.0)
    walkers["at"] = 28 - 3, len(y) - 2
    walkers["next_path"] = -1, 2
    crowd.step(1.0, 1)
    assert walkers["path"].tolist() == [2, 1 if turns else 0]
