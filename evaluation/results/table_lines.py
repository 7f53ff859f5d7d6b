"""The lines of `results.csv` and `queries.csv`, read with checked cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
import csv
from dataclasses import dataclass
import io
from pathlib import Path
from typing import Any

from cns_drake.base import (
    InputError,
    check_separator,
    read_bytes,
    repeated,
    unquoted_cell,
)
from evaluation.recognition import PROTOCOL_NAMES
from evaluation.results.cells import (
    CONTROL,
    FACTOR,
    SEED,
    TEXT,
    TRUTH,
    CellKind,
)
from evaluation.results.keys import (
    NEEDED_KEYS,
    OPTIONAL_KEYS,
    RESERVED,
    Key,
    key_columns,
)

# Columns of a key that every table has, with text.
_TEXTS = (
    "experiment",
    "map",
    "task",
    "database",
    "query",
    "method",
    "protocol",
)
# Tasks that measure drives, and no method.
_OF_DRIVES = ("change", "seen")


@dataclass(frozen=True)
class TableLine:
    """A line of a table.

    Attributes:
        file: the table's file, for errors.
        number: number of the line in the file, from 1.
        columns: name of a column -> its position in the line.
        cells: texts of the line's cells.
    """

    file: Path
    number: int
    columns: Mapping[str, int]
    cells: Sequence[str]

    def fault(self, column: str, fault: str) -> InputError:
        """Returns an error on a cell, with the file and the line's number."""
        return InputError(f"{self.file}: line {self.number}: {column}: {fault}")

    def cells_of(self, names: Iterable[str]) -> tuple[str, ...]:
        """Returns the texts of some columns' cells."""
        return tuple([self.cells[self.columns[name]] for name in names])

    def text(self, column: str) -> str:
        """Returns the text of a cell.

        Raises:
            InputError: the cell is empty.
        """
        cell = self.cells[self.columns[column]]
        if not cell:
            raise self.fault(column, "empty")
        return cell

    def value(self, column: str, kind: CellKind) -> Any:
        """Returns the value of a cell.

        Raises:
            InputError: the cell contains no value of this kind.
        """
        try:
            return kind.read(self.cells[self.columns[column]])
        except ValueError as error:
            raise self.fault(column, str(error)) from None

    def key(self, factors: Iterable[str]) -> dict[str, Any]:
        """Returns the arguments with which to make the `Key` of this line.

        `factors` contains the names of the columns with factors. Factors whose
        cells are empty are left out.

        Raises:
            InputError: a cell is empty or has a value that is not allowed.
        """
        for name in ("experiment", "map", "task"):
            self.text(name)  # Not empty.
        optional = filter(self.columns.__contains__, OPTIONAL_KEYS)
        values = {name: self.value(name, TEXT) for name in (*_TEXTS, *optional)}
        self.text("seed")
        values["seed"] = self.value("seed", SEED)
        values["verified"] = self.value("verified", TRUTH)
        known = {name: self.value(name, FACTOR) for name in factors}
        values["factors"] = {n: v for n, v in known.items() if v is not None}
        if not values["method"] and values["task"] not in _OF_DRIVES:
            raise self.fault("method", "empty")
        names = (*PROTOCOL_NAMES, "")
        if values["protocol"] not in names:
            raise self.fault(
                "protocol",
                f"{values['protocol']!r} is none of {', '.join(names[:-1])}",
            )
        return values


@dataclass(frozen=True)
class TableLines:
    """The lines of a table's file.

    Attributes:
        file: the file, for errors.
        columns: name of a column -> its position in a line.
        factors: names of the columns with factors.
        rows: for each line, its number in the file and the texts of its cells.
    """

    file: Path
    columns: Mapping[str, int]
    factors: tuple[str, ...]
    rows: Sequence[tuple[int, list[str]]]

    @classmethod
    def read(
        cls,
        path: str | Path,
        usual: str,
        needed: Iterable[str],
        known: Iterable[str] = (),
        *,
        may_be_empty: bool = False,
    ) -> TableLines:
        """Reads the lines of a table.

        Args:
            path: the file, or a folder that contains it.
            usual: name of the file in a folder.
            needed: names of columns that the file must have besides the columns
                of its keys.
            known: names of further columns that are not factors.
            may_be_empty: whether the file may have no rows.

        Raises:
            InputError: the file cannot be read, lacks a column, has a column
                twice, or a line has too many or too few cells.
        """
        path = Path(path)
        file = path / usual if path.is_dir() else path
        (_, names), *lines = _csv_lines(file)
        needed = (*NEEDED_KEYS, *needed)
        _check_columns(file, names, needed)
        others = {*needed, *OPTIONAL_KEYS, *known}
        factors = tuple(name for name in names if name not in others)
        for name in factors:
            if name in RESERVED:
                raise InputError(f"{file}: line 1: '{name}' names no factor")
        columns = {name: k for k, name in enumerate(names)}
        rows = [line for line in lines if any(line[1])]
        if not (rows or may_be_empty):
            raise InputError(f"{file}: no rows")
        for number, row in rows:
            if len(row) != len(names):
                raise InputError(
                    f"{file}: line {number}: {len(row)} cells instead of"
                    f" {len(names)}"
                )
        return cls(file, columns, factors, rows)

    def keyed(
        self,
    ) -> Iterator[tuple[TableLine, dict[str, Any], tuple[object, ...]]]:
        """Yields each line of the file with its key.

        Yields:
            The line; the attributes of its `Key`, by name; and the `identity`
            of this key.

        Raises:
            InputError: a line has a wrong key.
        """
        names = filter(self.columns.__contains__, key_columns(self.factors))
        columns = tuple(names)
        known: dict[tuple[str, ...], tuple[dict, tuple[object, ...]]] = {}
        for number, cells in self.rows:
            line = TableLine(self.file, number, self.columns, cells)
            spelled = line.cells_of(columns)
            if spelled not in known:
                key = line.key(self.factors)
                known[spelled] = key, Key(**key).identity
            yield line, *known[spelled]


def _csv_lines(file: Path) -> list[tuple[int, list[str]]]:
    """Returns the lines of a CSV file: number and cells, the header first.

    Raises:
        InputError: the file cannot be read, is no CSV file, or a cell has a
            control character.
    """
    try:
        text = read_bytes(file).decode("utf-8-sig")
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        lines = [
            (
                reader.line_num,
                [unquoted_cell(cell.strip(" ")) for cell in row]
                if " " in (joined := "".join(row)) or "'" in joined
                else row,
            )
            for row in reader
        ] or [(1, [])]
    except UnicodeDecodeError:
        raise InputError(f"{file}: not UTF-8 text") from None
    except csv.Error as error:
        raise InputError(f"{file}: not CSV: {error}") from None
    names = lines[0][1]
    if NEEDED_KEYS[0] not in names:
        check_separator(file, text)
    for index, (number, cells) in enumerate(lines):
        if not CONTROL.search("".join(cells)):
            continue
        k, cell = next(
            (k, cell) for k, cell in enumerate(cells) if CONTROL.search(cell)
        )
        column = names[k] if index > 0 and k < len(names) else k + 1
        raise InputError(
            f"{file}: line {number if index else 1}: {column}: {cell!r} has a"
            " control character"
        )
    return lines


def _check_columns(
    file: Path, names: Sequence[str], needed: Iterable[str]
) -> None:
    """Checks the names of a table's columns.

    Raises:
        InputError: the table lacks a column, has a column twice or a column
            without a name.
    """
    missing = [name for name in needed if name not in names]
    if missing:
        raise InputError(f"{file}: no column '{missing[0]}'")
    if "" in names:
        raise InputError(f"{file}: line 1: column '' has no name")
    for name in repeated(names):
        raise InputError(f"{file}: line 1: column '{name}' is there twice")
