import numpy as np
import pytest

from evaluation.geometry.sorting import cell_order, stable_order


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
