"""The order of places by their scores."""

from __future__ import annotations

import numpy as np


def ranking(scores: np.ndarray) -> np.ndarray:
    """Returns places from the best to the worst.

    If places have equal scores, the first one in the database is better. Places
    that are no candidates come last, after those with a score of minus
    infinity.

    Args:
        scores: (..., D), higher is more similar; NaN is no candidate.

    Returns:
        (..., D) indices of places.
    """
    # NumPy sorts NaN last.
    return np.argsort(-scores, axis=-1, kind="stable")
