"""Convolutions of features in some of the cells of a grid, for inference.

They follow MinkowskiEngine 0.5 (Choy, Gwak, Savarese: CVPR 2019), so that its
weights can be used: only cells with a feature have a result, and the offsets
of a kernel run along x first, then y, then z. An odd kernel lies around its
cell, an even one begins there.
"""

import numpy as np

# Makes one number of the three of a cell.
PACKED = np.array([1 << 42, 1 << 21, 1])


def convolve(
    cells: np.ndarray,
    features: np.ndarray,
    kernel: np.ndarray,
    step: int = 1,
    at: np.ndarray | None = None,
) -> np.ndarray:
    """Returns the features of a convolution, (M, channels out).

    Args:
        cells: (N, 3) int64, different ones, each below 2^20.
        features: (N, channels in) features of the cells.
        kernel: (offsets, channels in, channels out) weights.
        step: distance of neighbouring cells.
        at: (M, 3) cells of the result; None for the same ones.
    """
    at = cells if at is None else at
    size = round(len(kernel) ** (1 / 3))
    keys = cells @ PACKED
    order = np.argsort(keys)
    keys = keys[order]
    result = np.zeros((len(at), kernel.shape[2]), features.dtype)
    for number, weights in enumerate(kernel):
        offset = np.unravel_index(number, (size, size, size), "F")
        offset = step * (np.array(offset) - size // 2 * (size % 2))
        wanted = (at + offset) @ PACKED
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        known = keys[place] == wanted
        result[known] += features[order[place[known]]] @ weights
    return result


def coarser(cells: np.ndarray, step: int) -> np.ndarray:
    """Returns the occupied cells (M, 3) of a coarser grid.

    They are named by their lower corners, as the finer cells are.
    """
    return np.unique(cells // step * step, axis=0)
