"""Queues in all lanes between junctions."""

import copy

from helpers.road_crossing import CROSS, load_network
import numpy as np
import pytest
import shapely

from cns_drake.traffic import EgoBox, plan_queues

BOX = EgoBox(-1.0, 3.0, 1.0)
# Height of the northern junction [m].
TOP = 4.0


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """The crossing, with a slope to the north, and a road that ends."""
    content = copy.deepcopy(CROSS)
    content["junctions"]["north"]["height"] = TOP
    content["junctions"]["end"] = {"position": [160, 0], "dead_end": True}
    content["roads"]["dead_end"] = {"start": "east", "end": "end"}
    return load_network(content, tmp_path_factory.mktemp("town"))


def drive(t):
    """Drives towards the east in the southern lane, at 8 m/s."""
    xy = np.column_stack([8.0 * t + 12.0, 0.0 * t - 1.5])
    return xy, np.zeros(len(t))


def far_away(t):
    return np.tile((900.0, 0.0), (len(t), 1)), np.zeros(len(t))


def queue(network, ego, duration=3.0, seed=1):
    return plan_queues(
        network, seed=seed, duration=duration, ego=ego, ego_box=BOX
    )


def stop_line(network, junction):
    """Only two roads meet at the corners in the north, south and west."""
    return 4.5 if len(network.junctions[junction].arms) > 2 else 1.0


@pytest.mark.parametrize("seed", range(3))
def test_vehicles_stand_close_behind_each_other(network, seed):
    """From 1.5 to 3.5 m apart, between stop lines, in all lanes of a loop."""
    plan = queue(network, far_away, seed=seed)
    assert plan.left_out == 0
    assert plan.vehicles.present.all()
    assert plan.walkers.values.shape[1] == 0
    assert (np.ptp(plan.vehicles.values, axis=0) == 0.0).all()
    rows, sizes = plan.vehicles.values[0], [k.size[0] for k in plan.kinds]
    taken = np.zeros(len(rows), bool)
    for lane in network.lanes():
        road = network.roads[lane.road]
        line = road.lane_centreline(*lane[1:], 0.25)
        course = shapely.LineString(line[:, :2])
        places = shapely.points(rows[:, :2])
        on = shapely.distance(course, places) < 0.3
        if lane.road == "dead_end":
            assert not on.any()
            continue
        along = shapely.line_locate_point(course, places)
        on &= (along > 3.0) & (along < course.length - 3.0)
        order = np.flatnonzero(on)[np.argsort(-along[on])]
        assert len(order) > 3
        taken[order] = True
        ends = [road.start, road.end]
        if lane.direction == "backward":
            ends.reverse()
        end = course.length - stop_line(network, ends[1])
        for k in order:
            gap = end - along[k] - sizes[k] / 2
            assert 1.5 - 0.05 < gap < 3.5 + 0.2
            end = along[k] - sizes[k] / 2
        # No other vehicle has room in the lane.
        assert -0.05 < end - stop_line(network, ends[0]) < 11.3 + 3.5
        near = np.searchsorted(
            shapely.line_locate_point(course, shapely.points(line[:, :2])),
            along[order],
        )
        dx, dy, dz = np.gradient(line, axis=0)[near].T
        np.testing.assert_allclose(rows[order, 2], line[near, 2], atol=0.05)
        turn = rows[order, 3] - np.arctan2(dy, dx)
        np.testing.assert_allclose(np.cos(turn), 1.0, atol=0.02)
        pitch = -np.arctan2(dz, np.hypot(dx, dy))
        np.testing.assert_allclose(rows[order, 4], pitch, atol=0.02)
    assert taken.all()
    assert rows[:, 2].max() > TOP / 2


@pytest.mark.parametrize("duration", [3.0, 3.05])
def test_vehicles_let_the_ego_car_pass(network, duration):
    """They are not there near it, from the first frame to the last."""
    plan = queue(network, drive, duration)
    times = 0.1 * np.arange(len(plan.vehicles.values))
    assert times[-1] >= duration
    near = np.zeros((len(times), len(plan.kinds)), bool)
    for k, (xy, yaw) in enumerate(zip(*drive(times), strict=True)):
        (car,) = shapely.polygons(BOX.corners(xy[None], np.array([yaw])))
        for j, (kind, row) in enumerate(
            zip(plan.kinds, plan.vehicles.values[0], strict=True)
        ):
            box = EgoBox(-kind.size[0] / 2, kind.size[0] / 2, kind.size[1] / 2)
            own = shapely.Polygon(box.corners(row[None, :2], row[3:4])[0])
            near[k, j] = own.distance(car) <= 0.4
    assert near[0].any()
    assert near[-1].any()
    assert not near.any(axis=0).all()
    around = near.copy()
    around[1:] |= near[:-1]
    around[:-1] |= near[1:]
    np.testing.assert_array_equal(plan.vehicles.present, ~around)
    for t in (0.0, duration):
        assert not plan.vehicles.is_present(t).all()


def test_kinds_are_drawn_by_their_shares(network):
    kinds = [
        kind.name
        for seed in range(15)
        for kind in queue(network, far_away, duration=0.1, seed=seed).kinds
    ]
    # By the number of them, without those that are too long for a lane's rest.
    found = {name: kinds.count(name) / len(kinds) for name in set(kinds)}
    assert found["hatchback"] == pytest.approx(0.16, abs=0.03)
    assert found["bicycle"] == pytest.approx(0.09, abs=0.03)
    assert found["bus"] == pytest.approx(0.04, abs=0.02)
    assert len(found) == 10
