"""The number of columns of `.bin` files, which have no header.

A `.bin` is a sequence of float32 values. KITTI has four values for each point:
x y z intensity; other programs leave out the intensity, or add a ring, a time
or a colour. Reading a file with a wrong number of columns gives a cloud that
was never measured. The right number can be found from the values: the columns
of a cloud have different distributions, while with a wrong number the columns
are mixed and have similar distributions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np

from cns_drake.base import InputError, check_regular, poses, user_errors

# KITTI's number of columns, used if the values do not show another.
_USUAL = 4
# Numbers of columns that a scan may have.
FEWEST_COLUMNS = 3
_CANDIDATES = range(FEWEST_COLUMNS, 13)
# A multiple of all candidates, so that each window of this many values begins
# at the beginning of a point.
_WINDOW = 27720
# Greatest number of windows that are read, spread over the file.
_WINDOWS = 4
# Greatest number of bins of a histogram.
_MOST_BINS = 16
# Average number of values per bin; also the least number of points.
_FILLED = 16
# Least information that the column must have about the value [nat].
_LEAST_INFORMATION = 0.05
# Least excess of the information over the information of random columns, in
# standard deviations.
_SIGNIFICANCE = 5.0
# If fewer columns have at least this share of the information, they are right.
_ALMOST = 0.9
# If low and high beams alternate, two points look like one point with twice as
# many columns. Half of these columns then have at least this share of the
# information, and the distributions of the two points' horizontal coordinates
# differ by at most this total variation.
_HALF = 0.5
_NAMES = ("x", "y", "z", "intensity")


@dataclass(frozen=True)
class BinLayout:
    """The layout of the points in a `.bin` file.

    Attributes:
        columns: number of float32 values per point.
        note: note for the user on how the layout was found; it may be empty.
    """

    columns: int
    note: str = ""

    @property
    def dtype(self) -> np.dtype:
        """NumPy type of a point: x, y, z, intensity, column_5, column_6 ..."""
        more = [f"column_{k + 1}" for k in range(len(_NAMES), self.columns)]
        names = [*_NAMES[: self.columns], *more]
        return np.dtype([(name, "<f4") for name in names])


def find_layout(files: Sequence[Path], columns: int | None = None) -> BinLayout:
    """Returns the layout of `.bin` files that one program wrote.

    Args:
        files: one or more files; the first, the middle and the last are read.
        columns: number of columns, if the user gives it.

    Raises:
        InputError: a file cannot be read, does not contain a whole number of
            points, or its values do not show the number of columns.
    """
    if columns is not None:
        return BinLayout(columns)
    files = [files[k] for k in sorted({0, len(files) // 2, len(files) - 1})]
    values, positions, sizes = _read_windows(files)
    found = _find_period(values, positions)
    wanted = found or _USUAL
    for path, size in zip(files, sizes, strict=True):
        if size % (4 * wanted):
            known = ", as its values have" if found else " (see --columns N)"
            raise InputError(
                f"{path}: {size} bytes is not a whole number of points of"
                f" {wanted} float32{known}"
            )
    layout = BinLayout(wanted)
    if found == _USUAL or not len(values):
        return layout
    if found:
        names = " ".join(layout.dtype.names or ())
        return BinLayout(
            found,
            f"{files[0]}: its values show {found} columns, {names} (--columns N"
            " reads others)",
        )
    others = [
        k
        for k in _CANDIDATES
        if k != _USUAL and not any(size % (4 * k) for size in sizes)
    ]
    with np.errstate(invalid="ignore"):
        if not others or (np.abs(values) >= poses.FARTHEST).any():
            # Impossible coordinates are refused later, when points are read.
            return layout
        # No LiDAR measures a negative intensity.
        is_contrary = (values[positions % _USUAL == 3] < 0.0).any()
    if is_contrary:
        raise InputError(
            f"{files[0]}: its values do not show how many columns it has; give"
            " --columns N"
        )
    return BinLayout(
        _USUAL,
        f"{files[0]}: read as x y z intensity; its values do not show how many"
        " columns it has (--columns N)",
    )


def _read_windows(
    files: Sequence[Path],
) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Reads some values of each file.

    Returns:
        (N,) values; (N,) positions of the values in their files, correct modulo
        any number of columns; size of each file [bytes].
    """
    windows: list[np.ndarray] = []
    sizes = []
    for path in files:
        check_regular(path)
        with user_errors(path), open(path, "rb") as stream:
            sizes.append(path.stat().st_size)
            last = max(0, sizes[-1] // 4 - 1) // _WINDOW
            for k in np.unique(np.linspace(0, last, _WINDOWS).astype(int)):
                stream.seek(4 * _WINDOW * int(k))
                windows.append(np.fromfile(stream, "<f4", _WINDOW))
    positions = np.concatenate([np.arange(len(window)) for window in windows])
    return np.concatenate(windows), positions, sizes


def _find_period(values: np.ndarray, positions: np.ndarray) -> int | None:
    """Returns the number of columns found from the values, or None.

    Args:
        values: (N,) in the order of the file.
        positions: (N,) positions of the values, see `_read_windows`.
    """
    # Beams without a return are stored as zeros or NaN, alike in all columns.
    is_value = np.isfinite(values) & (values != 0.0)
    shown = _period_of_zeros(is_value, positions)
    if shown is not None:
        return shown
    values, positions = values[is_value], positions[is_value]
    num_bins = min(_MOST_BINS, len(values) // _FILLED)
    candidates = [k for k in _CANDIDATES if k * _FILLED <= len(values)]
    if num_bins < 2 or not candidates:
        return None
    shares = np.linspace(0.0, 1.0, num_bins + 1)[1:-1]
    edges = np.unique(np.quantile(values, shares, method="lower"))
    bins = np.searchsorted(edges, values, side="right")
    tables = {
        k: np.histogram2d(
            positions % k, bins, (np.arange(k + 1), np.arange(len(edges) + 2))
        )[0]
        for k in candidates
    }
    told = {k: _mutual_information(table) for k, table in tables.items()}
    most = max(told.values())
    if most <= _LEAST_INFORMATION:
        return None
    found = min(k for k in told if told[k] >= _ALMOST * most)
    degrees = len(edges) * (found - 1)
    chance = _SIGNIFICANCE * math.sqrt(2.0 * degrees) / (2.0 * len(values))
    # The result is trusted only if twice as many columns were tried as well.
    too_few = min(2 * found, _CANDIDATES[-1]) not in candidates
    if too_few or told[found] <= chance:
        return None
    half = found // 2
    if found % 2 == 0 and half in told:
        counts = tables[found].sum(axis=1, keepdims=True)
        # A column may hold nothing but zeros.
        table = tables[found] / np.maximum(counts, 1.0)
        apart = np.abs(table[:2] - table[half : half + 2]).sum(axis=1) / 2.0
        if told[half] >= _HALF * told[found] and (apart < _HALF).all():
            return half
    return found


def _period_of_zeros(is_value: np.ndarray, positions: np.ndarray) -> int | None:
    """Returns the number of columns, found from columns of zeros, or None.

    The number is found if some columns contain only zeros or NaN, and all other
    columns contain neither.

    Args:
        is_value: (N,) whether a value is neither zero nor NaN.
        positions: (N,) positions of the values.
    """
    for k in _CANDIDATES:
        if k * _FILLED > len(positions):
            break
        counts = np.bincount(positions % k, minlength=k)
        filled = np.bincount(positions % k, weights=is_value, minlength=k)
        zero = filled == 0
        if not (zero.any() and (filled > 0).any()):
            continue
        if not np.array_equal(filled[~zero], counts[~zero]):
            continue
        # Every other beam may lack a return: these are two points.
        one, other = zero[: k // 2], zero[k // 2 :]
        is_two = k % 2 == 0 and k >= 2 * FEWEST_COLUMNS
        return None if is_two and (one.all() or other.all()) else k
    return None


def _mutual_information(table: np.ndarray) -> float:
    """Returns the mutual information of a value's column and its bin [nat].

    The expectation for columns that are independent of the values is subtracted
    (Miller and Madow).

    Args:
        table: (K, M) number of values by column and bin.
    """
    number = table.sum()
    shares = table / number
    independent = np.outer(shares.sum(axis=1), shares.sum(axis=0))
    filled = shares > 0.0
    terms = shares[filled] * np.log(shares[filled] / independent[filled])
    degrees = (table.shape[0] - 1) * (table.shape[1] - 1)
    return float(terms.sum() - degrees / (2.0 * number))
