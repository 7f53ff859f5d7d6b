"""Weather: counts of drops, and independence of sensors and frames."""

from helpers.plates import ahead, plate, scan, unit
import numpy as np
from pydrake.math import RigidTransform
import pytest
from scipy import integrate

from cns_drake.sensors import Weather
from cns_drake.sensors.returns.link_budget import fit_link_budget
from cns_drake.sensors.returns.random_numbers import frame_key, normal, uniform
from cns_drake.sensors.returns.weather import tabulate_scattering
from evaluation.lidar_sheets import LIDAR_PRESETS
from worlds.shapes import CLASS_IDS

OUTLIER = CLASS_IDS["outlier"]


def test_the_table_of_drops_is_an_integral():
    sheet = LIDAR_PRESETS["os1-64"].returns
    weather = Weather(snowfall=0.3)
    table = tabulate_scattering(
        weather, fit_link_budget(sheet), sheet.divergence, sheet.resolution, 0.5
    )
    rate = np.gradient(table.counts, table.distances)
    total = integrate.trapezoid(rate, table.distances)
    assert total == pytest.approx(table.counts[-1], rel=0.02)
    assert (np.diff(table.counts) >= 0.0).all()
    assert table.counts[0] == 0.0


@pytest.mark.parametrize(
    "weather", [Weather(rain=10.0), Weather(rain=60.0), Weather(snowfall=0.2)]
)
def test_counts_of_drops_are_poisson(weather):
    """Beams without a target show the first of a Poisson number of drops."""
    sheet = LIDAR_PRESETS["os1-64"].returns
    num_beams = 40_000
    far = plate("far", 0.5, RigidTransform([0.0, 0.0, -300.0]), (1, 1, 1))
    points = scan([far], ahead(num_beams), unit(weather=weather))
    table = tabulate_scattering(
        weather, fit_link_budget(sheet), sheet.divergence, sheet.resolution, 0.3
    )
    expected = num_beams * (1.0 - np.exp(-table.counts[-1]))
    assert len(points) == pytest.approx(expected, abs=4.0 * expected**0.5)
    assert (points["label"] == OUTLIER).all()
    assert (points["instance"] == 0).all()


def test_numbers_by_counter_are_uniform_and_independent():
    key = frame_key(3, "lidar", -5)
    beams = np.arange(9000)
    values = uniform(key, beams[:, None], np.arange(4))
    assert abs(values.mean() - 0.5) < 0.005
    np.testing.assert_allclose(np.cov(values.T), np.eye(4) / 12.0, atol=0.003)
    normals = normal(key, beams, 4)
    assert abs(normals.mean()) < 0.04
    assert normals.std() == pytest.approx(1.0, abs=0.03)
    assert frame_key(3, "lidar", 5) != key != frame_key(3, "rear", -5)
