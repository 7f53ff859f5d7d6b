import numpy as np
import pytest

from evaluation.geometry.sorting import (
    cell_order,
    sort_into_grid,
    stable_order,
)


@pytest.mark.parametrize("largest", [0, 1, 2047, 2048, 2**33, 2**63 - 1])
@pytest.mark.parametrize("number", [0, 1, 5000])
def test_as_by_comparing(largest, number):
    rng = np.random.default_rng(6)
    numbers = rng.integers(largest, size=number, endpoint=True)
    np.testing.assert_array_equal(
        stable_order(numbers), np.argsort(numbers, kind="stable")
    )


@pytest.mark.parametrize("span", [1, 3, 900, 2**21 - 1, 2**21 + 1, 2**32 - 1])
@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_cells_as_by_comparing(span, dtype):
    rng = np.random.default_rng(7)
    low = -(2**31)
    cells = rng.integers(low, low + span, (3000, 3), endpoint=True)
    # The outermost cells, and one cell several times.
    cells[[17, 30]] = low, low + span, low
    cells[1700] = low + span
    cells = cells.astype(dtype)
    np.testing.assert_array_equal(cell_order(cells), np.lexsort(cells.T[::-1]))


def test_no_cells():
    assert cell_order(np.empty((0, 3), np.int32)).shape == (0,)


def test_points_of_a_cell_lie_between_its_starts():
    rng = np.random.default_rng(5)
    shape = np.array([4, 3, 5])
    places = rng.integers([0, 0, 0], shape - 1, (200, 3))
    order, starts = sort_into_grid(places, shape)
    assert len(starts) == 4 * 3 * 5 + 1
    for x, y, z in np.ndindex(*shape):
        cell = (x * 3 + y) * 5 + z
        expected = np.flatnonzero((places == [x, y, z]).all(axis=1))
        found = order[starts[cell] : starts[cell + 1]]
        np.testing.assert_array_equal(found, expected)
