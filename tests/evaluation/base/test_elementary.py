"""Functions with equal bits, against other ways to the same numbers."""

import hashlib
import math

import numpy as np

from evaluation.base import dot, exp32, product, rotated, sinc

# Of NumPy's values at the places below, with AVX2 and with AVX-512.
DIGEST = "e2366ce816e341f9"


def test_exp32_is_the_exponential_function():
    x = np.linspace(-87.0, 88.0, 1_000_001, dtype=np.float32)
    found = exp32(x)
    assert found.dtype == np.float32
    exact = np.exp(x.astype(float))
    np.testing.assert_allclose(found, exact, rtol=4.0 * 2.0**-24)
    assert exp32(np.zeros(1, np.float32))[0] == 1.0
    assert hashlib.sha256(found.tobytes()).hexdigest()[:16] == DIGEST


def test_sinc():
    x = np.array([0.0, 0.5, 1.0, -1.25])
    exact = [1.0] + [math.sin(math.pi * v) / (math.pi * v) for v in x[1:]]
    np.testing.assert_allclose(sinc(x), exact, rtol=1e-15)


def test_products_are_those_of_matrices():
    rng = np.random.default_rng(4)
    A, B = rng.normal(size=(2, 5, 3, 3))
    vectors = rng.normal(size=(5, 3))
    np.testing.assert_allclose(product(A, B), A @ B, rtol=1e-13)
    np.testing.assert_allclose(
        rotated(A[0], vectors), vectors @ A[0].T, rtol=1e-13
    )
    np.testing.assert_allclose(dot(vectors, A[0, 0]), vectors @ A[0, 0])
