"""The equation of echoes, against data sheets and closed forms."""

from helpers.plates import ahead, facing, plate, scan, unit
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
from scipy.special import lambertw

from cns_drake.sensors import Weather
from evaluation.lidar_sheets import LIDAR_PRESETS
from worlds.shapes import CLASS_IDS

ROWS = [
    (name, row) for name, s in LIDAR_PRESETS.items() for row in s.returns.rows
]


def share(distance, reflectivity, returns, num_beams=12_000, **options):
    """Returns the part of beams that a plate at a distance returns."""
    target = plate("target", reflectivity, facing(distance))
    points = scan([target], ahead(num_beams), returns, **options)
    return np.count_nonzero(points["label"] != CLASS_IDS["outlier"]) / num_beams


@pytest.mark.parametrize(("preset", "row"), ROWS)
def test_sheets_are_reproduced(preset, row):
    found = share(row.range, row.reflectivity, unit(preset))
    assert found == pytest.approx(row.probability, abs=0.02)


def test_a_tilted_plate_is_as_dark_as_its_cosine():
    row = LIDAR_PRESETS["os1-64"].returns.rows[1]
    tilt = np.arccos(0.5)
    # The beams meet the middle of the plate at the sheet's range.
    X_WG = RigidTransform(RollPitchYaw(0.0, 0.0, tilt), [row.range, 0.0, 0.0])
    X_WG = X_WG @ RigidTransform([0.05, 0.0, 0.0])
    target = plate("target", 2.0 * row.reflectivity, X_WG)
    found = len(scan([target], ahead(12_000), unit())) / 12_000
    assert found == pytest.approx(row.probability, abs=0.02)


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0, 60.0])
@pytest.mark.parametrize("distance", [3.0, 12.0, 30.0])
def test_intensity_is_reflectivity_times_cosine(tilt_deg, distance):
    tilt = np.deg2rad(tilt_deg)
    X_WG = RigidTransform(RollPitchYaw(0.0, 0.0, tilt), [distance, 0.0, 0.0])
    X_WG = X_WG @ RigidTransform([0.05, 0.0, 0.0])
    points = scan([plate("target", 0.6, X_WG)], ahead(50), unit())
    expected = np.rint(60.0 * np.cos(tilt))
    np.testing.assert_array_equal(points["intensity"], expected)


@pytest.mark.parametrize(
    ("visibility", "farthest"),
    [(50.0, 25.7), (100.0, 38.2), (200.0, 53.7), (500.0, 76.1)],
)
def test_fog_ends_sight_by_lamberts_function(visibility, farthest):
    row = LIDAR_PRESETS["vlp-16"].returns.rows[0]
    weather = Weather(visibility)
    alpha = weather.extinction
    distance = float(np.real(lambertw(alpha * row.range)) / alpha)
    found = share(distance, row.reflectivity, unit("vlp-16", weather=weather))
    assert found == pytest.approx(row.probability, abs=0.02)
    # The closed form with the known figures for 120 m.
    known = float(np.real(lambertw(alpha * 120.0)) / alpha)
    assert known == pytest.approx(farthest, abs=0.05)


def test_nothing_is_outside_the_limits():
    pattern = ahead(4_000, max_range=20.0)
    for distance in (20.0 - 1e-3, 20.0 + 1e-2, 0.3 - 1e-3, 0.3 + 1e-3):
        target = plate("target", 0.5, facing(distance))
        ranges = np.linalg.norm(
            [scan([target], pattern, unit())[axis] for axis in "xyz"], axis=0
        )
        is_in = 0.3 <= distance <= 20.0
        assert bool(len(ranges)) == is_in
        assert ((ranges >= 0.3 - 1e-6) & (ranges <= 20.0 + 1e-5)).all()
