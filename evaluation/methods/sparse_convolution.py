"""Sparse convolutions, for inference: only occupied cells have features.

The convolutions follow MinkowskiEngine 0.5 (Choy, Gwak, Savarese: CVPR 2019),
so that weights trained with MinkowskiEngine can be used. Only cells with a
feature have a result. The offsets of a kernel vary along x first, then y, then
z. A kernel of odd size is centred at its cell; a kernel of even size begins at
its cell.
"""

import numpy as np

from evaluation.maps import packed_cells


def convolve(
    cells: np.ndarray,
    features: np.ndarray,
    kernel: np.ndarray,
    step: int = 1,
    at: np.ndarray | None = None,
) -> np.ndarray:
    """Returns the result of a sparse convolution, (M, channels out).

    Args:
        cells: (N, 3) int64 indices of the occupied cells, without repetition
            and below 2^20.
        features: (N, channels in) features of the occupied cells.
        kernel: (k^3, channels in, channels out) weights of a kernel with k
            cells along each axis; x varies fastest.
        step: difference of the indices of two neighbouring cells.
        at: (M, 3) indices of the cells of the result; by default `cells`.
    """
    at = cells if at is None else at
    size = round(len(kernel) ** (1 / 3))
    keys = packed_cells(cells)
    order = np.argsort(keys)
    keys = keys[order]
    result = np.zeros((len(at), kernel.shape[2]), features.dtype)
    for number, weights in enumerate(kernel):
        offset = np.unravel_index(number, (size, size, size), "F")
        offset = step * (np.array(offset) - size // 2 * (size % 2))
        wanted = packed_cells(at + offset)
        position = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        known = keys[position] == wanted
        result[known] += features[order[position[known]]] @ weights
    return result


def coarser(cells: np.ndarray, step: int) -> np.ndarray:
    """Returns the occupied cells (M, 3) of a coarser grid, without repetition.

    Args:
        cells: (N, 3) int64 cells of the finer grid, each given by its lower
            corner.
        step: side of a coarser cell; the corners of these cells are multiples
            of `step`.
    """
    return np.unique(cells // step * step, axis=0)
