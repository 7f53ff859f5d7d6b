"""Sloping ground: closed forms of the field, its streets and its pads."""

from functools import cache

import numpy as np
import pytest

from cns_drake.city.ground.elevation import (
    with_gaps_filled,
)
from cns_drake.roads import load_road_network

# Two parallel roads, 60 m apart and 6 m apart in height. A ramp joins their
# eastern ends.
ROADS = """
defaults: {sidewalk: 2.0, kerb_height: 0.2, lane_width: 3.5}
junctions:
  a: {position: [-60, -20], height: 1.0, dead_end: true, kerb_radius: 4}
  b: {position: [120, -20], height: 1.0, kerb_radius: 5}
  c: {position: [120, 40], height: 7.0, kerb_radius: 5}
  d: {position: [-60, 40], height: 7.0, dead_end: true, kerb_radius: 4}
roads:
  low: {start: a, end: b}
  ramp: {start: b, end: c}
  high: {start: c, end: d}
"""


@cache
def network(folder):
    path = folder / "roads.yaml"
    path.write_text(ROADS)
    return load_road_network(path)


@pytest.fixture
def roads(tmp_path_factory):
    return network(tmp_path_factory.getbasetemp())


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
