"""The full-car model against closed forms of its parts."""

import numpy as np
import pytest

from cns_drake.motion import (
    Suspension,
    load_car_masses,
    load_suspension_rates,
    vehicle_file,
)
from evaluation.base import InputError

GRAVITY = 9.81


def test_rates_and_accelerations_are_derivatives_from_rest_on():
    car = Suspension(
        load_car_masses(vehicle_file()),
        load_suspension_rates(vehicle_file().with_name("suspension.yaml")),
    )
    step = 0.001
    t = np.arange(0.0, 3.0, step)
    rng = np.random.default_rng(4)
    waves = rng.uniform(-1, 1, 7) * np.cos(np.outer(t, rng.uniform(2, 20, 7)))
    inputs = waves * [0.02, 0.02, 0.02, 0.02, 2.0, 3.0, 1.0]
    q, dq, ddq = car.respond(inputs, step)
    np.testing.assert_allclose(q[0], car.at_rest(inputs[0])[:3], atol=1e-12)
    np.testing.assert_allclose(dq[0], 0.0, atol=1e-12)
    for values, derivatives in ((q, dq), (dq, ddq)):
        found = (values[2:] - values[:-2]) / (2 * step)
        scale = np.abs(derivatives).max()
        np.testing.assert_allclose(found, derivatives[1:-1], atol=0.01 * scale)


def test_the_shipped_car_is_a_family_car():
    masses = load_car_masses(vehicle_file())
    assert masses.body == 1480.0
    assert masses.center == pytest.approx((1.3, 0.55))
    assert (masses.roll_inertia, masses.pitch_inertia) == pytest.approx(
        (560.0, 2450.0)
    )
    assert sorted(map(tuple, masses.p_BWset)) == [
        (0.0, -0.79),
        (0.0, 0.79),
        (2.8, -0.79),
        (2.8, 0.79),
    ]
    # Strut and wheel; in front a knuckle, too.
    front = masses.p_BWset[:, 0] > 1.0
    np.testing.assert_array_equal(masses.wheels, np.where(front, 44.0, 32.0))
    car = Suspension(
        masses,
        load_suspension_rates(vehicle_file().with_name("suspension.yaml")),
    )
    one_g = GRAVITY * np.eye(7)
    assert np.degrees(car.at_rest(one_g[5])[1]) == pytest.approx(5.7, abs=0.05)
    assert np.degrees(car.at_rest(-one_g[4])[2]) == pytest.approx(3.1, abs=0.05)


def test_rates_that_are_none(tmp_path):
    path = tmp_path / "suspension.yaml"
    path.write_text("spring_rate: {front: -1, rear: 2}\n")
    with pytest.raises(InputError, match=r"suspension.yaml: .*spring_rate"):
        load_suspension_rates(path)
