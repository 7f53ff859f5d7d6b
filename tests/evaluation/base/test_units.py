import math

import numpy as np

from evaluation.base import wrapped


def test_angles_are_wrapped_to_a_half_open_turn():
    rng = np.random.default_rng(0)
    angles = np.concatenate(
        [rng.uniform(-30, 30, 200), np.pi * np.arange(-6, 7)]
    )
    found = wrapped(angles)
    assert found.min() >= -np.pi
    assert found.max() < np.pi
    np.testing.assert_allclose(
        np.exp(1j * found), np.exp(1j * angles), atol=1e-13
    )
    assert wrapped(math.pi) == -math.pi
    assert wrapped(-math.pi) == -math.pi
    assert wrapped(3.0) == 3.0
