"""The field of view of beams: limits of cells, poles, the seam at 180 deg."""

import numpy as np
import pytest

from cns_drake.sensors import BeamCoverage, SpinningPattern, make_beam_pattern
from evaluation.drives import lidar_field
from evaluation.lidar_sheets import LIDAR_PRESETS


def direction(azimuth_deg, elevation_deg):
    a, e = np.radians([azimuth_deg, elevation_deg])
    return [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]


@pytest.mark.parametrize("azimuth_deg", [30.125, -0.125, 179.875, -179.875])
@pytest.mark.parametrize(
    ("side", "up", "is_covered"),
    [
        (0.0, 0.0, True),
        (0.375 - 1e-6, 0.0, True),
        (0.375 + 1e-6, 0.0, False),
        (-0.375 + 1e-6, 0.375 - 1e-6, True),
        (0.0, 0.375 + 1e-6, False),
        (0.0, -0.375 + 1e-6, True),
        (0.0, -0.375 - 1e-6, False),
    ],
)
def test_a_beam_covers_its_cell_and_those_around_it(
    azimuth_deg, side, up, is_covered
):
    """The beam is in the middle of its cell, also beside the seam."""
    coverage = BeamCoverage(np.array([direction(azimuth_deg, 10.125)]))
    other = np.array([direction(azimuth_deg + side, 10.125 + up)])
    assert coverage.covers(other).tolist() == [is_covered]


@pytest.mark.parametrize("preset", LIDAR_PRESETS)
def test_the_field_of_view_of_presets(preset):
    """All near to rings is covered, and nothing 0.5 deg beyond the last."""
    field = lidar_field(preset)
    pattern = make_beam_pattern(preset)
    if field is None or not isinstance(pattern, SpinningPattern):
        pytest.skip("its field of view has a shape of its own")
    coverage = BeamCoverage(pattern.beams(0).d_Sset)
    rng = np.random.default_rng(4)
    elevation = rng.uniform(field.lowest_deg - 6, field.highest_deg + 6, 5000)
    azimuth = rng.uniform(-180.0, 180.0, 5000)
    covered = coverage.covers(np.transpose(direction(azimuth, elevation)))
    inside = (elevation > field.lowest_deg) & (elevation < field.highest_deg)
    rings = np.rad2deg(pattern.elevations_rad)
    inside &= np.abs(elevation[:, None] - rings).min(axis=1) < 1.5
    assert covered[inside].all()
    far = elevation < field.lowest_deg - 0.5
    far |= elevation > field.highest_deg + 0.5
    assert far.sum() > 500
    assert not covered[far].any()


def test_the_ends_of_a_turn():
    """A plane of 270 deg has an end on both sides, and none above."""
    pattern = make_beam_pattern("hokuyo-ust-20lx")
    coverage = BeamCoverage(pattern.beams(0).d_Sset)
    for azimuth, elevation, is_covered in (
        (134.9, 0.0, True),
        (-134.9, 0.0, True),
        (135.6, 0.0, False),
        (-135.6, 0.0, False),
        (180.0, 0.0, False),
        (0.0, 0.6, False),
        (0.0, -0.6, False),
    ):
        one = np.array([direction(azimuth, elevation)])
        assert coverage.covers(one).tolist() == [is_covered]


def test_beams_cover_their_own_points():
    """Also where coordinates are rounded near the LiDAR."""
    for name in ("cns", "vlp-16", "avia", "mid-360"):
        beams = make_beam_pattern(name).beams(0).d_Sset
        coverage = BeamCoverage(beams)
        points = np.rint(beams * 0.8 * 1024.0) / 1024.0
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        assert coverage.covers(points).all()


def test_straight_up_and_down():
    poles = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert BeamCoverage(poles).covers(poles).all()
    assert not BeamCoverage(poles[:1]).covers(poles[1:]).any()


def test_beams_far_apart_cover_as_much_between_them():
    """Columns 10 deg apart are one field of view, and cover parts of it."""
    beams = np.array([direction(a, 3.1) for a in np.arange(-60.0, 61.0, 10.0)])
    coverage = BeamCoverage(beams)
    for azimuth, is_covered in (
        (1.4, True),
        (-1.4, True),
        (5.0, False),
        (61.4, False),
        (58.6, True),
    ):
        one = np.array([direction(azimuth, 3.1)])
        assert coverage.covers(one).tolist() == [is_covered], azimuth
