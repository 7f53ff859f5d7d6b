"""Errors of a unit, and the texture of surfaces, in calibrated returns."""

from dataclasses import replace

from helpers.plates import facing, plate, scan, unit
import numpy as np
from pydrake.geometry import HalfSpace
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.sensors import (
    CalibratedReturns,
    describe_unit,
    make_beam_pattern,
    make_lidar_config,
    make_pattern,
)
from evaluation.lidar_sheets import Response
from worlds.shapes import StructureEntry, StructureTable

# Elevations of the first and the last laser of each block of an HDL-64E [deg].
LIMITS = 2.0, -8.33, -8.83, -24.33
ROAD = StructureTable([StructureEntry(1, "asphalt", "road")])


def offsets(seed, frame=0, name="lidar"):
    """Returns the mean error of range of each laser of an HDL-64E [m]."""
    returns = CalibratedReturns.of_preset(
        "hdl-64e", seed=seed, unit_seed=7, sensor_name=name
    )
    returns = replace(returns, sheet=returns.sheet.replaced(angle_error_deg=0))
    pattern = make_beam_pattern("hdl-64e").within((-8, 8))
    points = scan([plate("wall", 0.8, facing(8.0))], pattern, returns, frame)
    p = np.stack([points[axis] for axis in "xyz"], axis=1)
    error = np.linalg.norm(p, axis=1) * (1.0 - 8.0 / p[:, 0])
    number = np.bincount(points["ring"], minlength=64)
    return np.bincount(points["ring"], error, minlength=64) / number


def test_errors_of_range_belong_to_the_unit():
    one, again = offsets(1), offsets(2, frame=5)
    other = offsets(1, name="other")
    assert 0.6 * 0.035 < one.std() < 1.4 * 0.035
    # What differs is the mean over 46 shots of 9 mm.
    assert np.std(one - again) < 0.003
    # Every second laser measures farther; lower ones are off by 0.7 of that.
    block = np.where(np.arange(64) < 32, 1.0, 0.7)
    shared = 0.024 * block * np.where(np.arange(64) % 2, -1.0, 1.0)
    rest, other_rest = one - shared, other - shared
    assert abs(np.corrcoef(rest, other_rest)[0, 1]) < 0.4
    assert 0.6 * 0.026 < np.std(rest / block) < 1.4 * 0.026


def test_reported_angles_are_nominal_and_true_ones_are_not():
    pattern = make_beam_pattern("hdl-64e")
    beams = pattern.beams(0)
    returns = CalibratedReturns.of_preset("hdl-64e", unit_seed=3)
    unit = returns.unit_beams(beams)
    true = unit.d_Sset
    nominal = beams.d_Sset[beams.packet_order]
    np.testing.assert_allclose(np.linalg.norm(true, axis=1), 1.0, atol=1e-12)
    ring = beams.ring[beams.packet_order]
    up = np.degrees(np.arcsin(true[:, 2]) - np.arcsin(nominal[:, 2]))
    round_ = np.angle(
        (true[:, 0] + 1j * true[:, 1]) / (nominal[:, 0] + 1j * nominal[:, 1]),
        deg=True,
    )
    # Each laser has an azimuth of its own, too, up to a step of 0.09 deg aside.
    azimuth = np.hypot(0.015, 2.0 * 0.09 / 12**0.5)
    for error, size in ((up, 0.015), (round_, azimuth)):
        of_laser = np.array([error[ring == k].mean() for k in range(64)])
        np.testing.assert_allclose(error, of_laser[ring], atol=1e-4)
        assert size / 1.5 < of_laser.std() < size / 0.75
    points = scan([plate("wall", 0.8, facing(8.0))], pattern, returns)
    p = np.stack([points[axis] for axis in "xyz"], axis=1)
    # Blocks are at these heights, by the sheet.
    p[:, 2] -= np.where(points["ring"] < 32, 0.21, 0.13)
    elevation = np.arcsin(p[:, 2] / np.linalg.norm(p, axis=1))
    expected = np.array(pattern.elevations_rad)[points["ring"]]
    np.testing.assert_allclose(elevation, expected, atol=1e-6)
    # Azimuths of a laser are whole steps apart.
    steps = np.arctan2(p[:, 1], p[:, 0]) / np.radians(0.09)
    for ring in (0, 31, 32, 63):
        rest = np.exp(2j * np.pi * steps[points["ring"] == ring])
        assert abs(rest.mean()) > 0.999


def test_calibrated_returns_have_the_elevations_of_a_real_unit():
    """They are those of KITTI's HDL-64E; ideal ones are the manual's."""
    ideal = make_lidar_config("hdl-64e")
    calibrated = ideal.replaced(returns="calibrated")
    nominal, own = (
        np.degrees(make_pattern(one).elevations_rad)
        for one in (ideal, calibrated)
    )
    np.testing.assert_allclose(nominal[[0, 31, 32, 63]], LIMITS)
    assert len(own) == 64
    assert (np.diff(own) < 0.0).all()
    # Blocks have steps of a third and half a degree, and are tilted a little.
    assert -np.diff(own[:32]).mean() == pytest.approx(1 / 3, rel=0.05)
    assert -np.diff(own[32:]).mean() == pytest.approx(1 / 2, rel=0.05)
    assert 0.03 < np.diff(own[:32]).std() < 0.06
    described = describe_unit(calibrated)["elevations_deg"]
    np.testing.assert_allclose(described, own, atol=1e-6)
    other = make_lidar_config("vlp-16").replaced(returns="calibrated")
    assert make_pattern(other).elevations_rad[0] == np.radians(15.0)


def test_some_lasers_are_dim():
    base = unit()
    pattern = make_beam_pattern("os1-128")
    gains = {}
    for dim in (0.0, 3.0):
        response = Response(gain=0.1, dim=dim)
        returns = replace(base, sheet=base.sheet.replaced(response=response))
        gains[dim] = returns.unit_beams(pattern.beams(0)).gain[:128]
    even, dim = gains.values()
    expected = np.where(even < 0.9, 0.9 + 4.0 * (even - 0.9), even)
    np.testing.assert_allclose(dim, np.maximum(expected, 0.0))
    assert 5 < np.sum(dim < 0.85) < 30


def test_every_second_shot_of_a_laser_is_brighter():
    base = unit()
    pattern = make_beam_pattern("os1-128")
    response = Response(gain=0.0, flicker=0.1)
    returns = replace(base, sheet=base.sheet.replaced(response=response))
    beams = pattern.beams(0)
    brighter = returns.unit_beams(beams).gain - 1.0
    is_odd = beams.column % 2 == 1
    of_laser = brighter[is_odd][:128]
    np.testing.assert_allclose(
        brighter, np.where(is_odd, 1.0, -1.0) * of_laser[beams.ring], atol=1e-12
    )
    assert 0.07 < of_laser.std() < 0.13


def test_an_hdl_64e_reports_no_faint_echoes_however_near():
    pattern = make_beam_pattern("hdl-64e").within((-2, 2), (-2, 2))
    returns = CalibratedReturns.of_preset("hdl-64e")
    for reflectivity, is_seen in ((0.0089, False), (0.0093, True)):
        wall = plate("wall", reflectivity, facing(4.0))
        assert (len(scan([wall], pattern, returns)) > 0) == is_seen
    wall = plate("wall", 0.0089, facing(4.0))
    assert len(scan([wall], pattern, unit())) > 0


def test_beams_start_at_their_lasers():
    whole = make_beam_pattern("hdl-64e")
    pattern = whole.within((-8, 8))
    returns = CalibratedReturns.of_preset("hdl-64e", unit_seed=3)
    returns = replace(returns, sheet=returns.sheet.replaced(angle_error_deg=0))
    wall = plate("wall", 0.8, facing(8.0), (0.1, 400.0, 0.4))
    points = scan([wall], pattern, returns)
    height = np.where(np.arange(64) < 32, 0.21, 0.13)
    met = height + 8.0 * np.tan(whole.elevations_rad)
    # Beams beside an edge may meet it or not.
    for is_met, least in ((np.abs(met) < 0.19, 40), (np.abs(met) > 0.21, 0)):
        found = np.bincount(points["ring"], minlength=64)[is_met]
        assert (found >= least).all() if least else not found.any()


def test_things_hang_on_fronts():
    house = StructureTable([StructureEntry(1, "house", "building")])
    pattern = make_beam_pattern("os1-128").within((-20, 20))
    front = plate("house", None, facing(9.0))
    points = scan([front], pattern, unit(), structures=house)
    out = 9.0 - points["x"]
    assert 0.05 < np.mean(out > 0.12) < 0.15
    assert out.min() > -0.2
    assert out.max() < 0.55


def test_one_of_four_rays_passes_a_spray():
    tree = StructureTable([StructureEntry(1, "tree", "vegetation")])
    # From afar there are thousands of clumps.
    X_WG = RigidTransform(RollPitchYaw(0.0, -np.pi / 2, 0.0), [60.0, 0.0, 0.0])
    spray = plate("tree/leaves", None, X_WG, shape=HalfSpace())
    wall = plate("behind", 0.9, facing(63.0))
    pattern = make_beam_pattern("os1-128").within((-30, 30), (-15, 15))
    points = scan([spray, wall], pattern, unit(), structures=tree)
    passed = np.mean(points["x"] > 62.0)
    assert passed == pytest.approx(np.exp(-1.4), abs=0.02)


def road(x, distance, returns, seed=5):
    """Scans a wall of asphalt from a place x away from it along the world."""
    X_WG = RigidTransform([x + distance, 0.0, 0.0])
    pattern = make_beam_pattern("os1-128").within((-20, 20), (-20, 20))
    wall = plate("asphalt", None, X_WG)
    return scan([wall], pattern, replace(returns, seed=seed), structures=ROAD)


def test_texture_belongs_to_the_surface():
    returns = unit()
    points, again = (road(0.0, 9.0, returns, seed) for seed in (1, 2))
    assert np.std(points["intensity"]) > 1.0
    # Noise of ranges alone moves a few points into other grains.
    same = points["intensity"] == again["intensity"]
    assert np.mean(same) > 0.95
    given = scan(
        [plate("asphalt", 0.15, RigidTransform([9.0, 0.0, 0.0]))],
        make_beam_pattern("os1-128").within((-20, 20), (-20, 20)),
        returns,
        structures=ROAD,
    )
    assert np.std(given["intensity"]) < 0.6


@pytest.mark.parametrize("speckle", [0.0, 0.2])
def test_speckle_gain_and_floor(speckle):
    base = unit()
    response = Response(gain=0.0, speckle=speckle, floor=50.0)
    returns = replace(base, sheet=base.sheet.replaced(response=response))
    pattern = make_beam_pattern("os1-128").within((-10, 10), (-10, 10))
    bright = scan([plate("wall", 0.6, facing(8.0))], pattern, returns)
    bright = bright["intensity"]
    # 60 is less than 50 where 0.2 n^3 / sqrt(15) is below -1 / 6.
    assert np.mean(bright == 0.0) == pytest.approx(
        0.0 if speckle == 0.0 else 0.070, abs=0.025
    )
    assert bright[bright > 0.0].min() >= 50.0
    if speckle == 0.0:
        assert bright.max() <= 60.0
    else:
        assert bright.max() > 75.0


@pytest.mark.parametrize(
    ("reflectivity", "distance", "expected"),
    [
        (0.5, 5.0, 60.0 + 15.0 * np.log(0.5)),
        (0.5, 9.9, 60.0 + 15.0 * np.log(0.5)),
        # It does not make up for what is lost beyond.
        (0.5, 20.0, 60.0 + 15.0 * np.log(0.5 / 4.0)),
        (0.5, 40.0, 0.0),
        (0.04, 5.0, 60.0 + 15.0 * np.log(0.04)),
        (0.03, 5.0, 0.0),
    ],
)
def test_intensity_by_the_logarithm(reflectivity, distance, expected):
    base = unit()
    response = Response(
        slope=15.0, full=60.0, far=10.0, floor=10.0, gain=0.0, speckle=0.0
    )
    returns = replace(base, sheet=base.sheet.replaced(response=response))
    pattern = make_beam_pattern("os1-128").within((-5, 5), (-5, 5))
    wall = plate("wall", reflectivity, facing(distance))
    points = scan([wall], pattern, returns)
    assert np.median(points["intensity"]) == pytest.approx(expected, abs=0.7)
