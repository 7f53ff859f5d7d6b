"""Tables of numbers as text, and the times in them."""

from collections.abc import Mapping, Sequence
from decimal import Decimal
import io
import itertools
from math import isfinite
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np

from evaluation.base import (
    NS_PER_S,
    InputError,
    decode_text,
    is_number,
    other_separator,
    parse_rows,
    read_bytes,
    to_number,
    value_errors,
)

_NS_PER_US = 1000
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+")
_NANOSECONDS = re.compile(r"\d{15,}")


def read_stamped_rows(
    path: Path,
    width: int,
    separator: str | None,
    names: Sequence[str] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Reads a table whose rows are a time and `width` numbers.

    Args:
        path: the file.
        width: number of values after the time.
        separator: text between columns; None for white space.
        names: names of the columns, see `read_numbers`.

    Returns:
        (N,) int64 times [ns]; (N, width) float64.

    Raises:
        InputError: if there is no such table, it is empty, a row has another
            length, or a value is no number or not finite.
    """
    rows = read_numbers(
        path, [("stamp", "U40"), ("values", "f8", width)], separator, names
    )
    with value_errors(f"{path}: time"):
        stamps_ns = parse_stamps_ns(rows["stamp"])
    check_finite(path, rows["values"])
    return stamps_ns, rows["values"]


def read_numbers(
    path: Path,
    columns: list | type,
    separator: str | None = None,
    names: Sequence[str] = (),
) -> np.ndarray:
    """Reads a table of text.

    Lines that begin with `#` are remarks. A header is a first line that does
    not begin with a number, or a remark above the first row that names the
    columns. If a header names the wanted columns, these columns can be in any
    order. If it states the unit of the time, or names the seconds and the
    nanoseconds of the time, the times are returned as whole nanoseconds with
    `ns` behind them.

    Args:
        path: the file.
        columns: NumPy type of a row, with named fields; or the type of a
            number, if all columns have the same type.
        separator: text between columns; None for white space.
        names: names of all columns in their usual order, `time` first, "" for
            one that is not read, see `_find_columns`. By default the columns
            have no names, and all are read.

    Returns:
        (N,) records if `columns` has fields, otherwise (N, width) numbers. N is
        at least 1.

    Raises:
        InputError: if there is no such table, it is empty, a row has another
            form, a time is out of range, or a header contradicts the order of
            the columns.
    """
    before, header, lines = _parts(path)
    with value_errors(path):
        if names:
            places, width, clock = _places(
                header or before, lines[0], separator, names
            )
            if clock or places != list(range(width)):
                lines = _pick_columns(lines, places, width, separator, clock)
        return parse_rows(lines, np.dtype(columns), separator)


class TableForm(NamedTuple):
    """The form of a table of text.

    Attributes:
        separator: text between columns; None for white space.
        width: number of columns.
        is_named: whether a header names most of the columns.
    """

    separator: str | None
    width: int
    is_named: bool


def form_of(path: Path) -> TableForm:
    """Returns the form of a table of text, by its first rows.

    Raises:
        InputError: see `read_numbers`.
    """
    before, header, lines = _parts(path)
    _, *cells = re.split(r"[;\s]+", lines[0].strip())
    if cells and all(map(_DECIMAL_COMMA.fullmatch, cells)):
        raise InputError(f"{path}: decimal commas; write decimal points")
    separator = next((one for one in ",;" if one in lines[0]), None)
    width = len(lines[0].split(separator))
    words = _split_header(header or before, separator)
    return TableForm(separator, width, len(words) == width)


def _parts(path: Path) -> tuple[str, str, list[str]]:
    """Returns the remark above a table, its header, and its rows.

    Remark and header are "" if there is none.
    """
    try:
        text = decode_text(read_bytes(path))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file") from error
    # Only \n and \r\n end a line; str.splitlines splits at more characters.
    every = [line for line in io.StringIO(text, newline=None) if line.strip()]
    lines = [line for line in every if not line.startswith("#")]
    header = ""
    if lines and not _begins_with_number(lines[0]):
        header, *lines = lines
    if not lines:
        raise InputError(f"{path}: no row of numbers")
    remarks = itertools.takewhile(lambda line: line is not lines[0], every)
    *_, before = ("", *remarks)
    return before, header, lines


def _places(
    header: str, row: str, separator: str | None, names: Sequence[str]
) -> tuple[list[int], int, dict[int, int]]:
    """Returns the positions of columns to read, and how many columns exist.

    The third value is the columns whose sum is the time, with their units [ns];
    it is empty if the header states no unit.

    Args:
        header: line above the first row, which need not be a header; "" if
            there is no such line.
        separator: text between columns; None for white space.
        names: see `read_numbers`.

    Raises:
        ValueError: see `_find_columns`.
    """
    usual = [k for k, name in enumerate(names) if name]
    words = _split_header(header, separator)
    width = len(row.split(separator))
    if words and len(words) != width:
        # A remark need not be a header.
        if header.startswith("#"):
            words = []
        else:
            raise ValueError(f"header: {len(words)} names for {width} columns")
    if not words:
        return usual, len(names), {}
    places = _find_columns(words, names) or usual
    return places, width, _clock(words, places[0])


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
        if not all(map(is_number, texts)):
            raise ValueError
        return np.asarray(texts).astype(np.int64)
    except (ValueError, OverflowError):
        return np.array(
            [
                _to_ns(text, NS_PER_S if _is_fraction(text) else 1)
                for text in map(str, texts)
            ]
        )


def parse_seconds(texts: np.ndarray) -> np.ndarray:
    """Returns times [ns], (N,) int64, of strings that hold seconds.

    Whole numbers of 15 digits or more are nanoseconds, as in EuRoC's tables.

    Raises:
        ValueError: if a string is no number.
    """
    return np.array(
        [
            _to_ns(text, 1 if _NANOSECONDS.fullmatch(text) else NS_PER_S)
            for text in map(str, texts)
        ]
    )


def parse_microseconds(texts: np.ndarray) -> np.ndarray:
    """Returns times [ns], (N,) int64, of strings that hold microseconds.

    Raises:
        ValueError: if a string is no number.
    """
    return np.array([_to_ns(text, _NS_PER_US) for text in map(str, texts)])


def check_increasing(path: Path, stamps_ns: np.ndarray, what: str) -> None:
    """Raises an error for times that do not increase.

    Args:
        path: file of the times, for the error message.
        stamps_ns: (N,) int64 times [ns].
        what: word for a row in the error message, such as `pose`.

    Raises:
        InputError: the times do not increase; the error names the first such
            row.
    """
    disorder = np.flatnonzero(np.diff(stamps_ns) <= 0)
    if len(disorder):
        row = int(disorder[0]) + 1
        raise InputError(
            f"{path}: time: {what} {row + 1} at {stamps_ns[row]} ns is not"
            f" later than the one before"
        )


def check_finite(path: Path, values: np.ndarray) -> None:
    """Raises an error for an array (N, width) that contains NaN or infinity.

    Raises:
        InputError: a number is not finite; the error names the first such row.
    """
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InputError(f"{path}: row {bad[0] + 1}: a number is not finite")


def _begins_with_number(line: str) -> bool:
    words = re.sub("[,;]", " ", line).split()
    return bool(words) and is_number(words[0])


def _is_fraction(text: str) -> bool:
    return "." in text or "e" in text.lower()


def _to_ns(text: str, unit_ns: int) -> int:
    if text.endswith("ns"):  # See `read_numbers`.
        text, unit_ns = text.removesuffix("ns"), 1
    try:
        if not is_number(text):
            raise ValueError(text)
        stamp_ns = int((Decimal(text) * unit_ns).to_integral_value())
    except (ArithmeticError, ValueError) as error:
        raise ValueError(f"{text!r} is no time") from error
    if not -(2**63) <= stamp_ns < 2**63:
        raise ValueError(f"{text!r} is no time")
    return stamp_ns


def _pick_columns(
    lines: Sequence[str],
    places: Sequence[int],
    width: int,
    separator: str | None,
    clock: Mapping[int, int],
) -> list[str]:
    """Returns rows with some of their columns, in a given order.

    Args:
        lines: N rows.
        places: place of each wanted column, from 0.
        separator: text between columns; None for white space.
        clock: columns whose sum is the first wanted column, with their units
            [ns]; empty if this column is taken as it is.

    Raises:
        ValueError: a row has another number of columns, or a time is out of
            range; the message names the first such row.
    """
    picked = []
    for row, line in enumerate(lines, start=1):
        # The last word would keep the end of the line.
        words = line.strip().split(separator)
        if len(words) != width:
            fault = f"{len(words)} columns instead of {width}"
            raise ValueError(
                f"row {row}: {other_separator(line, separator) or fault}"
            )
        wanted = [words[k] for k in places]
        if clock:
            wanted[0] = _whole_ns(words, clock, row)
        picked.append((separator or " ").join(wanted))
    return picked


def _whole_ns(words: Sequence[str], clock: Mapping[int, int], row: int) -> str:
    """Returns the time in a row as text; a word that is no number, as it is."""
    parts = [words[column].strip() for column in clock]
    for part in parts:
        if not isfinite(to_number(part)):
            return part
    times_ns = list(map(_to_ns, parts, clock.values()))
    if len(times_ns) > 1 and not 0 <= times_ns[-1] < NS_PER_S:
        raise ValueError(f"row {row}: {parts[-1]} ns are no part of a second")
    return f"{sum(times_ns)}ns"


_UNIT = re.compile(r"\s*(\[(?P<unit>[^]]*)\]|\((?P<round>[^)]*)\))")
_OTHER = re.compile(r"[^a-z0-9]+")
_TIME = re.compile(r"t(_[mun]?s)?|([mun]|nano)?secs?|\w*(time|stamp)\w*")
# A unit of time behind a name, such as ns, nsec and nanoseconds.
_CLOCK = re.compile(
    r"(?P<stem>|.*_)(?P<part>[mun]|milli|micro|nano|)(?P<sec>s|secs?|seconds?)"
)
_PARTS_NS = {
    **{"": NS_PER_S, "m": 10**6, "u": _NS_PER_US, "n": 1},
    **{"milli": 10**6, "micro": _NS_PER_US, "nano": 1},
}
_WORDS = {
    **{"easting": "x", "northing": "y", "altitude": "z", "height": "z"},
    **{"roll": "roll", "pitch": "pitch", "yaw": "yaw", "heading": "yaw"},
    **{axis: axis for axis in "wxyz"},
}
# First letter of a name -> spellings that come before an axis.
_VECTORS = {
    letter: re.compile(
        rf"(\w+_)?({'|'.join(heads.split())})(_\w+)??_?(?P<axis>[wxyz])"
    )
    for letter, heads in {
        "q": "q quat quaternion orient orientation rot rotation",
        "w": "w omega gyr gyro angvel angular_velocity",
        "a": "a acc accel acceleration linear_acceleration specific_force",
        "": "p t pos position trans translation",
    }.items()
}


def _split_header(line: str, separator: str | None) -> list[str]:
    """Returns the words of a header, without units except those of time.

    `time [ns]` becomes `time_ns`.

    The result is empty unless most of the words are known names of columns.
    White space may separate the words even if there is another separator.

    Args:
        line: the header, or a remark that may be a header.
        separator: text between columns; None for white space.
    """
    line = line.lstrip("# ").replace("\u00b5", "u").replace("\u03bc", "u")
    text = _UNIT.sub(_suffix, line)
    words = text.split(separator)
    if len(words) == 1:
        words = text.split()
    num_known = sum(_column(word) is not None for word in words)
    return words if 2 * num_known > len(words) else []


def _suffix(unit: re.Match[str]) -> str:
    text = (unit["unit"] or unit["round"] or "").strip().lower()
    found = _CLOCK.fullmatch(text)
    return f"_{text}" if found and not found["stem"] else ""


def _clock(words: Sequence[str], column: int) -> dict[int, int]:
    """Returns the columns whose sum is the time, with their units [ns].

    Seconds and nanoseconds of one name, such as `sec` and `nsec`, are such a
    sum.

    Args:
        words: words of the header.
        column: the column of the time.

    Returns:
        column -> unit. Empty if the header states no unit.
    """
    found = [_CLOCK.fullmatch(_plain(word)) for word in words]
    own = found[column] if _column(words[column]) else None
    if own is None:
        return {}
    pair = {
        _PARTS_NS[one["part"]]: k
        for k, one in enumerate(found)
        if one and one["stem"] == own["stem"] and one["sec"].startswith("sec")
    }
    if pair.keys() >= {NS_PER_S, 1} and column in pair.values():
        return {pair[unit_ns]: unit_ns for unit_ns in (NS_PER_S, 1)}
    return {column: _PARTS_NS[own["part"]]}


def _plain(word: str) -> str:
    return _OTHER.sub("_", word.lower()).strip("_")


def _find_columns(
    words: Sequence[str], names: Sequence[str]
) -> list[int] | None:
    """Returns the positions of columns in a table that has a header.

    The known columns are `time`; `x`, `y`, `z`; `qx` to `qz` and `qw` of a
    quaternion; `roll`, `pitch`, `yaw`; `wx` to `wz` of an angular velocity; and
    `ax` to `az` of a specific force. Each name is known in the spellings of
    many programs.

    Args:
        words: words of the header, one for each column of the table.
        names: names of the columns of a table without header; "" for a column
            that is not used.

    Returns:
        For each used column, its position in the table. None if the header
        names too few of the used columns; the columns are then in the order of
        `names`.

    Raises:
        ValueError: the header names a column twice; or it names too few
            columns, and one of these is not at its position in `names`, or
            there is no column, or a known one, at the position of a missing
            name.
    """
    found = [_column(word) for word in words]
    if found.count("w"):
        # A second x y z beside a w belongs to the quaternion.
        for k, name in enumerate(found):
            is_second = name in ("x", "y", "z") and name in found[:k]
            found[k] = f"q{name}" if is_second or name == "w" else name
    used = [name for name in names if name]
    for name in used:
        # A table may have a second time, such as the time of its recording.
        if name != "time" and found.count(name) > 1:
            raise ValueError(f"header: {name} is there twice")
    if set(used) <= set(found):
        return [found.index(name) for name in used]
    for k, name in enumerate(found):
        if name in used and not (k < len(names) and names[k] == name):
            wanted = " ".join(name or "-" for name in names)
            raise ValueError(
                f"header: {words[k]!r} in column {k + 1}; the columns must be"
                f" {wanted}, or the header must name all of these"
            )
    missing = [name for name in used if name not in found]
    for name in missing:
        place = names.index(name)
        if place >= len(words) or found[place] is not None:
            raise ValueError(f"header: no {' '.join(missing)}")
    return None


def _column(word: str) -> str | None:
    """Returns the name of a column; None for an unknown word."""
    text = _plain(word)
    if _TIME.fullmatch(text):
        return "time"
    for letter, pattern in _VECTORS.items():
        if match := pattern.fullmatch(text):
            return f"{letter}{match['axis']}"
    return _WORDS.get(text)
