"""Tables: named tuples of arrays that have one row for each entry."""

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

# A named tuple of arrays with as many rows each.
_Table = TypeVar("_Table", bound=Any)


def select(table: _Table, rows: np.ndarray) -> _Table:
    """Returns some rows of a table, which is a named tuple of arrays.

    Args:
        table: named tuple of arrays with N rows each.
        rows: indices of the rows, or a mask (N,).
    """
    if rows.dtype == bool:
        rows = np.flatnonzero(rows)
    return table._make(values.take(rows, axis=0) for values in table)


def join(tables: Sequence[_Table]) -> _Table:
    """Concatenates the rows of tables, which are named tuples of arrays."""
    return tables[0]._make(map(np.concatenate, zip(*tables, strict=True)))
