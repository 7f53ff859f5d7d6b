"""Horizontal sections, in closed form."""

import numpy as np
import pytest

from worlds.ageing.alterations import greatest_y, horizontal_section


def test_section_of_a_roof():
    """A triangle from (0, 0, 0) and (4, 0, 0) to (0, 2, 2), cut at height 1."""
    triangle = np.array([[[0, 0, 0], [4, 0, 0], [0, 2, 2]]], float)
    cut = horizontal_section(triangle, 1.0)
    ends = cut[0][np.argsort(cut[0][:, 0])]
    np.testing.assert_allclose(ends, [[0, 1], [2, 1]], atol=1e-3)
    assert greatest_y(cut, 1.0) == pytest.approx(1.0, abs=1e-3)
    assert np.isnan(greatest_y(cut, 3.0))
