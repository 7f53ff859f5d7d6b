"""Planned traffic: no boxes overlap, and all traffic obeys the roads."""

from functools import cache

import numpy as np
import pytest
import shapely

from cns_drake.roads.network import load_road_network
from cns_drake.roads.route import make_lane_path
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.traffic import traffic_plan
from cns_drake.traffic.road_lanes import make_lane_graph, make_walkways
from cns_drake.traffic.streets import EgoBox, find_conflicts
from cns_drake.traffic.traffic_plan import WALKER_SIZE, plan_traffic
from cns_drake.traffic.vehicles import room_for_vehicles

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
def test_no_boxes_overlap_for_ten_minutes():
    traffic = plan("downtown_03", 100, 600.0)
    assert len(traffic.kinds) == traffic.walkers.values.shape[1] == 100
    assert meetings(traffic, ego("downtown_03"), np.arange(0, 600, 0.7)) == 0


@pytest.fixture(scope="module")
def short():
    return plan("metropolis_04", 40, 60.0)


def test_no_boxes_overlap(short):
    assert short.left_out == 0
    assert meetings(short, ego("metropolis_04"), np.arange(0, 60, 0.05)) == 0


def test_equal_arguments_give_an_equal_plan(short):
    again = plan("metropolis_04", 40, 60.0)
    assert again.kinds == short.kinds
    assert (again.vehicles.values == short.vehicles.values).all()
    assert (again.walkers.values == short.walkers.values).all()
    other = plan("metropolis_04", 40, 60.0, seed=2)
    assert other.kinds != short.kinds


def test_a_trial_given_up_early_changes_no_plan(monkeypatch):
    _, graph, walkways = roads("suburbia")
    low, high = (
        f([f(p.points[:, :2], axis=0) for p in graph.pieces], axis=0)
        for f in (np.min, np.max)
    )

    def across(t):
        """Crosses the city and its lanes, through whatever is there."""
        xy = low + (t[:, None] / 30.0) * (high - low)
        return xy, np.full(len(t), np.arctan2(*(high - low)[::-1]))

    found, calls = [], []
    run = traffic_plan.Trial.run
    monkeypatch.setattr(
        traffic_plan.Trial, "run", lambda *a: calls.append(a) or run(*a)
    )
    for part in (20, 10**6):
        monkeypatch.setattr(traffic_plan, "_PART", part)
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
    lanes = network.lane_area().buffer(0.2)
    wheels = short.vehicles.values[::10, :, :2].reshape(-1, 2)
    assert shapely.contains_xy(lanes, *wheels.T).all()
    walked = network.sidewalks().union(
        shapely.union_all([c.area for c in roads("metropolis")[1].crossings])
    )
    feet = short.walkers.values[::10, :, :2].reshape(-1, 2)
    assert shapely.contains_xy(walked.buffer(0.3), *feet.T).mean() > 0.99


def test_moves_plausibly(short):
    velocity = np.diff(short.vehicles.values[..., :3], axis=0) / 0.1
    speed = np.linalg.norm(velocity, axis=2)
    assert speed.max() < 1.1 * 22.4
    assert np.abs(np.diff(speed, axis=0)).max() < 0.1 * 9.0
    assert (speed > 0.5).mean() > 0.3
    # Walkers face their direction of motion.
    yaw = short.vehicles.values[:-1, :, 3]
    ahead = np.cos(yaw) * velocity[..., 0] + np.sin(yaw) * velocity[..., 1]
    assert (ahead[speed > 2] > 0.97 * speed[speed > 2]).all()
    walking = np.linalg.norm(
        np.diff(short.walkers.values[..., :2], axis=0), axis=2
    )
    assert 0.9 < np.median(walking) / 0.1 < 1.6
    assert walking.max() / 0.1 < 4.0


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
    small, large = find_conflicts(graph)
    num = len(graph.pieces)
    lines = [shapely.LineString(p.points[:, :2]) for p in graph.pieces]
    for a in range(num):
        for b in range(a):
            if graph.pieces[a].is_way and graph.pieces[b].is_way:
                meets = lines[a].distance(lines[b]) < 1.5
                assert not meets or small[a, b]
    assert (small == small.T).all()
    assert (small <= large).all()
