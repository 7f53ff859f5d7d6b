"""Lines and arcs against closed forms."""

import numpy as np
import pytest

from cns_drake.roads import sample_stations
from cns_drake.roads.centreline import blend


def test_stations_include_both_ends_and_keep_the_spacing():
    stations = sample_stations(2.0, 12.5, 1.0)
    assert stations[0] == 2.0
    assert stations[-1] == 12.5
    assert np.diff(stations).max() <= 1.0
    assert len(sample_stations(0.0, 10.0, 1.0)) == 11


@pytest.mark.parametrize("max_radius", [np.inf, 6.0])
def test_blend_of_a_turn_is_the_widest_allowed_arc(max_radius):
    # The lines meet 20 m ahead of the start, 12 m behind the end.
    points = blend((0, 0), 0.0, (20, 12), np.pi / 2, 0.5, max_radius)
    radius = min(12.0, max_radius)
    centre = np.array([20 - radius, radius])
    on_arc = points[(points[:, 0] > centre[0]) & (points[:, 1] < radius)]
    distance = np.linalg.norm(on_arc - centre, axis=1)
    np.testing.assert_allclose(distance, radius, atol=1e-9)
    np.testing.assert_allclose(points[[0, -1]], [(0, 0), (20, 12)], atol=1e-9)


def test_blend_of_offset_lanes_keeps_the_headings():
    points = blend((0, 0), 0.1, (40, 7), 0.1, 0.01)
    for edge in (points[1] - points[0], points[-1] - points[-2]):
        assert np.arctan2(edge[1], edge[0]) == pytest.approx(0.1, abs=1e-3)
    np.testing.assert_allclose(points[[0, -1]], [(0, 0), (40, 7)], atol=1e-9)
