"""The table of results, one number per row; and the table of queries.

The rows of `results.csv` and `queries.csv` begin with the columns of a `Key`,
followed by what was measured.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
import csv
from dataclasses import dataclass, field
from functools import cached_property
import io
import math
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.base import (
    InputError,
    check_separator,
    csv_text,
    errors_at,
    no_such,
    read_bytes,
    repeated,
    unquoted_cell,
    write_text,
)
from evaluation.recognition import (
    PROTOCOL_NAMES,
    Number,
    QueryOutcomes,
    metric_named,
)
from evaluation.results.cells import (
    CONTROL,
    FACTOR,
    NUMBER,
    SEED,
    TEXT,
    TRUTH,
    WHOLE,
    CellKind,
)
from evaluation.results.keys import (
    BASELINE,
    MEASURED,
    NEEDED_KEYS,
    OPTIONAL_KEYS,
    RESERVED,
    WORLD,
    Key,
    check_columns,
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


RESULTS = "results.csv"
QUERIES = "queries.csv"
# Columns of a query -> the kind of their cells.
_ANSWERS = {
    "query_frame": WHOLE,
    "query_stamp_ns": WHOLE,
    "query_x": NUMBER,
    "query_y": NUMBER,
    "query_z": NUMBER,
    "block": WHOLE,
    "correct": TRUTH,
    "has_match": TRUTH,
    "score": NUMBER,
    "first_right_rank": WHOLE,
    "why": TEXT,
    "match_drive": TEXT,
    "match_frame": WHOLE,
    "distance": NUMBER,
    "translation_error": NUMBER,
    "rotation_error_deg": NUMBER,
    "overlap": NUMBER,
    "visible_change": NUMBER,
}
# Kinds of cells -> the type of an array of their values.
_TYPES = {WHOLE: int, NUMBER: float, TRUTH: bool, TEXT: object}
_NEEDED_ANSWERS = ("query_frame", "correct", "has_match", "score")
# An interval of resampled queries misses the value by this share of the
# metric's range, at most.
_MOST_MISSED = 0.05


@dataclass(frozen=True)
class Row(Key):
    """A number that was measured.

    Attributes:
        metric: name of the metric.
        value: the number; NaN if it is undefined.
        low, high: limits of the number's 95 % interval; NaN if unknown.
        n: number of queries, structures or points that count; None if unknown.
        baseline: the values of factors that the experiment names for the
            condition with which this one is compared, such as
            `both.stage=last`; "" for the first values, or if unknown.
        world: how the recordings came into one world: `shared` or `aligned`, or
            `unknown` for maps' files; "" for simulated drives.
    """

    metric: str
    value: float
    low: float = math.nan
    high: float = math.nan
    n: int | None = None
    baseline: str = ""
    world: str = ""

    @classmethod
    def of(cls, number: Number, **key: Any) -> Row:
        """Returns a task's result as a row of the table.

        Args:
            number: the result.
            key: all other columns of the row, see `Key`.
        """
        named = {"method": number.method, "verified": number.verified, **key}
        return cls(
            **named,
            metric=number.metric,
            value=number.value,
            low=number.interval.low,
            high=number.interval.high,
            n=number.n,
        )


@dataclass(frozen=True, eq=False)
class Answers(Key):
    """The answers of a method to Q queries.

    Attributes:
        columns: name of a column of `queries.csv` -> (Q,) values. An unknown
            value (an empty cell in the file) is -1 in columns of integers, ""
            in columns of text, and otherwise NaN. If no candidate is a true
            match, `first_right_rank` is infinite, or -1 if read from a file.
    """

    columns: Mapping[str, np.ndarray]

    @cached_property
    def outcomes(self) -> QueryOutcomes:
        """Outcome of each query, with `num_places` 0, since it is unknown.

        Without a column `first_right_rank`, the ranks of wrong answers are NaN.
        """
        columns = self.columns
        is_right = np.asarray(columns["correct"], dtype=bool)
        ranks = np.full(len(is_right), math.nan)
        if "first_right_rank" in columns:
            known = np.asarray(columns["first_right_rank"], dtype=float)
            ranks = np.where(known >= 1.0, known, math.inf)
        blocks = columns.get("block")
        return QueryOutcomes(
            np.asarray(columns["score"], dtype=float),
            is_right,
            np.asarray(columns["has_match"], dtype=bool),
            np.where(is_right, 1.0, ranks),
            0,
            None if blocks is None or (blocks < 0).all() else blocks,
            columns,
        )


@dataclass(frozen=True)
class Results:
    """A table of results: its rows, and the names of its factors in order.

    Example:
        from evaluation import Results

        results = Results.read("study/results.csv")
        print(results.where(task="place", metric="auc").distinct("method"))
    """

    factors: tuple[str, ...]
    rows: tuple[Row, ...]

    @classmethod
    def of(cls, rows: Iterable[Row]) -> Results:
        """Returns a table of rows.

        The table's factors are in the order in which they appear in `rows`.
        """
        rows = tuple(rows)
        return cls(_factor_names(rows), rows)

    @classmethod
    def read(cls, path: str | Path) -> Results:
        """Returns the table in the file `results.csv`.

        `path` is this file or the folder that contains it. Columns can have any
        order; unknown columns are factors.

        Raises:
            InputError: the file cannot be read, lacks a column, has a column
                twice, or contains an impossible value. The error names the
                line, the column and the fault.
        """
        table = TableLines.read(path, RESULTS, MEASURED, [BASELINE, WORLD])
        rows: list[Row] = []
        lines: dict[tuple[object, ...], int] = {}
        for line, key, identity in table.keyed():
            row = Row(**key, **_measured_values(line))
            first = lines.setdefault((*identity, row.metric), line.number)
            if first != line.number:
                raise line.fault("metric", f"the same is in line {first}")
            rows.append(row)
        return cls(table.factors, tuple(rows))

    def write_csv(self, path: Path) -> None:
        """Writes the table as CSV; equal tables give equal bytes.

        Raises:
            InputError: the file cannot be written, or a value is impossible.
        """
        last = tuple(
            name
            for name in (WORLD, BASELINE)
            if any(row[name] for row in self.rows)
        )
        with errors_at(str(path)):
            lines = [
                (
                    *_key_cells(row, self.factors),
                    *_measured_cells(row),
                    *(TEXT.write(row[name]) for name in last),
                )
                for row in self.rows
            ]
        header = (*key_columns(self.factors), *MEASURED, *last)
        write_text(path, csv_text(header, lines))

    def where(
        self, columns: Mapping[str, object] | None = None, **named: object
    ) -> Results:
        """Returns the rows that have given values in given columns.

        Args:
            columns: name of a column -> value, or a tuple, list or set of
                possible values. Use this argument for names that contain dots.
            named: further columns, as keyword arguments.

        Raises:
            InputError: there is no such column.
        """
        columns = {**(columns or {}), **named}
        check_columns(columns, self.rows, self.factors)
        wanted = {
            name: value if isinstance(value, tuple | list | set) else (value,)
            for name, value in columns.items()
        }
        return Results(
            self.factors,
            tuple(
                row
                for row in self.rows
                if all(row[name] in values for name, values in wanted.items())
            ),
        )

    def defined(self) -> tuple[Results, str]:
        """Returns the rows whose values are known, and a note on the others.

        Means and charts are made of these rows alone.

        Returns:
            The table without undefined values; and a sentence that says of
            which metrics how many are left out, empty if none is.
        """
        rows = tuple(row for row in self.rows if not math.isnan(row.value))
        left = Counter(row.metric for row in self.rows if math.isnan(row.value))
        if not left:
            return self, ""
        total = Counter(row.metric for row in self.rows)
        counts = ", ".join(
            f"{name} ({number} of {total[name]})"
            for name, number in left.items()
        )
        note = f"left out of means and charts, as undefined: {counts}"
        return Results(self.factors, rows), note

    def distinct(self, column: str) -> list[Any]:
        """Returns the distinct values of a column, without None.

        The values are in the order in which they appear first.
        """
        found = dict.fromkeys(row[column] for row in self.rows)
        return [value for value in found if value is not None]


@dataclass(frozen=True)
class QueryRows:
    """The table in a file `queries.csv`.

    Attributes:
        factors: names of the columns that are factors of the experiment, such
            as `query.transient.snow`.
        answers: the answers of each method in each condition.

    Example:
        from evaluation import QueryRows

        for one in QueryRows.read("study/queries.csv").answers:
            print(one.method, one.outcomes.recall_at(5))
    """

    factors: tuple[str, ...]
    answers: tuple[Answers, ...]

    def __len__(self) -> int:
        """Returns the number of rows."""
        return sum(len(one.columns["correct"]) for one in self.answers)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yields the rows: name of a column -> value, see `Answers`."""
        for one in self.answers:
            key = {name: one[name] for name in key_columns(self.factors)}
            known = [name for name in _ANSWERS if name in one.columns]
            columns = [one.columns[name].tolist() for name in known]
            for values in zip(*columns, strict=True):
                yield key | dict(zip(known, values, strict=True))

    @classmethod
    def of(cls, answers: Iterable[Answers]) -> QueryRows:
        """Returns a table with the answers of methods to queries.

        The table's factors are in the order in which they appear in `answers`.
        """
        answers = tuple(answers)
        return cls(_factor_names(answers), answers)

    @classmethod
    def read(cls, path: str | Path) -> QueryRows:
        """Returns the table in the file `queries.csv`.

        `path` is this file or the folder that contains it. All columns of a
        query except `query_frame`, `correct`, `has_match` and `score` may be
        missing.

        Raises:
            InputError: as `Results.read`.
        """
        table = TableLines.read(
            path,
            QUERIES,
            _NEEDED_ANSWERS,
            _ANSWERS,
            # Tasks such as `change` and `map` have no queries.
            may_be_empty=True,
        )
        columns = [
            _AnswerColumn(name, kind, table.columns[name])
            for name, kind in _ANSWERS.items()
            if name in table.columns
        ]
        found: dict[tuple[object, ...], tuple[dict, list[TableLine]]] = {}
        for line, key, identity in table.keyed():
            found.setdefault(identity, (key, []))[1].append(line)
        return cls(
            table.factors,
            tuple(
                Answers(
                    **key, columns=_answer_columns(lines, columns, key["task"])
                )
                for key, lines in found.values()
            ),
        )

    def write_csv(self, path: Path) -> None:
        """Writes the table as CSV; equal tables give equal bytes.

        Raises:
            InputError: the file cannot be written.
        """
        header = (*key_columns(self.factors), *_ANSWERS)
        write_text(path, csv_text(header, self._lines()))

    def _lines(self) -> Iterator[list[str]]:
        for answers in self.answers:
            key = _key_cells(answers, self.factors)
            number = len(answers.columns["correct"])
            columns = [
                [kind.write(v) for v in answers.columns[name].tolist()]
                if name in answers.columns
                else [""] * number
                for name, kind in _ANSWERS.items()
            ]
            for answer in zip(*columns, strict=True):
                yield [*key, *answer]


def _factor_names(keys: Iterable[Key]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for key in keys for name in key.factors))


def _key_cells(key: Key, factors: Sequence[str]) -> list[str]:
    kinds = {"verified": TRUTH, "seed": SEED, **dict.fromkeys(factors, FACTOR)}
    return [
        kinds.get(name, TEXT).write(key[name]) for name in key_columns(factors)
    ]


def _measured_cells(row: Row) -> list[str]:
    metric = metric_named(row.metric)
    values = [
        metric.checked(float(number))
        for number in (row.value, row.low, row.high)
    ]
    return [row.metric, *map(NUMBER.write, values), WHOLE.write(row.n)]


@dataclass
class _AnswerColumn:
    """A column of answers to queries, which reads equal cells once.

    Most cells are the same for each method and condition.

    Attributes:
        name, kind: name of the column, and kind of its cells.
        place: position of the column in a line.
    """

    name: str
    kind: CellKind
    place: int
    _known: dict[str, Any] = field(default_factory=dict)

    def values(self, lines: Sequence[TableLine]) -> list[Any]:
        """Returns the values of the column's cells in lines."""
        known, place = self._known, self.place
        cells = [line.cells[place] for line in lines]
        if not known.keys() >= set(cells):
            for cell, line in zip(cells, lines, strict=True):
                if cell not in known:
                    known[cell] = line.value(self.name, self.kind)
        return [known[cell] for cell in cells]


def _answer_columns(
    lines: Sequence[TableLine], read: Iterable[_AnswerColumn], task: str
) -> dict[str, np.ndarray]:
    """Returns the checked values of all lines with the same key, by column.

    The queries are in the order of their frames, whatever the order of lines.
    """
    lines = sorted(lines, key=lambda line: line.value("query_frame", WHOLE))
    columns: dict[str, np.ndarray] = {
        one.name: np.array(one.values(lines), dtype=_TYPES[one.kind])
        for one in read
    }
    frames = columns["query_frame"]
    again = np.ones(len(frames), dtype=bool)
    again[np.unique(frames, return_index=True)[1]] = False
    right, has_match = columns["correct"], columns["has_match"]
    rank = columns.get("first_right_rank", np.full(len(frames), -1))
    is_place = task == "place"
    for name, is_wrong, fault in (
        ("query_frame", frames < 0, "empty"),
        ("query_frame", again, "this query is there twice"),
        ("correct", is_place & right & ~has_match, "1, without a match"),
        (
            "score",
            is_place & right & np.isnan(columns["score"]),
            "empty, but the top-ranked place is right",
        ),
        (
            "first_right_rank",
            is_place & (rank >= 0) & ((rank == 1) != right),
            "1 means correct, and the reverse",
        ),
    ):
        if is_wrong.any():
            raise lines[int(is_wrong.argmax())].fault(name, fault)
    return columns


def _measured_values(line: TableLine) -> dict[str, Any]:
    """Returns a row's values in the columns that follow its key."""
    metric = line.text("metric")
    value, low, high = (
        line.value(name, NUMBER) for name in ("value", "low", "high")
    )
    known = metric_named(metric)
    if math.isnan(value) and known.compute is not None and not known.undefined:
        raise line.fault("value", f"{metric} needs a number")
    for name, number in (("value", value), ("low", low), ("high", high)):
        try:
            known.checked(number)
        except InputError:
            raise line.fault(
                name, f"{number:g}, but {metric} is {known.range_text}"
            ) from None
    if math.isnan(low) != math.isnan(high):
        raise line.fault("low", "an interval has a low and a high end")
    if low > high:
        raise line.fault("low", f"{low:g} is more than high ({high:g})")
    missed = max(low - value, value - high)
    # Of a metric without limits, nothing is far.
    if known.is_resampled and missed > _MOST_MISSED * (
        known.greatest - known.least
    ):
        raise line.fault("value", f"{value:g} lies far off its interval")
    n = line.value("n", WHOLE)
    return {
        "metric": metric,
        "value": value,
        "low": low,
        "high": high,
        "n": None if n < 0 else n,
        **{
            name: line.value(name, TEXT)
            for name in (WORLD, BASELINE)
            if name in line.columns
        },
    }


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
        if values["protocol"] not in (*PROTOCOL_NAMES, ""):
            raise self.fault(
                "protocol",
                no_such("protocol", values["protocol"], PROTOCOL_NAMES),
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
    """Returns the lines of a CSV file: number and cells, the header first."""
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
    """Checks the names of a table's columns."""
    missing = [name for name in needed if name not in names]
    if missing:
        raise InputError(f"{file}: no column '{missing[0]}'")
    if "" in names:
        raise InputError(f"{file}: line 1: column '' has no name")
    for name in repeated(names):
        raise InputError(f"{file}: line 1: column '{name}' is there twice")
