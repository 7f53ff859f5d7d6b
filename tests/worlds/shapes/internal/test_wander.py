"""Drivers who wander and change lanes, against closed forms and real drives."""

import math

import numpy as np
import pytest
import shapely

from worlds.shapes import FINE_SPACING, LanePath
from worlds.shapes.paths.driver_offsets import _change_lanes, _draw_offsets

NOTHING = shapely.STRtree([])


def straight(length, beside=(0.0, 0.0)):
    x = np.arange(0.0, length, FINE_SPACING)
    points = np.column_stack([x, np.zeros((len(x), 2))])
    lanes = np.tile(beside, (len(x), 1))
    return LanePath(points, FINE_SPACING, np.full(len(x), np.inf), lanes)


@pytest.mark.parametrize(("spread", "length"), [(0.35, 50.0), (0.2, 20.0)])
def test_wander_has_its_spread_and_its_length(spread, length):
    far = np.full(1_000_000, 9.0)
    offset = _draw_offsets(-far, far, spread, length, np.random.default_rng(1))
    assert abs(offset.mean()) < 0.03 * spread
    assert offset.std() == pytest.approx(spread, rel=0.03)
    lag = round(length / FINE_SPACING)
    correlation = np.mean(offset[lag:] * offset[:-lag]) / offset.var()
    assert correlation == pytest.approx(1 / math.e, abs=0.02)


@pytest.mark.slow
def test_changes_of_lane_have_their_rate_and_lengths():
    path = straight(30_000.0, (0.0, 3.5))
    rng = np.random.default_rng(3)
    y = _change_lanes(path, NOTHING, 2.0, rng)[:, 1]
    assert y.max() == 0.0
    assert y.min() == pytest.approx(-3.5)
    edges = np.flatnonzero(np.diff(y < -1.75, prepend=False))
    lengths = FINE_SPACING * (edges[1::2] - edges[::2])
    # Episodes of at least the 80 m of a way over reach their whole width.
    whole = lengths[lengths > 80.0]
    assert whole.max() <= 270.0 + FINE_SPACING
    ratio = math.log(270 / 15)
    mean = (270 - 15) / ratio
    # The rate counts from the end of one episode to the start of the next.
    episodes = 30_000 / (500.0 + 40.0 + mean)
    expected = episodes * math.log(270 / 80) / ratio
    assert len(whole) == pytest.approx(expected, abs=3 * math.sqrt(expected))
    expected = math.log(150 / 80) / math.log(270 / 80)
    assert np.mean(whole < 150) == pytest.approx(expected, abs=0.15)
