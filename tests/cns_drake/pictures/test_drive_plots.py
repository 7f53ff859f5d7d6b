"""The plots below the time line show the values that they are given."""

import re

import numpy as np
import pytest

from cns_drake.pictures.drive_plots import Curve, make_plots, motion_curves


def points(html):
    text = re.search(r'points="([^"]*)"', html)[1]
    return np.array([one.split(",") for one in text.split()], dtype=float)


def test_curve_goes_from_left_to_right_and_up():
    html = make_plots([Curve("Speed", "km/h", np.array([0, 20, 10]))], None, ())
    # Zero is at the bottom, the greatest value at the top.
    np.testing.assert_allclose(points(html), [[0, 20], [200, 0], [400, 10]])
    assert 'data-values="0.0,20.0,10.0"' in html
    assert 'data-unit="km/h"' in html


def test_curve_of_both_signs_has_its_zero_line():
    curve = Curve("IMU, left", "m/s²", np.array([-3.0, 0.0, 1.0]))
    html = make_plots([curve], None, ())
    np.testing.assert_allclose(points(html)[:, 1], [20.0, 5.0, 0.0])
    assert 'y1="5.0" y2="5.0"' in html


@pytest.mark.parametrize("value", [0.0, 1e-9, -1e-9])
def test_noise_is_not_stretched(value):
    curve = Curve("IMU, turn", "deg/s", np.array([0.0, value]))
    y = points(make_plots([curve], None, ()))[:, 1]
    assert abs(y[0] - y[1]) < 0.1


def test_long_drive_has_few_samples_from_first_to_last():
    values = np.arange(3001.0)
    html = make_plots([Curve("Speed", "km/h", values)], None, ())
    said = re.search(r'data-values="([^"]*)"', html)[1].split(",")
    assert len(said) == len(points(html)) == 400
    assert (said[0], said[-1]) == ("0.0", "3000.0")


def test_units_of_motion():
    curves = motion_curves(
        [10.0], [np.array([1.0, 2.0, 9.81])], [np.array([0.0, 0.0, np.pi])]
    )
    said = {(curve.name, curve.unit): curve.values[0] for curve in curves}
    assert said == pytest.approx(
        {
            ("Speed", "km/h"): 36.0,
            ("IMU, forward", "m/s²"): 1.0,
            ("IMU, left", "m/s²"): 2.0,
            ("IMU, turn", "deg/s"): 180.0,
        }
    )


def test_stage_is_marked_among_all():
    html = make_plots([], "02", ("01", "02", "03"))
    assert re.findall(r"<b([^>]*)>(\d\d)</b>", html) == [
        ("", "01"),
        (' class="now"', "02"),
        ("", "03"),
    ]
    assert make_plots([], None, ()) == ""
    assert make_plots([], "01", ("01",)) == ""


def test_nothing_without_frames():
    assert make_plots(motion_curves([], [], []), None, ()) == ""
