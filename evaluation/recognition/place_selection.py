"""Which places of a database of several drives are kept."""

from typing import Any

import numpy as np

from evaluation.base import InputError

# All places are kept.
KEEP_ALL = "all"
# In each cell, the places of the latest drive through it are kept.
KEEP_LATEST = "latest"


def checked_keep(value: Any, where: str) -> str | int:
    """Returns a value of the field `keep` of an experiment.

    Args:
        value: `all`, `latest`, or a number of places per cell.
        where: file and field, for errors.

    Raises:
        InputError: the value is anything else.
    """
    is_number = type(value) is int and value >= 1
    if not (is_number or value in (KEEP_ALL, KEEP_LATEST)):
        raise InputError(
            f"{where}: {value!r} is neither {KEEP_ALL}, {KEEP_LATEST} nor a"
            " positive whole number"
        )
    return value


def kept_places(
    p_WPs: np.ndarray, drives: np.ndarray, keep: str | int, cell: float
) -> np.ndarray:
    """Returns which places of a database are kept, (D,) bool.

    The plane of the world is divided into square cells, with corners at
    multiples of the cells' side. If the side equals the distance between two
    places, a cell contains about one place of each drive through the cell.

    Args:
        p_WPs: (D, 3) positions of the places in the world [m], in the order in
            which they were driven.
        drives: (D,) number of the drive of each place; drives with greater
            numbers are later.
        keep: `all` keeps every place. `latest` keeps, in each cell, the places
            of the latest drive through the cell. A number N keeps the latest N
            places in each cell.
        cell: side of a cell [m].
    """
    if keep == KEEP_ALL or len(p_WPs) == 0:
        return np.ones(len(p_WPs), bool)
    cells = np.floor(p_WPs[:, :2] / cell)
    _, cell_of = np.unique(cells, axis=0, return_inverse=True)
    cell_of = cell_of.ravel()
    if isinstance(keep, str):
        latest = np.full(cell_of.max() + 1, -1)
        np.maximum.at(latest, cell_of, drives)
        return drives == latest[cell_of]
    # Number of later places in the same cell.
    order = np.lexsort((-np.arange(len(cell_of)), cell_of))
    sorted_cells = cell_of[order]
    first = np.searchsorted(sorted_cells, sorted_cells)
    kept = np.empty(len(order), bool)
    kept[order] = np.arange(len(order)) - first < keep
    return kept
