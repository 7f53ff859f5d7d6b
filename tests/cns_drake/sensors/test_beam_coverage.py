"""The field of view of beams: limits of cells, poles, the seam at 180 deg."""

import numpy as np
import pytest

from cns_drake.sensors.lidar.patterns import BeamCoverage


def direction(azimuth_deg, elevation_deg):
    a, e = np.radians([azimuth_deg, elevation_deg])
    return [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]


@pytest.mark.parametrize("azimuth_deg", [30.5, -0.5, 179.5, -179.5])
@pytest.mark.parametrize(
    ("side", "up", "is_covered"),
    [
        (0.0, 0.0, True),
        (1.5 - 1e-6, 0.0, True),
        (1.5 + 1e-6, 0.0, False),
        (-1.5 + 1e-6, 1.5 - 1e-6, True),
        (0.0, 1.5 + 1e-6, False),
        (0.0, -1.5 + 1e-6, True),
        (0.0, -1.5 - 1e-6, False),
    ],
)
def test_a_beam_covers_its_cell_and_those_around_it(
    azimuth_deg, side, up, is_covered
):
    """The beam is in the middle of its cell, also beside the seam."""
    coverage = BeamCoverage(np.array([direction(azimuth_deg, 10.5)]))
    other = np.array([direction(azimuth_deg + side, 10.5 + up)])
    assert coverage.covers(other).tolist() == [is_covered]


def test_straight_up_and_down():
    poles = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert BeamCoverage(poles).covers(poles).all()
    assert not BeamCoverage(poles[:1]).covers(poles[1:]).any()
