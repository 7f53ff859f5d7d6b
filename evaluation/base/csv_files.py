"""Reading and writing CSV files."""

from collections.abc import Iterable, Sequence
import csv
import io
from pathlib import Path
import re

from evaluation.base.complete_files import write_text
from evaluation.base.errors import InputError
from evaluation.base.files import read_text
from evaluation.base.number_format import other_separator
from evaluation.base.repetitions import repeated

# Control characters: no table needs them, and a terminal would obey them.
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f-\x9f]")
# What a spreadsheet computes, perhaps behind quotes of ours.
_FORMULA = re.compile("'*[=+@-]")


def csv_text(header: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Returns a header and rows as CSV.

    None and NaN become empty cells; True and False become 1 and 0; texts are
    as `quoted_cell` returns them.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(_cell, header))
    writer.writerows(map(_cell, row) for row in rows)
    return stream.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, str):
        return quoted_cell(value)
    if isinstance(value, bool):
        return int(value)
    return "" if value != value else value


def quoted_cell(text: str) -> str:
    """Returns a text for a table, with a quote before a formula.

    A spreadsheet would compute a formula, which may be a name in somebody
    else's file. Numbers stay, with their signs.
    """
    if _FORMULA.match(text) and text != "-":
        try:
            float(text)
        except ValueError:
            return f"'{text}"
    return text


def unquoted_cell(text: str) -> str:
    """Returns the text of which `quoted_cell` returns `text`."""
    return text[1:] if text[:1] == "'" and _FORMULA.match(text) else text


def write_csv(
    path: Path, header: Iterable[object], rows: Iterable[Iterable[object]]
) -> None:
    """Writes a CSV file.

    Args:
        path: the file; an existing file is replaced.
        header: names of the columns, written as the first line.
        rows: cells of each further line, as for
            `evaluation.base.csv_files.csv_text`.

    Raises:
        InputError: the file cannot be written.
    """
    write_text(path, csv_text(header, rows))


def read_rows(path: Path) -> list[tuple[int, list[str]]]:
    """Returns the rows of a CSV file, each with its line number.

    Cells are stripped of surrounding spaces, and of quotes before formulas.
    Empty rows are left out.

    Raises:
        InputError: the file cannot be read, is not CSV in UTF-8, holds a
            control character, or separates the cells of its first line by
            characters other than commas.
    """
    text = read_text(path)
    try:
        lines = text.splitlines()
        for number, line in enumerate(lines, start=1):
            if _CONTROL.search(line):
                raise InputError(f"{path}: line {number}: a control character")
        check_separator(path, text)
        reader = csv.reader(lines, skipinitialspace=True)
        rows = [
            (reader.line_num, [unquoted_cell(cell.strip()) for cell in row])
            for row in reader
        ]
    except csv.Error as error:
        raise InputError(f"{path}: not CSV: {error}") from error
    return [(line, row) for line, row in rows if any(row)]


def check_separator(path: Path, text: str) -> None:
    """Raises an error if a CSV's first line has no commas between its cells.

    Raises:
        InputError: semicolons or tabs separate the cells.
    """
    if fault := other_separator(text.strip().partition("\n")[0], ","):
        raise InputError(f"{path}: {fault}")


def read_records(
    path: Path, columns: Sequence[str]
) -> list[tuple[int, dict[str, str]]]:
    """Returns the rows of a CSV file whose first line names the columns.

    Args:
        path: the file.
        columns: names of the columns that the file must have. The file may have
            further columns.

    Returns:
        For each row, its line number and a dictionary column -> cell.

    Raises:
        InputError: the file cannot be read as CSV (see
            `read_rows`), a column is missing or occurs
            twice, or a row has more or fewer cells than there are columns.
    """
    (_, names), *rows = read_rows(path) or [(1, [])]
    for column in filter(None, repeated(names)):
        raise InputError(f"{path}: column '{column}' is there twice")
    for column in columns:
        if column not in names:
            raise InputError(f"{path}: no column '{column}'")
    for line, row in rows:
        if len(row) != len(names):
            raise InputError(
                f"{path}: line {line}: {len(row)} cells instead of {len(names)}"
            )
    return [(line, dict(zip(names, row, strict=True))) for line, row in rows]
