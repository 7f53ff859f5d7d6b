"""The order of places by their scores."""

import numpy as np


def ranked_places(scores: np.ndarray) -> np.ndarray:
    """Returns places from the best to the worst.

    Of places with equal scores, the first in the database is ranked higher.
    Places that are no candidates (NaN) come last, even after a score of minus
    infinity.

    Args:
        scores: (..., D), higher is more similar; NaN is no candidate.

    Returns:
        (..., D) indices of places.
    """
    # NumPy sorts NaN last.
    return np.argsort(-scores, axis=-1, kind="stable")
