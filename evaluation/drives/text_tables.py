"""Tables of numbers as text, in which every row begins with a time."""

from __future__ import annotations

from decimal import Decimal, InvalidOperation
import io
from pathlib import Path
import warnings

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes

_NS_PER_S = 1_000_000_000
# Enough for hours of an IMU [bytes].
_TABLE_LIMIT_BYTES = 1 << 26


def read_stamped_rows(
    path: Path, width: int, separator: str | None
) -> tuple[np.ndarray, np.ndarray]:
    """Reads a table whose rows are a time and `width` numbers.

    A first line that does not begin with a number is a header.

    Args:
        path: the file.
        width: number of values after the time.
        separator: between columns; None is white space.

    Returns:
        (N,) int64 times [ns], see `parse_stamps_ns`; (N, width) float64.

    Raises:
        InputError: if there is no such table, it is empty, a row has another
            length, or a value is no number or not finite.
    """
    rows = read_numbers(
        path, [("stamp", "U40"), ("values", "f8", width)], separator
    )
    try:
        stamps_ns = parse_stamps_ns(rows["stamp"])
    except ValueError as error:
        raise InputError(f"{path}: time: {error}") from error
    check_finite(path, rows["values"])
    return stamps_ns, rows["values"]


def read_numbers(
    path: Path, columns: list | type, separator: str | None = None
) -> np.ndarray:
    """Reads a table of text.

    Args:
        path: the file.
        columns: NumPy type of a row, or of every number.
        separator: between columns; None is white space.

    Returns:
        (N,) records, or (N, width) numbers; N >= 1.

    Raises:
        InputError: if there is no such table, it is empty, or a row has another
            form.
    """
    try:
        text = read_bytes(path, _TABLE_LIMIT_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file") from error
    # Only the line ends of files end a line; str.splitlines splits at more.
    lines = [line for line in io.StringIO(text, newline=None) if line.strip()]
    if lines and not _begins_with_number(lines[0]):
        lines = lines[1:]
    if not lines:
        raise InputError(f"{path}: no row of numbers")
    dtype = np.dtype(columns)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return np.loadtxt(
                lines,
                dtype=dtype,
                delimiter=separator,
                ndmin=2 if dtype.names is None else 1,
                comments=None,
            )
    except (ValueError, Warning) as error:
        raise InputError(f"{path}: {error}") from error


def parse_stamps_ns(texts: np.ndarray) -> np.ndarray:
    """Returns times in nanoseconds, exactly as written.

    A double has 53 bits: nanoseconds since 1970 would be rounded to 256 ns.

    Args:
        texts: (N,) strings. Whole numbers are nanoseconds; numbers with a
            point or an exponent are seconds.

    Returns:
        (N,) int64.

    Raises:
        ValueError: if a string is no such number.
    """
    try:
        return np.asarray(texts).astype(np.int64)
    except (ValueError, OverflowError):
        return np.array(
            [
                _seconds_to_ns(text) if _is_fraction(text) else _to_ns(text, 1)
                for text in map(str, texts)
            ]
        )


def parse_seconds(texts: np.ndarray) -> np.ndarray:
    """Returns times [ns], (N,) int64, of strings that hold seconds.

    Raises:
        ValueError: if a string is no number.
    """
    return np.array([_seconds_to_ns(text) for text in map(str, texts)])


def check_increasing(path: Path, stamps_ns: np.ndarray, what: str) -> None:
    """Refuses times that do not increase.

    Raises:
        InputError: that names the first such row.
    """
    disorder = np.flatnonzero(np.diff(stamps_ns) <= 0)
    if len(disorder):
        row = int(disorder[0]) + 1
        raise InputError(
            f"{path}: time: {what} {row + 1} at {stamps_ns[row]} ns is not"
            f" later than the one before"
        )


def check_finite(path: Path, values: np.ndarray) -> None:
    """Refuses a table (N, width) with a number that is not finite.

    Raises:
        InputError: that names the first such row.
    """
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InputError(f"{path}: row {bad[0] + 1}: a number is not finite")


def _begins_with_number(line: str) -> bool:
    words = line.replace(",", " ").split()
    try:
        float(words[0])
    except (IndexError, ValueError):
        return False
    return True


def _is_fraction(text: str) -> bool:
    return "." in text or "e" in text.lower()


def _seconds_to_ns(text: str) -> int:
    return _to_ns(text, _NS_PER_S)


def _to_ns(text: str, unit_ns: int) -> int:
    try:
        stamp_ns = int((Decimal(text) * unit_ns).to_integral_value())
    except (InvalidOperation, ValueError, OverflowError) as error:
        raise ValueError(f"{text!r} is no time") from error
    if not -(2**63) <= stamp_ns < 2**63:
        raise ValueError(f"{text!r} is no time")
    return stamp_ns
