"""The order of places by their scores."""

import numpy as np

# With fewer places, sorting all of them is as quick.
_MANY = 2000


def ranked_places(scores: np.ndarray, most: int) -> np.ndarray:
    """Returns the best places, from the best on.

    Of places with equal scores, the first in the database is ranked higher.
    Places that are no candidates (NaN) come last.

    Args:
        scores: (..., D), higher is more similar; NaN is no candidate.
        most: greatest number K of places.

    Returns:
        (..., min(K, D)) indices of places.
    """
    # NumPy sorts NaN last.
    worst_last = -scores
    number = scores.shape[-1]
    if number < _MANY or most >= number:
        order = np.argsort(worst_last, axis=-1, kind="stable")
        return order[..., :most]
    rows = worst_last.reshape(-1, number)
    found = np.empty((len(rows), most), np.int64)
    for k, row in enumerate(rows):
        limit = np.partition(row, most - 1)[most - 1]
        # NaN is a limit if there are fewer candidates.
        near = np.flatnonzero((row <= limit) | np.isnan(limit))
        found[k] = near[np.argsort(row[near], kind="stable")[:most]]
    return found.reshape(*scores.shape[:-1], most)
