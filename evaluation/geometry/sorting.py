"""Fast orders of many whole numbers, without comparisons."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled

# Number of bits whose counts fit into the cache.
_BITS = 11
_LARGEST_NUMBER = 2**62


def stable_order(numbers: np.ndarray) -> np.ndarray:
    """Returns the order (N,) that sorts numbers; equal ones keep theirs.

    Args:
        numbers: (N,) int64, none negative.
    """
    return _radix_order(np.asarray(numbers, dtype=np.int64))


def sort_into_grid(
    places: np.ndarray, shape: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sorts points by the cell of a grid that they are in.

    Cells are numbered along x, then y, then z; points of one cell keep their
    order.

    Args:
        places: (N, 3) int64 cells of the points, inside the grid.
        shape: (3,) numbers of cells.

    Returns:
        The order (N,) that sorts the points, and where in it each cell starts;
        the last entry is N.
    """
    cells = np.ravel_multi_index(tuple(places.T), tuple(shape))
    counts = np.bincount(cells, minlength=int(np.prod(shape)))
    return stable_order(cells), np.concatenate([[0], np.cumsum(counts)])


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
    return _radix_order(numbers)


@compiled
def _radix_order(numbers: np.ndarray) -> np.ndarray:
    """Sorts by the lowest digits first, then by the next, and so on.

    Knuth, The Art of Computer Programming, vol. 3, section 5.2.5.
    """
    num = len(numbers)
    order = np.arange(num)
    other = np.empty(num, dtype=np.int64)
    size = 1 << _BITS
    largest = 0
    for i in range(num):
        largest = max(largest, numbers[i])
    shift = 0
    while shift < 63 and largest >> shift > 0:
        starts = np.zeros(size + 1, dtype=np.int64)
        for i in range(num):
            starts[((numbers[i] >> shift) & (size - 1)) + 1] += 1
        for digit in range(size):
            starts[digit + 1] += starts[digit]
        for i in range(num):
            digit = (numbers[order[i]] >> shift) & (size - 1)
            other[starts[digit]] = order[i]
            starts[digit] += 1
        order, other = other, order
        shift += _BITS
    return order
