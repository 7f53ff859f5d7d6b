"""Lines and arcs against closed forms."""

import numpy as np
import pytest

from cns_drake.roads.centreline import Centreline


def test_rounded_corner_is_line_arc_line():
    # A right turn by 90 degrees: 70 m, an arc of 30 m radius, 20 m.
    curve = Centreline([(0, 0), (0, 100), (50, 100)], [30.0])
    assert curve.length == pytest.approx(70 + 30 * np.pi / 2 + 20)

    middle = 70 + 30 * np.pi / 4
    x, y, heading = curve.evaluate([middle])[0]
    centre = np.array([30.0, 70.0])
    expected = centre + 30 * np.array([-1, 1]) / np.sqrt(2)
    np.testing.assert_allclose([x, y], expected, atol=1e-12)
    assert heading == pytest.approx(np.pi / 4)


def test_heading_is_the_derivative_across_all_joints():
    curve = Centreline(
        [(-3, 2), (40, 5), (60, -50), (10, -90), (-60, -20)],
        [12.0, 20.0, 25.0],
    )
    s = np.linspace(0.01, curve.length - 0.01, 4001)
    step = 1e-5
    ahead, behind = curve.evaluate(s + step), curve.evaluate(s - step)
    tangent = (ahead[:, :2] - behind[:, :2]) / (2 * step)
    heading = curve.evaluate(s)[:, 2]
    np.testing.assert_allclose(tangent[:, 0], np.cos(heading), atol=1e-6)
    np.testing.assert_allclose(tangent[:, 1], np.sin(heading), atol=1e-6)
