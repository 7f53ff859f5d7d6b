"""The car-following model against its closed forms."""

import numpy as np
import pytest

from cns_drake.traffic.car_following import (
    HARDEST_BRAKING,
    free_acceleration,
    idm_acceleration,
)


@pytest.mark.parametrize(
    ("v", "gap"), [(5.0, 9.58), (10.0, 19.87), (13.0, 44.36)]
)
def test_keeps_the_equilibrium_gap(v, gap):
    """At (s0 + v T) / sqrt(1 - (v / v0)^4) the acceleration is 0."""
    s0, T, v0, a, b = 2.0, 1.5, 13.9, 1.5, 2.0
    expected = (s0 + v * T) / np.sqrt(1 - (v / v0) ** 4)
    assert expected == pytest.approx(gap, abs=0.005)
    assert idm_acceleration(v, v0, expected, 0.0, a, b, s0, T) == pytest.approx(
        0.0, abs=1e-12
    )
    assert idm_acceleration(v, v0, 1.01 * expected, 0.0, a, b, s0, T) > 0
    assert idm_acceleration(v, v0, 0.99 * expected, 0.0, a, b, s0, T) < 0


def test_integrates_to_the_equilibrium_gap():
    """A following car ends at that gap within 1 %."""
    s0, T, v0, a, b, dt = 2.0, 1.5, 13.9, 1.5, 2.0, 0.1
    leader, x, v = 60.0, 0.0, 4.0
    for _ in range(6000):
        new = max(
            0.0,
            v + dt * idm_acceleration(v, v0, leader - x, v - 10.0, a, b, s0, T),
        )
        x += 0.5 * (v + new) * dt
        leader += 10.0 * dt
        v = new
    assert leader - x == pytest.approx(19.87, rel=0.01)


def test_free_road_and_hard_braking():
    assert free_acceleration(0.0, 10.0, 1.5, 2.0) == 1.5
    assert free_acceleration(10.0, 10.0, 1.5, 2.0) == 0.0
    assert free_acceleration(20.0, 10.0, 1.5, 2.0) == -2.0
    hard = idm_acceleration(15.0, 15.0, 0.01, 15.0, 1.5, 2.0, 2.0, 1.5)
    assert hard == -HARDEST_BRAKING
