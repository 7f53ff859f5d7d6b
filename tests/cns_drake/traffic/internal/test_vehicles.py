"""The car-following model against its closed forms."""

import numpy as np
import pytest

from cns_drake.traffic import CURRENT, VEHICLE
from cns_drake.traffic.car_following import (
    HARDEST_BRAKING,
    free_acceleration,
    interaction,
)
from cns_drake.traffic.streets import PIECE, Streets
from cns_drake.traffic.traffic_planning import vehicle_poses
from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP

# Wanted speed [m/s], headway [s], acceleration and deceleration [m/s^2].
V0 = 13.9
T = 1.5
A = 1.5
B = 2.0


def straight_lanes(lengths, start, along):
    """Returns pieces that follow each other on a line."""
    rows = np.zeros(len(lengths), PIECE)
    points = []
    begin = 0.0
    for row, length in zip(rows, lengths, strict=True):
        row["first"], row["num_points"] = len(points), 5
        row["step"], row["length"] = length / 4, length
        points += [start + s * along for s in begin + length * np.arange(5) / 4]
        begin += length
    nothing = [None] * (len(Streets._fields) - 2)
    return Streets(rows, np.array(points), *nothing)


@pytest.mark.parametrize("s", [0.4, 3.0, 12.0])
def test_a_bus_stands_with_both_axles_on_its_way(s):
    start = np.array([20.0, -30.0, 2.0])
    heading = 2.0
    climb = 0.1
    along = np.array([*(np.cos(climb) * f(heading) for f in (np.cos, np.sin))])
    along = np.append(along, np.sin(climb))
    lengths = [7.0, 2.0, 1.5, 20.0]
    bus = np.zeros(1, VEHICLE)
    bus["length"], bus["front_axle"], bus["rear_axle"] = 12.0, 3.1, -2.8
    bus["path"], bus["left_lane"], bus["s"] = -1, -1, s
    bus["path"][0, CURRENT - 3 : CURRENT + 1] = range(4)
    found = vehicle_poses(straight_lanes(lengths, start, along), bus)
    middle = start + (sum(lengths[:3]) + s - 6.0) * along
    np.testing.assert_allclose(found, [[*middle, heading, -climb]], atol=1e-12)
    # In the middle of a change of lanes it is between both.
    aside = 3.5 * np.array([-np.sin(heading), np.cos(heading), 0.0])
    both = straight_lanes([*lengths, 20.0], start, along)
    both.points[20:] = both.points[15:20] + aside
    bus["s"], bus["left_lane"], bus["change_length"] = 12.0, 4, 40.0
    bus["change_start"] = 12.0 - 6.0 + 0.5 * (3.1 - 2.8) - 20.0
    found = vehicle_poses(both, bus)[0]
    middle = start + (sum(lengths[:3]) + 6.0) * along + 0.5 * aside
    np.testing.assert_allclose(found[:3], middle, atol=0.05)
    # Over the distance of the axles, 15/8 of 3.5 m in 40 m.
    turned = np.arctan(15.0 / 8.0 * 3.5 / 40.0 / np.cos(climb))
    assert found[3] == pytest.approx(heading - turned, abs=0.01)


def car(v):
    """Returns the record of a vehicle at a speed."""
    cars = np.zeros(1, VEHICLE)
    cars["v"], cars["headway"], cars["a"], cars["b"] = v, T, A, B
    return cars[0]


def acceleration(v, gap, approach, v0=V0):
    one = car(v)
    wanted = free_acceleration(one, v0) - interaction(one, gap, approach)
    return max(wanted, -HARDEST_BRAKING)


@pytest.mark.parametrize(
    ("v", "gap"), [(5.0, 9.58), (10.0, 19.87), (13.0, 44.36)]
)
def test_keeps_the_equilibrium_gap(v, gap):
    """At (s0 + v T) / sqrt(1 - (v / v0)^4) the acceleration is 0."""
    expected = (STANDSTILL_GAP + v * T) / np.sqrt(1 - (v / V0) ** 4)
    assert expected == pytest.approx(gap, abs=0.005)
    assert acceleration(v, expected, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert acceleration(v, 1.01 * expected, 0.0) > 0
    assert acceleration(v, 0.99 * expected, 0.0) < 0


def test_brakes_for_a_slower_vehicle():
    """s* grows by v dv / (2 sqrt(a b)), but for one that is faster."""
    for approach, gap in ((4.0, 60.0), (2.0, 40.0), (-30.0, 30.0)):
        wanted = 10.0 * T + 10.0 * approach / (2.0 * np.sqrt(A * B))
        wanted = STANDSTILL_GAP + max(0.0, wanted)
        expected = A * (1 - (10.0 / V0) ** 4 - (wanted / gap) ** 2)
        assert expected > -HARDEST_BRAKING
        assert acceleration(10.0, gap, approach) == pytest.approx(expected)


def test_integrates_to_the_equilibrium_gap():
    """A following car ends at that gap within 1 %."""
    leader = 60.0
    x = 0.0
    v = 4.0
    dt = 0.1
    for _ in range(6000):
        new = max(0.0, v + dt * acceleration(v, leader - x, v - 10.0))
        x += 0.5 * (v + new) * dt
        leader += 10.0 * dt
        v = new
    assert leader - x == pytest.approx(19.87, rel=0.01)


def test_free_road_and_hard_braking():
    assert free_acceleration(car(0.0), 10.0) == A
    assert free_acceleration(car(10.0), 10.0) == 0.0
    assert free_acceleration(car(20.0), 10.0) == -B
    assert acceleration(15.0, 0.01, 15.0, v0=15.0) == -HARDEST_BRAKING
