"""The car-following model against its closed forms."""

import numpy as np
import pytest

from cns_drake.traffic.vehicle_kinds import STANDSTILL_GAP
from cns_drake.traffic.vehicles import (
    HARDEST_BRAKING,
    VEHICLE,
    free_acceleration,
    interaction,
)

V0, T, A, B = 13.9, 1.5, 1.5, 2.0


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


def test_integrates_to_the_equilibrium_gap():
    """A following car ends at that gap within 1 %."""
    leader, x, v, dt = 60.0, 0.0, 4.0, 0.1
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
