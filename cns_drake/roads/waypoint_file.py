"""Files of waypoints."""

import math
from pathlib import Path

import numpy as np

from cns_drake.base import InputError, read_rows, repeated, to_number

# A greater coordinate is a mistake, not a place [m].
_FARTHEST = 1_000_000.0


def read_waypoints(path: Path) -> tuple[np.ndarray, list[int]]:
    """Reads waypoints from a file.

    Returns:
        (N, 3) positions of the waypoints [m]; the line number of each waypoint.

    Raises:
        InputError: the file cannot be read, or a line is not usable. The
            message names file, line and fault.
    """
    points, lines = [], []
    columns = None
    for line, cells in read_rows(path):
        where = f"{path}: line {line}"
        if columns is None:
            columns = _columns(cells, where)
            if not _is_number(cells[columns[0]]):
                continue
        if max(columns) >= len(cells):
            raise InputError(
                f"{where}: {len(cells)} column(s) are too few; give x and y, "
                "or x, y and z"
            )
        values = [cells[column] for column in columns]
        for value in values:
            if not _is_number(value):
                raise InputError(f"{where}: {value!r} is not a finite number")
            if abs(float(value)) > _FARTHEST:
                raise InputError(
                    f"{where}: {value} m are more than {_FARTHEST:.0f} m"
                )
        x, y, *z = map(float, values)
        points.append((x, y, z[0] if z else 0.0))
        lines.append(line)
    if not points:
        raise InputError(f"{path}: the file has no waypoints")
    return np.array(points), lines


def _columns(cells: list[str], where: str) -> list[int]:
    """Returns the indices of the columns x, y and, if present, z.

    `cells` is the first line of the file. If the line has no names, the columns
    are in this order. `where` begins the error messages.

    Raises:
        InputError: the first line has neither such names nor such numbers.
    """
    names = [cell.lower() for cell in cells]
    if {"x", "y"} <= set(names):
        wanted = ["x", "y", "z"] if "z" in names else ["x", "y"]
        for name in repeated(names):
            if name in wanted:
                raise InputError(f"{where}: column '{name}' is there twice")
        return [names.index(name) for name in wanted]
    if not all(_is_number(cell) for cell in cells):
        raise InputError(
            f"{where}: neither numbers nor the names of columns x, y and z"
        )
    if len(cells) not in (2, 3):
        raise InputError(
            f"{where}: {len(cells)} column(s); it must be x, y or x, y, z"
        )
    return list(range(len(cells)))


def _is_number(text: str) -> bool:
    return math.isfinite(to_number(text))
