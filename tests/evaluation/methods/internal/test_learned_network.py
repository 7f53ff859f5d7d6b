"""The learned descriptor: images, network, scores, files of weights."""

from helpers.learned_weights import weight_values
import numpy as np
import pytest
from scipy import ndimage

from evaluation.methods import FEATURES, LAYERS, SECTORS, TURNS
from evaluation.methods.learned import RINGS, _feature_map

RNG = np.random.default_rng(7)


def test_the_network_by_correlations():
    values = weight_values()
    image = RNG.integers(0, 256, (RINGS, SECTORS, 8)).astype(np.uint8)
    cells = image / 255.0
    for number, (before, after, down, along) in enumerate(LAYERS):
        kernel = values[f"kernel_{number}"].reshape(3, 3, before, after)
        found = np.zeros((*cells.shape[:2], after)) + values[f"bias_{number}"]
        for i in range(before):
            wrapped = np.pad(cells[:, :, i], ((0, 0), (1, 1)), mode="wrap")
            for j in range(after):
                found[:, :, j] += ndimage.correlate(
                    wrapped, kernel[:, :, i, j], mode="constant"
                )[:, 1:-1]
        cells = found[::down, ::along]
        if number < len(LAYERS) - 1:
            cells = np.maximum(cells, 0.0)
    expected = cells.transpose(1, 0, 2).reshape(TURNS, FEATURES)
    assert _feature_map(values, image) == pytest.approx(expected, abs=1e-4)
