"""Sloping ground: closed forms of the field, its streets and its pads."""

import numpy as np

from worlds.city.ground.elevation import with_gaps_filled


def test_relaxed_fills_a_strip_linearly():
    z = np.full((5, 9), np.nan)
    z[:, 0], z[:, -1] = 2.0, 10.0
    expected = np.tile(np.linspace(2.0, 10.0, 9), (5, 1))
    np.testing.assert_allclose(with_gaps_filled(z), expected, atol=1e-9)


def test_relaxed_keeps_a_harmonic_polynomial():
    """x^2 - y^2 and x y solve the five-point Laplace equation exactly."""
    y, x = np.mgrid[0:12, 0:15].astype(float)
    z = 0.3 * (x**2 - y**2) - 0.2 * x * y + x
    holes = z.copy()
    holes[1:-1, 1:-1] = np.nan
    np.testing.assert_allclose(with_gaps_filled(holes), z, atol=1e-9)
