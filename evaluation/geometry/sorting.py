"""Fast orders of many whole numbers."""

import numpy as np

_LARGEST_NUMBER = 2**62


def stable_order(numbers: np.ndarray) -> np.ndarray:
    """Returns the order (N,) that sorts numbers; equal ones keep theirs.

    Args:
        numbers: (N,) int64, none negative.
    """
    numbers = np.asarray(numbers, dtype=np.int64)
    count = len(numbers)
    if count == 0 or int(numbers.max()) >= _LARGEST_NUMBER // count:
        return np.argsort(numbers, kind="stable")
    # Sorting numbers that are all different is several times as fast as a
    # stable sort of their places.
    return np.sort(numbers * count + np.arange(count)) % count


def cell_order(indices: np.ndarray) -> np.ndarray:
    """Returns the order (N,) that sorts cells along x, then y, then z.

    Equal cells keep their order.

    Args:
        indices: (N, 3) whole numbers.
    """
    if len(indices) == 0:
        return np.empty(0, dtype=np.int64)
    numbers = np.zeros(len(indices), dtype=np.int64)
    largest = 0
    for column in indices.T:
        low, high = int(column.min()), int(column.max())
        largest = largest * (high - low + 1) + high - low
        if largest > _LARGEST_NUMBER:
            # Too many cells to number.
            return np.lexsort(indices.T[::-1])
        numbers *= high - low + 1
        numbers += column
        numbers -= low
    return stable_order(numbers)
