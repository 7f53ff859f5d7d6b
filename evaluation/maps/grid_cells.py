"""Cells of regular grids: a number for each cell, and extremes in cells."""

import numpy as np

# Number of cells along each axis that `cell_keys` numbers.
CELLS_PER_AXIS = 1 << 21
# What a step along x, y or z adds to the number of a cell.
_AXIS_STEPS = np.array([CELLS_PER_AXIS**2, CELLS_PER_AXIS, 1])


def packed_cells(cells: np.ndarray) -> np.ndarray:
    """Returns a number for each cell of a grid, (N,) int64.

    In the order of these numbers, cells are sorted by x, then by y, then by z.

    Args:
        cells: (N, 3) int64 indices along x, y and z, from -2^20 to below 2^20.
    """
    return cells @ _AXIS_STEPS


def cell_keys(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns a number for each cell whose indices are small enough.

    Args:
        cells: (N, 3) float64 indices along x, y and z.

    Returns:
        (M,) int64 numbers, see `packed_cells` for their order; and (N,) bool,
        which cells have a number. Only cells with indices from 0 to below 2^21
        have a number.
    """
    with np.errstate(invalid="ignore"):
        is_near = (cells >= 0) & (cells < CELLS_PER_AXIS)
    inside = np.asarray(is_near.all(axis=1))
    return packed_cells(cells[inside].astype(np.int64)), inside


def extremes(
    values: np.ndarray, cells: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and the greatest value in each cell, both (size,).

    For a cell without values, the results are inf and -inf.

    Args:
        values: (N,) values.
        cells: (N,) number of each value's cell.
        size: number of cells.
    """
    least, greatest = np.full(size, np.inf), np.full(size, -np.inf)
    np.minimum.at(least, cells, values)
    np.maximum.at(greatest, cells, values)
    return least, greatest
