"""Sparse convolutions against dense convolutions."""

import itertools
import math

import numpy as np
import pytest
from scipy.ndimage import correlate

from evaluation.methods.sparse_convolution import coarser, convolve

RNG = np.random.default_rng(11)


def grid(size=8, part=0.3, channels=2):
    """Returns cells, some below 0, their features, and both in a box."""
    taken = RNG.uniform(size=(size, size, size)) < part
    cells = np.argwhere(taken)
    features = RNG.normal(size=(len(cells), channels))
    dense = np.zeros((size, size, size, channels))
    dense[taken] = features
    return cells - size // 2, features, dense, taken


def image(kernel, size, i, o):
    """Returns weights over x, y, z: of offsets, the first runs fastest."""
    values = np.zeros((size, size, size))
    for number, (z, y, x) in enumerate(
        itertools.product(range(size), repeat=3)
    ):
        values[x, y, z] = kernel[number, i, o]
    return values


@pytest.mark.parametrize("size", [1, 3, 5])
def test_convolution_of_a_dense_grid(size):
    cells, features, dense, taken = grid()
    order = RNG.permutation(len(cells))
    kernel = RNG.normal(size=(size**3, 2, 3))
    found = convolve(cells[order], features[order], kernel)
    for o in range(3):
        wanted = sum(
            correlate(dense[..., i], image(kernel, size, i, o), mode="constant")
            for i in range(2)
        )
        np.testing.assert_allclose(found[:, o], wanted[taken][order], atol=1e-9)


def test_convolution_to_a_coarser_grid():
    cells, features, dense, _ = grid()
    kernel = RNG.normal(size=(8, 2, 3))
    at = coarser(cells, 2)
    assert {tuple(c) for c in at.tolist()} == {
        tuple(2 * math.floor(v / 2) for v in cell) for cell in cells.tolist()
    }
    found = convolve(cells, features, kernel, 1, at)
    for (x, y, z), row in zip(at + 4, found, strict=True):
        block = dense[x : x + 2, y : y + 2, z : z + 2]
        wanted = sum(
            np.einsum("xyz,xyz->", block[..., i], image(kernel, 2, i, 1))
            for i in range(2)
        )
        assert row[1] == pytest.approx(wanted)


def test_convolution_with_a_step():
    cells, features = grid()[:2]
    kernel = RNG.normal(size=(27, 2, 1))
    once, thrice = (convolve(k * cells, features, kernel, k) for k in (1, 3))
    np.testing.assert_allclose(once, thrice)
