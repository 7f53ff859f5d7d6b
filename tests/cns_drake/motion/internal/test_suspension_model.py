"""The full-car model against closed forms of its parts."""

import numpy as np
import pytest

from cns_drake.motion import Suspension
from cns_drake.motion.suspension import AxleRates, CarMasses, SuspensionRates

GRAVITY = 9.81


def rates(spring, damper, tyre, bar):
    return SuspensionRates(
        spring_rate=AxleRates(front=spring[0], rear=spring[1]),
        damping_rate=AxleRates(front=damper, rear=damper),
        tyre_rate=AxleRates(front=tyre, rear=tyre),
        roll_bar_rate=AxleRates(front=bar[0], rear=bar[1]),
    )


# The car's centre of mass is in its middle.
CAR = CarMasses(
    body=1200.0,
    roll_inertia=500.0,
    pitch_inertia=2000.0,
    center=(1.3, 0.5),
    wheels=np.array([40.0, 40.0, 40.0, 40.0]),
    p_BWset=np.array([[2.6, 0.8], [2.6, -0.8], [0.0, 0.8], [0.0, -0.8]]),
)
SPRING = 20e3  # [N/m]
DAMPER = 1500.0  # [N s/m]
TYRE = 180e3  # [N/m]
SERIES = SPRING * TYRE / (SPRING + TYRE)


def test_static_tilt_is_that_of_springs_in_series_with_tyres():
    bar = 12e3
    car = Suspension(CAR, rates((SPRING, SPRING), DAMPER, TYRE, (bar, bar)))
    braking, leftward, falling = np.eye(7)[4:] * [[-2.0], [3.0], [-1.0]]
    weight = CAR.body * 0.5
    q = car.at_rest(braking)
    stiffness = 4 * SERIES * 1.3**2
    # Nose down.
    assert q[2] == pytest.approx(2.0 * weight / (stiffness - weight * GRAVITY))
    np.testing.assert_allclose(q[:2], 0.0, atol=1e-12)

    q = car.at_rest(leftward)
    body = 4 * SPRING * 0.8**2 + 2 * bar
    axles = 4 * TYRE * 0.8**2
    stiffness = body * axles / (body + axles)
    # Right side down.
    assert q[1] == pytest.approx(3.0 * weight / (stiffness - weight * GRAVITY))
    np.testing.assert_allclose(q[[0, 2]], 0.0, atol=1e-12)

    # Without weight, springs and tyres stretch.
    q = car.at_rest(falling)
    tyres = (CAR.body / 4 + 40.0) / TYRE
    np.testing.assert_allclose(q[3:], tyres)
    assert q[0] == pytest.approx(tyres + CAR.body / 4 / SPRING)


def test_a_tilted_road_tilts_the_car():
    weightless = CarMasses(**{**vars(CAR), "center": (1.3, 0.0)})
    car = Suspension(
        weightless, rates((SPRING, SPRING), DAMPER, TYRE, (9e3, 0.0))
    )
    x, y = CAR.p_BWset.T
    inputs = np.concatenate([0.1 + 0.02 * y - 0.03 * (x - 1.3), np.zeros(3)])
    q = car.at_rest(inputs)
    np.testing.assert_allclose(q[:3], [0.1, 0.02, 0.03], atol=1e-12)
    np.testing.assert_allclose(q[3:], inputs[:4], atol=1e-12)


@pytest.mark.parametrize("frequency", [0.5, 1.2, 4.0, 11.0])
def test_heave_on_waves_is_that_of_a_quarter_car(frequency):
    car = Suspension(CAR, rates((SPRING, SPRING), DAMPER, TYRE, (0.0, 0.0)))
    step = 0.002
    t = np.arange(0.0, 16.0, step)
    omega = 2 * np.pi * frequency
    inputs = np.zeros((len(t), 7))
    inputs[:, :4] = 0.01 * np.sin(omega * t)[:, None]
    answers = car.respond(inputs, step)

    # m z'' = k (u - z) + c (u' - z'), M u'' = kt (w - u) - the body's force.
    s = 1j * omega
    link = SPRING + DAMPER * s
    body = CAR.body / 4 * s**2
    share = link / (body + link)
    gain = share * TYRE / (TYRE + 40.0 * s**2 + link * (1 - share))
    late = t > 10.0
    for k, answer in enumerate(answers):
        expected = 0.01 * np.imag(gain * s**k * np.exp(s * t))
        size = np.abs(expected).max()
        np.testing.assert_allclose(
            answer[late, 0], expected[late], atol=0.01 * size
        )
        np.testing.assert_allclose(answer[:, 1:], 0.0, atol=1e-9 * size)
