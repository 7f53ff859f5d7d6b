"""Errors of a unit, and the texture of surfaces, in calibrated returns."""

from dataclasses import replace

from helpers.plates import facing, plate, scan, unit
import numpy as np
from pydrake.math import RigidTransform
import pytest

from cns_drake.scene.structure_table import StructureEntry, StructureTable
from cns_drake.sensors.lidar.presets import make_beam_pattern
from cns_drake.sensors.returns.calibrated import CalibratedReturns
from cns_drake.sensors.returns.unit_sheets import Response

ROAD = StructureTable([StructureEntry(1, "asphalt", "road")])


def offsets(seed, frame=0, name="lidar"):
    """Returns the mean error of range of each laser of an HDL-64E [m]."""
    returns = CalibratedReturns.of_preset(
        "hdl-64e", seed=seed, unit_seed=7, sensor_name=name
    )
    returns = replace(returns, sheet=replace(returns.sheet, angle_error_deg=0))
    pattern = make_beam_pattern("hdl-64e").within((-8, 8))
    points = scan([plate("wall", 0.8, facing(8.0))], pattern, returns, frame)
    p = np.stack([points[axis] for axis in "xyz"], axis=1)
    error = np.linalg.norm(p, axis=1) * (1.0 - 8.0 / p[:, 0])
    number = np.bincount(points["ring"], minlength=64)
    return np.bincount(points["ring"], error, minlength=64) / number


def test_errors_of_range_belong_to_the_unit():
    one, again = offsets(1), offsets(2, frame=5)
    other = offsets(1, name="other")
    assert 0.6 * 0.016 < one.std() < 1.4 * 0.016
    # What differs is the mean over 46 shots of 12 mm.
    assert np.std(one - again) < 0.004
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.4


def test_reported_angles_are_nominal_and_true_ones_are_not():
    pattern = make_beam_pattern("hdl-64e")
    beams = pattern.beams(0)
    returns = CalibratedReturns.of_preset("hdl-64e", unit_seed=3)
    turn = returns.turn(beams)
    true, nominal = turn.d_Sset, beams.d_Sset[beams.packet_order]
    np.testing.assert_allclose(np.linalg.norm(true, axis=1), 1.0, atol=1e-12)
    ring = beams.ring[beams.packet_order]
    up = np.degrees(np.arcsin(true[:, 2]) - np.arcsin(nominal[:, 2]))
    round_ = np.angle(
        (true[:, 0] + 1j * true[:, 1]) / (nominal[:, 0] + 1j * nominal[:, 1]),
        deg=True,
    )
    for error in (up, round_):
        of_laser = np.array([error[ring == k].mean() for k in range(64)])
        np.testing.assert_allclose(error, of_laser[ring], atol=1e-4)
        assert 0.04 < of_laser.std() < 0.08
    points = scan([plate("wall", 0.8, facing(8.0))], pattern, returns)
    p = np.stack([points[axis] for axis in "xyz"], axis=1)
    elevation = np.arcsin(p[:, 2] / np.linalg.norm(p, axis=1))
    expected = np.array(pattern.elevations_rad)[points["ring"]]
    np.testing.assert_allclose(elevation, expected, atol=1e-6)


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
def test_speckle_gain_floor_and_zeros(speckle):
    base = unit()
    response = Response(gain=0.0, speckle=speckle, floor=50.0, zeros=0.1)
    returns = replace(base, sheet=replace(base.sheet, response=response))
    pattern = make_beam_pattern("os1-128").within((-10, 10), (-10, 10))
    bright = scan([plate("wall", 0.6, facing(8.0))], pattern, returns)
    bright = bright["intensity"]
    assert np.mean(bright == 0.0) == pytest.approx(
        0.1 if speckle == 0.0 else 0.1 + 0.9 * 0.19, abs=0.04
    )
    assert bright[bright > 0.0].min() >= 50.0
    if speckle == 0.0:
        assert bright.max() <= 60.0
    else:
        assert bright.max() > 75.0


def test_what_fades_is_dark_near_the_threshold():
    base = unit()
    response = Response(1.0, 0.5, True, gain=0.0, speckle=0.0)
    returns = replace(base, sheet=replace(base.sheet, response=response))
    pattern = make_beam_pattern("os1-128").within((-5, 5), (-5, 5))
    near, far = (
        np.median(
            scan([plate("wall", 0.2, facing(x))], pattern, returns)["intensity"]
        )
        for x in (3.0, 50.0)
    )
    assert near == pytest.approx(100.0 * 0.2**0.5, abs=1.5)
    assert far < 0.7 * near
