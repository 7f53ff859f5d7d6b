"""The table of results, one number per row; and the table of queries.

`results.csv` and `queries.csv` begin with the same columns: where, under which
condition and how something was measured. All further columns are factors of an
experiment. A factor is named by the path of its field in the experiment's file,
such as `query.transient.snow`. The values of factors are numbers, text or truth
values; a cell is empty where a factor does not apply.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
import csv
from dataclasses import dataclass, field
from functools import cached_property
import io
import math
from operator import itemgetter
from pathlib import Path
import re
from typing import Any

import numpy as np

from cns_drake.base.complete_files import write_text
from cns_drake.base.csv_files import check_separator, csv_text
from cns_drake.base.errors import InputError, errors_at
from cns_drake.base.files import read_bytes
from cns_drake.base.repetitions import repeated
from cns_drake.base.terminal import note
from cns_drake.base.version import __version__
from evaluation.recognition.protocol import PROTOCOL_NAMES, RetrievalProtocol
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.result_number import Number
from evaluation.results.ranges import Range, checked, range_of

RESULTS = "results.csv"
QUERIES = "queries.csv"
# The beginning of a factor that is a setting of a method.
SETTINGS = "methods."
_BEFORE = ("experiment", "map", "database", "query", "seed")
_BEHIND = ("task", "method", "gate", "protocol")
# Columns that tables of earlier versions lack; their values are then unknown.
_MADE = ("protocol_digest", "version")
_NEEDED = (*_BEFORE, *_BEHIND)
KEYS = (*_NEEDED, *_MADE)
_MEASURED = ("metric", "value", "low", "high", "n")
# A factor, and two of its values: a drive's own stage, or that of the query.
STAGE = "both.stage"
OWN = "own"
LAST = "last"
# The factor of the frozen redraws of the shipped maps.
FROZEN_REDRAW = "both.redraw.frozen"
# The factors of an experiment with cases: the name of the case, and its level.
CAUSE = "cause"
LEVEL = "level"
# The cause of the condition without a change.
NO_CAUSE = "none"
# Names of columns in tables of earlier versions -> names of now.
_FORMER_NAMES = {"both.fresh": FROZEN_REDRAW, "radius_told": "gate"}
# Names of other columns of `Key`, which no factor can have.
_NAMED = frozenset(("label", *KEYS, *_MEASURED))
# Columns of a query -> what kind of value they have.
_ANSWERS = {
    "query_frame": int,
    "query_stamp_ns": int,
    "query_x": float,
    "query_y": float,
    "query_z": float,
    "block": int,
    "correct": bool,
    "has_match": bool,
    "score": float,
    "first_right_rank": int,
    "why": str,
    "match_drive": str,
    "match_frame": int,
    "distance": float,
    "translation_error": float,
    "rotation_error_deg": float,
    "overlap": float,
    "visible_change": float,
}
_NEEDED_ANSWERS = ("query_frame", "correct", "has_match", "score")
# Type -> value that stands for an empty cell.
_EMPTY: dict[type, object] = {int: -1, float: math.nan, str: ""}
_NUMBER = re.compile(
    r"[-+]?(\d+(\.\d*)?|\.\d+)(e[-+]?\d+)?", re.ASCII | re.IGNORECASE
)
# Leading zeros belong to names, as in the stage 01.
_NAME_OF_DIGITS = re.compile(r"0\d+")
_TRUTH = {"0": False, "1": True, "false": False, "true": True}
# Metrics whose intervals come from resampled queries, and may miss the value
# itself by a little.
_RESAMPLED = ("auc", "auc_strict", "r1")
# By so much, at most.
_MOST_MISSED = 0.05
# Rounding may lead beyond 0 and 1 by this.
_ROUNDING = 1e-9
# What a database costs; it grows with the number of places.
COSTS = ("query_time", "build_time", "memory")
# Metrics that are known for any set of queries.
_ALWAYS_KNOWN = ("auc", "auc_strict")
# Columns of tables of earlier versions -> the command that makes such a table
# now.
_FORMER = (
    ({"version", "db", "kept"}, "cns-drake study fresh"),
    ({"db", "cause", "level"}, "cns-drake study ladder"),
    ({"year", "seed", "kept"}, "cns-drake study years"),
    ({"tenth", "half"}, "cns-drake study years"),
    ({"db", "auc_unchanged"}, "cns-drake study stages"),
    ({"tcr_sym", "recall_at_1"}, "cns-drake study trend"),
    ({"others", "places", "query_ms"}, "cns-drake study size"),
    ({"map", "db", "query"}, "cns-drake study stages"),
)


@dataclass(frozen=True)
class Key:
    """Where, under which condition and how something was measured.

    Attributes:
        experiment: name of the experiment.
        map: name of the map.
        database: name of the drive that makes the database.
        query: name of the drive whose scans are the queries.
        seed: seed of everything that is random.
        factors: name -> value of each factor of the experiment. A factor that
            does not apply is missing or None.
        task: `place`, `pose`, `localise`, `map`, `change`, `cost` or another.
        method: method, estimator or baseline; "" for the task `change`.
        gate: whether geometric verification rejected places, by the method's
            own pose.
        protocol: name of the protocol: `fair`, `paper` or `recorded` for the
            shipped protocol as it is, and `own` for any other.
        protocol_digest: hash of everything in the protocol that changes a
            number, see `RetrievalProtocol.digest`; "" if unknown.
        version: version of this program; "" if unknown.
    """

    experiment: str
    map: str
    database: str
    query: str
    seed: int
    factors: Mapping[str, object]
    task: str
    method: str
    gate: bool
    protocol: str
    protocol_digest: str = field(default="", kw_only=True)
    version: str = field(default="", kw_only=True)

    def __getitem__(self, column: str) -> object:
        """Returns the value of a column, or `label`; None if it is unknown."""
        if column in _NAMED:
            return getattr(self, column, None)
        return self.factors.get(column)

    @property
    def label(self) -> str:
        """Name of the method, with its settings that are factors."""
        start = f"{SETTINGS}{self.method}."
        settings = (
            f"{name.removeprefix(start)} {value}"
            for name, value in self.factors.items()
            if name.startswith(start) and value is not None
        )
        return ", ".join((self.method, *settings))

    def but(self, *names: str) -> tuple[object, ...]:
        """Returns the key without some of its columns, to group rows by.

        If two rows have the same reduced key, they were measured under
        conditions that differ only in the columns left out.

        Args:
            names: names of the columns to leave out. With `method`, settings of
                methods, such as `methods.ring++.crop`, are left out as well.
                With `protocol` or a field of the protocol, such as
                `protocol.radius`, name and digest of the protocol are left out.
                The version is never part of the key.

        Returns:
            The values of the remaining columns, in a fixed order.
        """
        if any(one.partition(".")[0] == "protocol" for one in names):
            names = (*names, "protocol", "protocol_digest")
        known = [name for name in KEYS if name not in (*names, "version")]
        without_settings = "method" in names
        applying = (
            (name, value)
            for name, value in self.factors.items()
            if value is not None
            and name not in names
            and not (without_settings and name.startswith(SETTINGS))
        )
        return (
            *(getattr(self, n) for n in known),
            *sorted(applying, key=_NAME),
        )


_NAME: Callable[[Any], str] = itemgetter(0)


def made_by(
    protocol: RetrievalProtocol, settings: Mapping[str, object] | None = None
) -> dict[str, Any]:
    """Returns the columns of a `Key` that say how something was measured.

    Args:
        protocol: the protocol.
        settings: name -> value of the settings that affect results, are no part
            of the protocol, and differ from their defaults.

    Returns:
        `protocol`, `protocol_digest` and `version`. With settings, the protocol
        is `own`.
    """
    return {
        "protocol": "own" if settings else protocol.name,
        "protocol_digest": protocol.digest(**(settings or {})),
        "version": __version__,
    }


@dataclass(frozen=True)
class Row(Key):
    """A number that was measured.

    Attributes:
        metric: name of the metric.
        value: the number; NaN if it is undefined. low, high: limits of the
        number's 95 % interval; NaN if unknown.
        n: number of queries, structures or points that count; None if unknown.
    """

    metric: str
    value: float
    low: float = math.nan
    high: float = math.nan
    n: int | None = None

    @classmethod
    def of(cls, number: Number, **key: Any) -> Row:
        """Returns a task's result as a row of the table.

        Args:
            number: the result.
            key: all other columns of the row, see `Key`.
        """
        named = {"method": number.method, "gate": number.gate, **key}
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
        """Outcome of each query, with `num_places` 0, since it is unknown."""
        columns = self.columns
        is_right = np.asarray(columns["correct"], dtype=bool)
        ranks = np.full(len(is_right), math.inf)
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
            InputError: the file cannot be read, is a table of an earlier
                version, lacks a column, has a column twice, or contains an
                impossible value. The error names the line, the column and the
                fault.
        """
        table = _Cells.read(path, RESULTS, (*_NEEDED, *_MEASURED), _MADE)
        rows: list[Row] = []
        lines: dict[tuple[object, ...], int] = {}
        for one, key, identity in table.keyed():
            row = Row(**key, **_measured_values(one))
            first = lines.setdefault((*identity, row.metric), one.number)
            if first != one.number:
                raise one.fault("metric", f"the same is in line {first}")
            rows.append(row)
        return cls(table.factors, tuple(rows))

    def write_csv(self, path: Path) -> None:
        """Writes the table as CSV; equal tables give equal bytes.

        Raises:
            InputError: the file cannot be written, or a value cannot be.
        """
        with errors_at(str(path)):
            lines = [
                (*_key_cells(row, self.factors), *_measured_cells(row))
                for row in self.rows
            ]
        header = (*_BEFORE, *self.factors, *_BEHIND, *_MADE, *_MEASURED)
        write_text(path, csv_text(header, lines))

    def where(
        self, columns: Mapping[str, object] | None = None, **named: object
    ) -> Results:
        """Returns the rows that have given values in given columns.

        Args:
            columns: name of a column -> value, or a tuple, list or set of
                possible values. Use this argument for names that contain dots.
            named: further columns, as keyword arguments.
        """
        wanted = {
            name: value if isinstance(value, tuple | list | set) else (value,)
            for name, value in {**(columns or {}), **named}.items()
        }
        return Results(
            self.factors,
            tuple(
                row
                for row in self.rows
                if all(row[name] in some for name, some in wanted.items())
            ),
        )

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
        table = _Cells.read(
            path,
            QUERIES,
            (*_NEEDED, *_NEEDED_ANSWERS),
            (*_MADE, *_ANSWERS),
            # Tasks such as `change` and `map` have no queries.
            may_be_empty=True,
        )
        names = [name for name in _ANSWERS if name in table.columns]
        found: dict[tuple[object, ...], tuple[dict, list[_Line]]] = {}
        for one, key, identity in table.keyed():
            found.setdefault(identity, (key, []))[1].append(one)
        return cls(
            table.factors,
            tuple(
                Answers(
                    **key, columns=_answer_columns(lines, names, key["task"])
                )
                for key, lines in found.values()
            ),
        )

    def write_csv(self, path: Path) -> None:
        """Writes the table as CSV; equal tables give equal bytes.

        Raises:
            InputError: the file cannot be written.
        """
        header = (*_BEFORE, *self.factors, *_BEHIND, *_MADE, *_ANSWERS)
        write_text(path, csv_text(header, self._lines()))

    def _lines(self) -> Iterator[list[str]]:
        for one in self.answers:
            key = _key_cells(one, self.factors)
            number = len(one.columns["correct"])
            columns = [
                [_answer_cell(v, kind) for v in one.columns[name].tolist()]
                if name in one.columns
                else [""] * number
                for name, kind in _ANSWERS.items()
            ]
            for answer in zip(*columns, strict=True):
                yield [*key, *answer]


def _factor_names(keys: Iterable[Key]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for key in keys for name in key.factors))


def _key_cells(key: Key, factors: Sequence[str]) -> list[str]:
    names = (*_BEFORE, *factors, *_BEHIND, *_MADE)
    cells = [_cell(key[name]) for name in names]
    cells[names.index("gate")] = str(int(key.gate))
    return cells


def _measured_cells(row: Row) -> list[str]:
    values = [
        checked(row.metric, float(one))
        for one in (row.value, row.low, row.high)
    ]
    return [row.metric, *map(_cell, (*values, row.n))]


def _cell(value: object) -> str:
    """Returns a value as the table has it, with all its digits."""
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(float(value))
    return "" if value is None else str(value)


def _answer_cell(value: Any, kind: type) -> str:
    if kind is int and not 0 <= value < math.inf:
        return ""
    return str(int(value)) if kind in (bool, int) else _cell(value)


def _answer_columns(
    lines: Sequence[_Line], names: Iterable[str], task: str
) -> dict[str, np.ndarray]:
    """Returns column -> checked values of all lines with the same key."""
    columns: dict[str, np.ndarray] = {}
    for name in names:
        kind = _ANSWERS[name]
        values = [one.value(name, kind) for one in lines]
        columns[name] = np.array(values, dtype=object if kind is str else kind)
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


def _measured_values(one: _Line) -> dict[str, Any]:
    """Returns a row's values in the columns after those of its key."""
    metric = one.text("metric")
    value, low, high = (
        one.value(name, float) for name in ("value", "low", "high")
    )
    if math.isnan(value) and metric in _ALWAYS_KNOWN:
        raise one.fault("value", f"{metric} needs a number")
    least, greatest, _ = range_of(metric) or Range()
    if value < least or value > greatest:
        limits = f"from {least:g} to {greatest:g}"
        if math.isinf(greatest):
            limits = f"{least:g} or more"
        raise one.fault("value", f"{value:g}, but {metric} is {limits}")
    if math.isnan(low) != math.isnan(high):
        raise one.fault("low", "an interval has a low and a high end")
    if low > high:
        raise one.fault("low", f"{low:g} is more than high ({high:g})")
    if metric in _RESAMPLED and not math.isnan(low):
        if not (low >= -_ROUNDING and high <= 1.0 + _ROUNDING):
            raise one.fault("low", "an interval from 0 to 1 at most")
        if not low - _MOST_MISSED <= value <= high + _MOST_MISSED:
            raise one.fault("value", f"{value:g} lies far off its interval")
    n = one.value("n", int)
    return {
        "metric": metric,
        "value": value,
        "low": low,
        "high": high,
        "n": None if n < 0 else n,
    }


@dataclass(frozen=True)
class _Line:
    """A line of a table."""

    file: Path
    number: int
    columns: Mapping[str, int]
    cells: Sequence[str]

    def fault(self, column: str, fault: str) -> InputError:
        return InputError(f"{self.file}: line {self.number}: {column}: {fault}")

    def cells_of(self, names: Iterable[str]) -> tuple[str, ...]:
        return tuple([self.cells[self.columns[name]] for name in names])

    def text(self, column: str) -> str:
        cell = self.cells[self.columns[column]]
        if not cell:
            raise self.fault(column, "empty")
        return cell

    def value(self, column: str, kind: type) -> Any:
        """Returns a cell as a value of a type.

        The value of an empty cell is -1 for int, NaN for float, and "" for str.

        Raises:
            InputError: the cell contains no value of this type.
        """
        cell = self.cells[self.columns[column]]
        if kind is bool:
            if cell.lower() not in _TRUTH:
                raise self.fault(column, f"{cell!r} is neither 0 nor 1")
            return _TRUTH[cell.lower()]
        if kind is str or not cell:
            return cell or _EMPTY[kind]
        if not _NUMBER.fullmatch(cell) or math.isinf(float(cell)):
            raise self.fault(column, f"{cell!r} is no number")
        if kind is float:
            return float(cell)
        # Programs with NaN for empty cells write whole numbers with a point.
        whole = int(cell) if cell.isdigit() else float(cell)
        if not 0 <= whole < 2**63 or whole != int(whole):
            raise self.fault(column, f"{cell!r} is no whole number from 0 on")
        return int(whole)

    def factor(self, column: str) -> object:
        """Returns the value of a factor: number, truth value, text or None."""
        cell = self.cells[self.columns[column]]
        if _NUMBER.fullmatch(cell) and not _NAME_OF_DIGITS.fullmatch(cell):
            value = float(cell)
            if math.isinf(value):
                raise self.fault(column, f"{cell!r} is no number")
            return int(cell) if cell.lstrip("+-").isdigit() else value
        if cell.lower() in ("true", "false"):
            return _TRUTH[cell.lower()]
        return cell or None

    def key(self, factors: Iterable[str]) -> dict[str, Any]:
        """Returns the arguments with which to make the `Key` of this line.

        `factors` contains the names of the columns with factors. Factors whose
        cells are empty are left out.

        Raises:
            InputError: a cell is empty or has a value that is not allowed.
        """
        values: dict[str, Any] = {
            name: self.text(name) for name in ("experiment", "map", "task")
        }
        for name in ("database", "query", "method", "protocol"):
            values[name] = self.cells[self.columns[name]]
        for name in filter(self.columns.__contains__, _MADE):
            values[name] = self.cells[self.columns[name]]
        values["seed"] = self.value("seed", int)
        if values["seed"] < 0:
            raise self.fault("seed", "empty")
        values["gate"] = self.value("gate", bool)
        known = {name: self.factor(name) for name in factors}
        values["factors"] = {n: v for n, v in known.items() if v is not None}
        if not values["method"] and values["task"] != "change":
            raise self.fault("method", "empty")
        names = (*PROTOCOL_NAMES, "")
        if values["protocol"] not in names:
            raise self.fault(
                "protocol",
                f"{values['protocol']!r} is none of {', '.join(names[:-1])}",
            )
        return values


@dataclass(frozen=True)
class _Cells:
    """The lines of a file, and where each column stands."""

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
    ) -> _Cells:
        """Reads the lines of a table of results.

        Args:
            path: the file, or a folder that contains it.
            usual: name of the file in a folder.
            needed: names of columns that the file must have.
            known: names of further columns that are not factors.
            may_be_empty: whether the file may have no rows.
        """
        path = Path(path)
        file = path / usual if path.is_dir() else path
        try:
            text = read_bytes(file).decode("utf-8-sig")
            check_separator(file, text)
            reader = csv.reader(io.StringIO(text, newline=""), strict=True)
            (_, names), *rows = [
                (reader.line_num, [cell.strip(" ") for cell in row])
                for row in reader
            ] or [(1, [])]
        except UnicodeDecodeError:
            raise InputError(f"{file}: not UTF-8 text") from None
        except csv.Error as error:
            raise InputError(f"{file}: not CSV: {error}") from None
        for number, row in [(1, names), *rows]:
            if not "".join(row).isprintable():
                k, cell = next(
                    (k, cell)
                    for k, cell in enumerate(row)
                    if not cell.isprintable()
                )
                name = names[k] if number > 1 and k < len(names) else k + 1
                raise InputError(
                    f"{file}: line {number}: {name}: {cell!r} has a control"
                    " character"
                )
        needed = tuple(needed)
        for former, now in _FORMER_NAMES.items():
            if former in names and now not in names:
                note(f"{file}: the column {former} is named {now} now")
                names[names.index(former)] = now
        width = len(names)
        missing = [name for name in needed if name not in names]
        for columns_then, command in _FORMER:
            if missing and columns_then <= set(names):
                raise InputError(
                    f"{file}: a table of an earlier version; '{command}' makes"
                    " one with the columns of now"
                )
        if missing:
            raise InputError(f"{file}: no column '{missing[0]}'")
        if "" in names:
            raise InputError(f"{file}: line 1: column '' has no name")
        for name in repeated(names):
            raise InputError(f"{file}: line 1: column '{name}' is there twice")
        others = {*needed, *known}
        factors = [name for name in names if name not in others]
        for name in factors:
            if name in _NAMED:
                raise InputError(f"{file}: line 1: '{name}' names no factor")
        columns = {name: k for k, name in enumerate(names)}
        rows = [one for one in rows if any(one[1])]
        if not (rows or may_be_empty):
            raise InputError(f"{file}: no rows")
        for number, row in rows:
            if len(row) != width:
                raise InputError(
                    f"{file}: line {number}: {len(row)} cells instead of"
                    f" {width}"
                )
        return cls(file, columns, tuple(factors), rows)

    def keyed(
        self,
    ) -> Iterator[tuple[_Line, dict[str, Any], tuple[object, ...]]]:
        """Yields each line of the file with its key.

        Yields:
            The line; the attributes of its `Key`, by name; and all values of
            the `Key` as a tuple, by which lines can be grouped.

        Raises:
            InputError: a line has a wrong key.
        """
        made = filter(self.columns.__contains__, _MADE)
        names = (*_BEFORE, *self.factors, *_BEHIND, *made)
        known: dict[tuple[str, ...], tuple[dict, tuple[object, ...]]] = {}
        for number, cells in self.rows:
            one = _Line(self.file, number, self.columns, cells)
            spelled = one.cells_of(names)
            if spelled not in known:
                key = one.key(self.factors)
                known[spelled] = key, Key(**key).but()
            yield one, *known[spelled]
