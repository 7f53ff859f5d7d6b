"""Numbers that are written as text, alone or in rows."""

from collections.abc import Iterable, Sequence
import math
import re
import warnings

import numpy as np

from evaluation.base.errors import InputError

_WHOLE = re.compile(r"[-+]?[0-9]{1,18}")
# Separator of columns -> its name.
_SEPARATORS = {
    ";": "semicolons",
    "\t": "tabs",
    ",": "commas",
    None: "white space",
}


def parse_rows(
    lines: Sequence[str] | Sequence[bytes],
    dtype: np.dtype,
    separator: str | None = None,
    first: int = 0,
) -> np.ndarray:
    """Returns numbers from lines of text, one row per line.

    Args:
        lines: N rows.
        dtype: a structured dtype with one field per number of a row, or the
            dtype that all numbers have.
        separator: text between numbers; None for white space.
        first: how many rows of the file come before `lines`; used for the row
            numbers in error messages.

    Returns:
        (N,) records, or (N, width) numbers.

    Raises:
        ValueError: a row does not fit the dtype; the message names the first
            such row.
    """
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
        raise ValueError(
            _first_fault(lines, dtype, separator, first)
        ) from error


def _first_fault(
    lines: Iterable[str | bytes],
    dtype: np.dtype,
    separator: str | None,
    first: int,
) -> str:
    """Returns text on the first row that has another form."""
    kinds = [
        dtype[name].base.kind
        for name in dtype.names or ()
        for _ in range(math.prod(dtype[name].shape))
    ]
    for row, line in enumerate(lines, start=first + 1):
        text = (
            line.decode("utf-8", "replace") if isinstance(line, bytes) else line
        )
        words = [word.strip() for word in text.split(separator)]
        kinds = kinds or ["f"] * len(words)
        if len(words) != len(kinds):
            fault = f"{len(words)} columns instead of {len(kinds)}"
            return f"row {row}: {other_separator(text, separator) or fault}"
        for word, kind in zip(words, kinds, strict=True):
            if kind != "U" and not is_number(word):
                return f"row {row}: could not convert {word[:40]!r} to a number"
    return "not rows of numbers"


def other_separator(line: str, expected: str | None) -> str:
    """Returns an error message if a line has a wrong separator, or else "".

    `expected` is the right separator; None stands for white space.
    """
    for sign in ";\t,":
        is_text = sign == "\t" and (expected is None or expected in line)
        if sign in line and sign != expected and not is_text:
            return (
                f"separated by {_SEPARATORS[sign]} instead of"
                f" {_SEPARATORS[expected]}"
            )
    return ""


def is_number(word: str) -> bool:
    """Returns whether a word is a decimal number, NaN or infinity."""
    try:
        float(word)
    except ValueError:
        return False
    # Python would read 1_0 as 10, and digits of other scripts.
    return "_" not in word and word.isascii()


def to_number(text: str) -> float:
    """Returns the number that a text is, or else NaN."""
    return float(text) if is_number(text) else math.nan


def whole_number(text: str, where: object) -> int:
    """Returns the whole number that a cell or an argument holds.

    Raises:
        InputError: the text is not a whole number, or has more than 18 digits.
            The message begins with `where`.
    """
    if not _WHOLE.fullmatch(text):
        raise InputError(
            f"{where}: {text[:40]!r} is no whole number of up to 18 digits"
        )
    return int(text)
