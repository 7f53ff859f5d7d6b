"""Queues in all lanes, and which of several trials a plan is."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from cns_drake.traffic import (
    EgoBox,
    LaneGraph,
    Piece,
    plan_queues,
    plan_traffic,
    traffic_planning,
)

BOX = EgoBox(-1.0, 3.0, 1.0)
# Direction of the road [rad].
ANGLE = 2.5
# Its rise per metre.
SLOPE = 0.06
AHEAD = np.array([np.cos(ANGLE), np.sin(ANGLE)])
ORIGIN = np.array([7.0, -3.0])


def piece(first, last, way, after):
    s = np.linspace(first, last, int(2 * (last - first)) + 1)
    xy = s[:, None] * AHEAD + ORIGIN
    z = SLOPE * s
    return Piece(np.column_stack([xy, z]), 10.0, way, (after,), junction=0)


GRAPH = LaneGraph((piece(0, 90, False, 1), piece(90, 100, True, 0)))


def drive(t):
    """Drives along the lane at 8 m/s, from its 10th metre on."""
    xy = (10.0 + 8.0 * t)[:, None] * AHEAD + ORIGIN
    return xy, np.full(len(t), ANGLE)


def far_away(t):
    return np.tile((900.0, 0.0), (len(t), 1)), np.zeros(len(t))


def queue(ego, duration=3.0, seed=1):
    return plan_queues(
        GRAPH, seed=seed, duration=duration, ego=ego, ego_box=BOX
    )


@pytest.mark.parametrize("seed", range(5))
def test_vehicles_stand_close_behind_each_other(seed):
    """From 1.5 to 3.5 m, on the slope; no other has room in the lane."""
    plan = queue(far_away, seed=seed)
    assert plan.left_out == 0
    assert plan.positions is None
    assert plan.vehicles.present.all()
    assert plan.walkers.values.shape[1] == 0
    assert (np.ptp(plan.vehicles.values, axis=0) == 0.0).all()
    # Heights are a slope's part of the way on the ground.
    steep = np.hypot(1.0, SLOPE)
    end = 90.0 * steep
    for kind, row in zip(plan.kinds, plan.vehicles.values[0], strict=True):
        s = (row[:2] - ORIGIN) @ AHEAD
        np.testing.assert_allclose(row[:2], s * AHEAD + ORIGIN, atol=1e-6)
        assert row[2] == pytest.approx(SLOPE * s, abs=1e-6)
        assert row[3] == pytest.approx(ANGLE)
        assert row[4] == pytest.approx(-np.arctan(SLOPE))
        gap = end - s * steep - kind.size[0] / 2
        assert 1.5 - 0.02 < gap < 3.5 + 0.02
        end = s * steep - kind.size[0] / 2
    assert -0.02 < end < 11.3 + 3.5


@pytest.mark.parametrize("duration", [3.0, 3.05])
def test_vehicles_let_the_ego_car_pass(duration):
    """They are not there near it, from the first frame to the last."""
    plan = queue(drive, duration)
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


@pytest.mark.parametrize(
    ("follows", "trials", "number", "known"),
    [
        # What is left out, and whether the car has arrived; trials made, and
        # what each knows to be the best so far.
        (False, [(3, 0), (2, 0), (0, 0), (1, 0)], 3, [None, 0, 1]),
        (False, [(3, 0), (2, 0), (4, 0), (1, 0)], 4, [None, 0, 1, 2]),
        (True, [(3, 0), (0, 0), (4, 1), (0, 1)], 4, [None, None, None, 2]),
        (True, [(0, 0), (0, 1), (4, 1), (0, 1)], 2, [None, None]),
    ],
)
def test_which_trials_a_plan_makes(monkeypatch, follows, trials, number, known):
    found = [
        SimpleNamespace(left_out=out, positions=[] if arrives else None)
        for out, arrives in trials
    ]
    seen = []

    def trial(task, rng, best):
        seen.append(None if best is None else found.index(best))
        if follows:
            # The car is in the way at its first place alone.
            until = task.streets.until
            assert (until[0] == 0.0).any()
            assert np.isinf(until[1:]).all()
        return found[len(seen) - 1]

    monkeypatch.setattr(traffic_planning, "_better_plan", trial)
    plan = plan_traffic(
        GRAPH, [], vehicles=2, walkers=0, seed=3, duration=4.0, ego=drive,
        ego_box=BOX, drive=SimpleNamespace() if follows else None,
    )  # fmt: skip
    assert plan is found[number - 1]
    assert seen == known
