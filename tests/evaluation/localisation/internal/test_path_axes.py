"""The axes in which errors along a way are given."""

import math

import numpy as np

from evaluation.localisation.localiser import path_axes


def test_axes_of_a_way():
    p_WS = np.array([[0.0, 0, 0], [0, 2, 0], [0, 4, 2], [0, 4, 2], [0, 4, 2]])
    X_WS = np.tile(np.eye(4), (5, 1, 1))
    axes = path_axes(p_WS, X_WS)
    assert np.allclose(axes[0], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    slope = np.array([0.0, 2.0, 1.0]) / math.sqrt(5.0)
    assert np.allclose(axes[1][:, 0], slope)
    assert np.allclose(axes[1][:, 2], [0.0, -slope[2], slope[1]])
    # It stands: x of the LiDAR.
    assert np.allclose(axes[4], np.eye(3))
    assert np.allclose(axes @ axes.swapaxes(1, 2), np.eye(3))
