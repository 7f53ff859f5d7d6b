"""The equation of echoes, against data sheets and closed forms."""

from helpers.plates import ahead, facing, plate, scan, unit
import numpy as np
import pytest

from cns_drake.sensors.returns.link_budget import (
    detection_probability,
    fit_link_budget,
    target_snr,
)
from evaluation.lidar_sheets import LIDAR_PRESETS, ReturnsSheet


def test_two_rows_fix_scale_and_extinction():
    sheet = ReturnsSheet(rows=[[0.8, 100.0, 0.9], [0.1, 45.0, 0.5]])
    budget = fit_link_budget(sheet)
    for row in sheet.rows:
        snr = target_snr(budget, 0.0, row.reflectivity, row.range)
        assert detection_probability(snr) == pytest.approx(row.probability)


def test_ranges_scatter_by_the_root_of_the_snr():
    """Down to 1.5 cm, which the sheet states for an SNR of 250."""
    sheet = LIDAR_PRESETS["os1-64"].returns
    for distance, rho in ((3.0, 0.8), (60.0, 0.8), (35.0, 0.1)):
        target = plate("target", rho, facing(distance))
        points = scan([target], ahead(20_000), unit())
        snr = target_snr(fit_link_budget(sheet), 0.0, rho, distance)
        expected = max(0.30 / np.sqrt(snr), 0.015)
        assert np.std(points["x"]) == pytest.approx(expected, rel=0.03)
        assert np.mean(points["x"]) == pytest.approx(
            distance, abs=4.0 * expected / np.sqrt(len(points))
        )
