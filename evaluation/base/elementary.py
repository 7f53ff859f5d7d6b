"""Elementary functions and matrix products with equal bits on every processor.

The last bits of NumPy's elementary functions depend on the vector instructions
of the processor. The last bits of NumPy's matrix products depend on the order
of summation. The elementary functions here call the C library once for each
value, which takes about 0.1 us per value. The matrix product adds in a fixed
order.
"""

import math

import numpy as np

sin = np.vectorize(math.sin, otypes=[float])
cos = np.vectorize(math.cos, otypes=[float])
tan = np.vectorize(math.tan, otypes=[float])
arcsin = np.vectorize(math.asin, otypes=[float])
arctan2 = np.vectorize(math.atan2, otypes=[float])
exp = np.vectorize(math.exp, otypes=[float])
log = np.vectorize(math.log, otypes=[float])
power = np.vectorize(math.pow, otypes=[float])


def product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Returns the matrix product A @ B for (..., M, K) and (..., K, N).

    The result has the same bits on every processor.
    """
    result = A[..., :1] * B[..., :1, :]
    for k in range(1, A.shape[-1]):
        result = result + A[..., k : k + 1] * B[..., k : k + 1, :]
    return result


def rotated(R: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Returns vectors (..., 3) rotated by matrices (..., 3, 3)."""
    return product(R, vectors[..., None])[..., 0]
