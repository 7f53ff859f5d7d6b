"""Cells of tables, a public noun: how each kind is written and read back.

`results.csv` and `queries.csv` have no other cells. A value that is written and
read again is the same value.
"""

from collections.abc import Callable
from dataclasses import dataclass
import json
import math
import re
from typing import Any

import numpy as np

# Greatest whole number of an array, so that it fits in 64 bits.
_LARGEST = 2**63 - 1
_NUMBER = re.compile(
    r"[-+]?(\d+(\.\d*)?|\.\d+)(e[-+]?\d+)?", re.ASCII | re.IGNORECASE
)
_INFINITE = {"inf": math.inf, "-inf": -math.inf}
# Leading zeros belong to names, as in the stage 01.
_NAME_OF_DIGITS = re.compile(r"0\d+")
# A text in JSON.
_QUOTED = re.compile(r'".*"', re.DOTALL)
# Control characters: no cell has them, and a terminal would obey them.
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
_TRUTH = {"0": False, "1": True, "false": False, "true": True}


@dataclass(frozen=True)
class CellKind:
    """A kind of cell.

    Attributes:
        write: returns a value as the text of a cell.
        read: returns the value of a cell's text. It raises ValueError, whose
            message begins with the text, if the text is no such value.
    """

    write: Callable[[Any], str]
    read: Callable[[str], Any]


def _write_number(value: float | None) -> str:
    """Returns a number with all its digits; unknown (None, NaN) is empty."""
    if value is None or math.isnan(value):
        return ""
    return repr(float(value))


def _read_number(cell: str) -> float:
    if not cell:
        return math.nan
    if cell in _INFINITE:
        return _INFINITE[cell]
    if not _NUMBER.fullmatch(cell) or math.isinf(float(cell)):
        raise ValueError(f"{cell!r} is no number")
    return float(cell)


def _write_whole(value: float | None) -> str:
    """Returns a whole number; unknown (None, negative, infinite) is empty."""
    if value is None or not 0 <= value < math.inf:
        return ""
    return str(int(value))


def _read_whole(cell: str) -> int:
    if not cell:
        return -1
    whole = _read_seed(cell)
    if whole > _LARGEST:
        raise ValueError(f"{cell!r} is no whole number from 0 to {_LARGEST}")
    return whole


def _read_seed(cell: str) -> int:
    """Returns a whole number of any length."""
    if cell.isascii() and cell.isdigit():
        return int(cell)
    # Programs with NaN for empty cells write whole numbers with a point.
    is_number = _NUMBER.fullmatch(cell) and math.isfinite(float(cell))
    if not is_number or not float(cell) >= 0 or float(cell) % 1:
        raise ValueError(f"{cell!r} is no whole number from 0 to {_LARGEST}")
    return int(float(cell))


def _read_truth(cell: str) -> bool:
    if cell.lower() not in _TRUTH:
        raise ValueError(f"{cell!r} is neither 0 nor 1")
    return _TRUTH[cell.lower()]


def _write_text(text: str) -> str:
    """Returns a text as it is, or in JSON if it would be read otherwise."""
    is_plain = text.strip(" ") == text and not _QUOTED.fullmatch(text)
    return json.dumps(text) if not is_plain or CONTROL.search(text) else text


def _read_text(cell: str) -> str:
    if not _QUOTED.fullmatch(cell):
        return cell
    try:
        return str(json.loads(cell))
    except ValueError:
        return cell  # As other programs write a text with quotation marks.


def _write_factor(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    if isinstance(value, float):
        return _write_number(value)
    if not isinstance(value, str):
        return "" if value is None else str(value)
    cell = _write_text(value)
    is_text = cell != value or isinstance(_read_factor(cell), str)
    return cell if is_text else json.dumps(value)


def _read_factor(cell: str) -> float | bool | str | None:
    """Returns a number, a truth value, text, or None for an empty cell."""
    if _QUOTED.fullmatch(cell):
        return _read_text(cell)
    if cell.lower() in ("true", "false"):
        return _TRUTH[cell.lower()]
    is_number = _NUMBER.fullmatch(cell) and not _NAME_OF_DIGITS.fullmatch(cell)
    # Digits and an e can be a name, such as 12e4567.
    if cell in _INFINITE or (is_number and math.isfinite(float(cell))):
        is_whole = cell.lstrip("+-").isdigit()
        return int(cell) if is_whole else float(cell)
    return cell or None


# Numbers; NaN is an empty cell.
NUMBER = CellKind(_write_number, _read_number)
# Whole numbers from 0 on; an empty cell is read as -1.
WHOLE = CellKind(_write_whole, _read_whole)
# Whole numbers of any length; never empty.
SEED = CellKind(str, _read_seed)
# Truth values, 0 or 1; never empty.
TRUTH = CellKind(lambda value: str(int(value)), _read_truth)
# Text. What is read otherwise, such as a name that ends with a space, is in
# quotation marks, as in JSON.
TEXT = CellKind(_write_text, _read_text)
# Values of factors. A text that looks like a number or a truth value, such as
# "1e5", is in quotation marks, too.
FACTOR = CellKind(_write_factor, _read_factor)


def as_factor(value: object) -> float | bool | str | None:
    """Returns the value of a factor as a table has it.

    A text on the command line and a number in a file are the same value.
    """
    if not isinstance(value, str):
        return _read_factor(_write_factor(value))
    read = _read_factor(value.strip(" "))
    return read if isinstance(read, int | float) else value
