"""Piecewise polynomial motions."""

import numpy as np
import pytest

from cns_drake.traffic.tracks import Tracks


@pytest.fixture
def tracks():
    rng = np.random.default_rng(5)
    return Tracks(0.1, np.cumsum(rng.uniform(0, 1, (20, 3, 2)), axis=0))


def test_values_are_the_integrals_of_rates(tracks):
    """Gauss and Legendre's rule, which is exact for cubics, is the oracle."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    for k in range(19):
        for low, high in ((0.0, 0.1), (0.03, 0.08)):
            t = 0.1 * k + low + (high - low) * (nodes + 1) / 2
            rates = np.array([tracks.at(one)[1] for one in t])
            moved = np.tensordot(weights, rates, 1) * (high - low) / 2
            a, b = (tracks.at(0.1 * k + end)[0] for end in (low, high))
            np.testing.assert_allclose(b - a, moved, atol=1e-9)


def test_goes_through_its_values_smoothly(tracks):
    for k in range(1, 19):
        value, rate = tracks.at(0.1 * k)
        np.testing.assert_allclose(value, tracks.values[k], atol=1e-9)
        np.testing.assert_allclose(
            rate, tracks.at(0.1 * k - 1e-9)[1], atol=1e-5
        )


def test_goes_straight_on_before_and_after(tracks):
    for t, end in ((-1.3, 0.0), (3.2, 1.9)):
        (value, rate), (expected, speed) = tracks.at(t), tracks.at(end)
        np.testing.assert_allclose(rate, speed)
        np.testing.assert_allclose(value, expected + (t - end) * speed)


@pytest.mark.parametrize("absent", [0, 3])
def test_constant_acceleration_is_exact_from_first_to_last(absent):
    """Also where a body comes later and goes earlier than others."""

    def place(t):
        return 7.0 + 10.0 * t - 1.5 * t**2

    values = place(np.arange(12.0))[:, None, None]
    present = np.ones((12, 1), bool)
    present[:absent] = present[12 - absent :] = False
    values[~present] = 1e6
    tracks = Tracks(1.0, values, present)
    for t in np.linspace(absent, 10.99 - absent, 45):
        value, rate = tracks.at(t)
        assert value == pytest.approx(place(t))
        assert rate == pytest.approx(10.0 - 3.0 * t)


def test_objects_that_come_and_go():
    values = np.arange(6.0).reshape(6, 1, 1)
    present = np.array([[0], [0], [1], [1], [1], [0]], bool)
    tracks = Tracks(1.0, values, present)
    seen = [bool(tracks.is_present(t)[0]) for t in (0.5, 1.5, 2.0, 3.9, 4.5)]
    assert seen == [False, False, True, True, False]
    # The motion is not continued before its begin.
    values[:2] = 1e6
    assert tracks.at(2.5)[0] == pytest.approx(2.5)


@pytest.mark.parametrize("comes_and_goes", [False, True])
def test_many_times_give_what_each_gives(tracks, comes_and_goes):
    if comes_and_goes:
        here = np.random.default_rng(6).random((20, 3)) < 0.7
        tracks = Tracks(tracks.dt, tracks.values, here)
    t = np.concatenate([[-0.1, 0.0, 1.9, 2.5], np.arange(0.0, 2.0, 0.037)])
    values, rates = tracks.at(t)
    for k, one in enumerate(t):
        np.testing.assert_array_equal(values[k], tracks.at(one)[0])
        np.testing.assert_array_equal(rates[k], tracks.at(one)[1])
        np.testing.assert_array_equal(
            tracks.is_present(t)[k], tracks.is_present(one)
        )
