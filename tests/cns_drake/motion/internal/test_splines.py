"""Uniform splines: lines stay lines, and waves get lower."""

import numpy as np

from cns_drake.motion.splines import make_uniform_spline


def test_the_spline_reproduces_lines_and_smooths_waves():
    values = 3.0 + 0.7 * np.arange(20)[:, None]
    line = make_uniform_spline(values, 0.5)
    assert (line.start_time(), line.end_time()) == (0.0, 9.5)
    t = np.linspace(0, 9.5, 50)
    np.testing.assert_allclose(line.vector_values(t)[0], 3.0 + 1.4 * t)

    wave = make_uniform_spline(np.cos(0.3 * np.arange(200))[:, None], 1.0)
    t = np.linspace(20, 170, 400)
    gain = (np.sin(0.15) / 0.15) ** 6
    # Aliases of the wave are weaker by (0.3 / (2 pi - 0.3))^6.
    np.testing.assert_allclose(
        wave.vector_values(t)[0], gain * np.cos(0.3 * t), atol=3e-8
    )
