"""Tables of numbers, written as Markdown, LaTeX, HTML and CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import html
from itertools import accumulate, groupby
import math
from operator import attrgetter
from pathlib import Path
import re
from typing import Any, NamedTuple, TypeVar

import numpy as np

from cns_drake.base.complete_files import write_text
from cns_drake.base.csv_files import csv_text
from cns_drake.base.yaml_files import read_yaml
from evaluation.recognition.protocol import PROTOCOL_COLUMNS
from evaluation.results.ranges import checked, range_of

_Item = TypeVar("_Item")
_Key = TypeVar("_Key")

# Columns of a table of items: name of a column, or (name of its group, its own
# name) -> function that returns the value of an item. An item may have several
# rows; values are then arrays or lists with one for each of them.
Columns = Mapping[str | tuple[str, str], Callable[[_Item], object]]

MISSING = "–"
# Table -> what it shows.
CAPTIONS = read_yaml(Path(__file__).with_name("captions.yaml"))
# The spelling of the methods' authors, in the order of tables; our methods come
# last.
_METHOD_TITLES = {
    "scan-context++": "Scan Context++",
    "solid": "SOLiD",
    "ring++": "RING++",
    "btc": "BTC",
    "layered-overlap": "Layered overlap",
    "learned": "Learned",
    "bevplace": "BEVPlace",
    "dpa-net": "DPA-Net",
    "map-closures": "MapClosures",
    "probe": "PROBE",
    "svt-net": "SVT-Net",
}

_LATEX = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "&": r"\&",
    "%": r"\%",
    "#": r"\#",
    "_": r"\_",
    "±": r"$\pm$",
    "→": r"$\rightarrow$",
    "↔": r"$\leftrightarrow$",
    "–": "--",
    "·": r"$\cdot$",
}
# A number that is written as text, such as "< 0.0001" or "12 %".
_NUMBER = re.compile(r"(< )?-?[\d.]+( %)?")
# Characters that turn text into a table, a link, a picture or a tag.
_MARKDOWN = {ord(c): f"\\{c}" for c in "\\`*_[]|"} | {
    ord("<"): "&lt;",
    ord(">"): "&gt;",
}


@dataclass(frozen=True)
class Cell:
    """A number in a table, next to the paper's number.

    Attributes:
        value: our number; None or NaN if there is none.
        printed: the paper's number, or None.
        rank: 1 for the best of our numbers in the row, 2 for the second best,
            None for all others.
    """

    value: float | None
    printed: float | None = None
    rank: int | None = None


@dataclass(frozen=True)
class Table:
    """Rows under a header; numbers stay numbers until they are written.

    A missing value is written as an empty cell in CSV, and as a dash in other
    formats. Truth values are written as 0 or 1. Each number is checked against
    the range of its metric, which the heading of its column or group names; see
    `evaluation.results.ranges`.

    Attributes:
        header: name of each column.
        rows: one value for each column: text, a number, a `Cell`, or None for
            an empty cell.
        groups: headings above the columns, each with the number of columns that
            it spans. An empty heading is not written. Together, the headings
            span all columns. By default there are no headings.
        caption: what the table shows.

    Raises:
        InputError: a cell is outside the range of the column's metric.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    caption: str = ""

    def __post_init__(self) -> None:
        groups = [name for name, span in self.groups for _ in range(span)]
        # The metric is in the column's own head or in the head of its group.
        names = [
            head if range_of(head) else group
            for head, group in zip(
                self.header, groups or [""] * len(self.header), strict=True
            )
        ]
        rows = tuple(tuple(map(_checked, names, row)) for row in self.rows)
        object.__setattr__(self, "rows", rows)

    @classmethod
    def of(
        cls, items: Iterable[_Item], columns: Columns[_Item], caption: str = ""
    ) -> Table:
        """Returns a table with rows for a list of items.

        Args:
            items: the items, each of which makes one row, or several if a
                column returns an array.
            columns: name of a column -> function that returns the cell of an
                item. A name can be a pair: a heading above several columns, and
                the name.
            caption: what the table shows.
        """
        names = [n if isinstance(n, tuple) else ("", n) for n in columns]
        groups = groupby(group for group, _ in names)
        spans = tuple((group, len(list(same))) for group, same in groups)
        return cls(
            tuple(name for _, name in names),
            tuple(
                row
                for item in items
                for row in _rows([value(item) for value in columns.values()])
            ),
            spans if any(group for group, _ in spans) else (),
            caption,
        )

    def without_empty(self, name: str) -> Table:
        """Returns the table without a given column if the column is empty."""
        column = self.header.index(name)
        if not all(_is_missing(row[column]) for row in self.rows):
            return self
        return replace(
            self,
            header=self.header[:column] + self.header[column + 1 :],
            rows=tuple(r[:column] + r[column + 1 :] for r in self.rows),
        )

    def to_csv(self) -> str:
        """Returns the table as CSV with all digits."""
        return csv_text(self._full_names(), self.rows)

    def write_csv(self, path: Path) -> None:
        """Writes the table as CSV, as `to_csv` returns it.

        Raises:
            InputError: the file cannot be written.
        """
        write_text(path, self.to_csv())

    def to_markdown(self) -> str:
        """Returns the table as Markdown, with four decimals.

        The paper's numbers follow ours in brackets.
        """
        lines = [
            [escape_markdown(name) for name in self._full_names()],
            ["---"] * len(self.header),
            *([_MARKDOWN_FORM.cell(value) for value in r] for r in self.rows),
        ]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)

    def to_html(self) -> str:
        """Returns the table as an HTML element.

        Cells of columns with text are of the class `text`. The cells of the
        first column under each named heading are of the class `first`.
        """
        caption = html.escape(self.caption)
        kinds = self._column_classes()
        lines = [
            "".join(
                f'<th colspan="{span}" class="group">{html.escape(name)}</th>'
                for name, span in self.groups
            ),
            "".join(
                f"<th{kind}>{html.escape(name)}</th>"
                for kind, name in zip(kinds, self.header, strict=True)
            ),
        ]
        head = "".join(f"<tr>{line}</tr>" for line in lines if line)
        body = "".join(
            "<tr>"
            + "".join(
                f"<td{kind}>{_HTML_FORM.cell(value)}</td>"
                for kind, value in zip(kinds, row, strict=True)
            )
            + "</tr>"
            for row in self.rows
        )
        return (
            f"<table>{caption and f'<caption>{caption}</caption>'}"
            f"<thead>{head}</thead><tbody>{body}</tbody></table>"
        )

    def _column_classes(self) -> list[str]:
        """Returns the attribute `class` of each column's cells in HTML."""
        starts = accumulate((span for _, span in self.groups), initial=0)
        first = {
            start
            for start, (name, _) in zip(starts, self.groups, strict=False)
            if name
        }
        found = []
        for k in range(len(self.header)):
            names = ["first"] * (k in first)
            if any(_is_text(row[k]) for row in self.rows):
                names.append("text")
            found.append(f' class="{" ".join(names)}"' if names else "")
        return found

    def to_latex(self) -> str:
        r"""Returns the table as LaTeX `table*`, for the package booktabs."""
        lines = [
            "% Needs \\usepackage{booktabs}; \\resizebox is of graphicx.",
            r"\begin{table*}",
            r"\centering",
        ]
        if self.caption:
            lines.append(rf"\caption{{{_escape_latex(self.caption)}}}")
        lines += [
            r"\resizebox{\textwidth}{!}{%",
            rf"\begin{{tabular}}{{@{{}}{'c' * len(self.header)}@{{}}}}",
            r"\toprule",
        ]
        if self.groups:
            lines += self._latex_groups()
        lines.append(_latex_row(map(_escape_latex, self.header)))
        lines.append(r"\midrule")
        lines += [_latex_row(map(_LATEX_FORM.cell, row)) for row in self.rows]
        lines += [r"\bottomrule", r"\end{tabular}}", r"\end{table*}"]
        return "\n".join(lines) + "\n"

    def _latex_groups(self) -> list[str]:
        names = []
        rules = ""
        column = 1
        for name, span in self.groups:
            text = _escape_latex(name)
            names.append(rf"\multicolumn{{{span}}}{{c}}{{{text}}}")
            if name:
                rules += rf"\cmidrule(lr){{{column}-{column + span - 1}}}"
            column += span
        return [_latex_row(names), rules]

    def _full_names(self) -> list[str]:
        """Returns the names of the columns, each after its group's name."""
        groups = [name for name, span in self.groups for _ in range(span)]
        return [
            f"{group} {name}".strip()
            for group, name in zip(
                groups or [""] * len(self.header), self.header, strict=True
            )
        ]


def _checked(name: str, value: object) -> object:
    """Returns a cell after a check that it is in the range of its metric.

    Args:
        name: heading that names the metric.
        value: the cell.
    """
    if isinstance(value, Cell):
        if value.value is None:
            return value
        return replace(value, value=checked(name, value.value))
    # Text and truth values have no range.
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return checked(name, value)


def keyed(
    keys: Mapping[str | tuple[str, str], _Key],
    value: Callable[[_Item, _Key], object],
) -> Columns[_Item]:
    """Returns similar columns for `Table.of`, such as one for each method.

    All cells come from one function. Each column passes its own key to this
    function.

    Args:
        keys: name of a column -> its key, such as the name of a method.
        value: function that returns a cell, given the item of the row and the
            key of the column.
    """

    def column(key: _Key) -> Callable[[_Item], object]:
        return lambda item: value(item, key)

    return {name: column(key) for name, key in keys.items()}


def protocol_columns(path: str) -> Columns[Any]:
    """Returns table columns with the protocol of each item, for `Table.of`.

    There is a column for each option of the protocol; the last column contains
    the name of the protocol.

    Args:
        path: the attribute in which an item holds its result, followed by a
            dot, such as `result.`; "" if an item is a result.
    """
    columns = keyed(
        {name: name for name in PROTOCOL_COLUMNS},
        lambda item, name: attrgetter(f"{path}protocol.{name}")(item),
    )
    return {**columns, "protocol": attrgetter(f"{path}protocol_name")}


def _rows(values: Sequence[object]) -> list[tuple[object, ...]]:
    """Returns rows made of values; a single value is repeated in each row."""
    lists = [v.tolist() if isinstance(v, np.ndarray) else v for v in values]
    number = max((len(v) for v in lists if isinstance(v, list)), default=1)
    columns = [v if isinstance(v, list) else [v] * number for v in lists]
    return list(zip(*columns, strict=True))


def ranked(
    values: Sequence[float | None], printed: Sequence[float | None]
) -> list[Cell]:
    """Returns the cells of a row; the two best numbers have ranks 1 and 2.

    Greater numbers are better. Only our numbers are ranked, not the paper's
    numbers. Numbers that are equal to four decimals share a rank. A number that
    is alone in its row has no rank.

    Args:
        values: our numbers; None or NaN where one is missing.
        printed: the paper's numbers, in the same order.
    """
    shown = [
        None if v is None or math.isnan(v) else round(v, 4) for v in values
    ]
    order = sorted({v for v in shown if v is not None}, reverse=True)
    # A single number has no rank.
    places = {value: rank for rank, value in enumerate(order[:2], start=1)}
    if sum(v is not None for v in shown) < 2:
        places = {}
    return [
        Cell(value, other, None if rounded is None else places.get(rounded))
        for value, other, rounded in zip(values, printed, shown, strict=True)
    ]


def title(label: str) -> str:
    """Returns the name of a method as its authors write it, with its settings.

    Args:
        label: name of the method as on the command line and, after a comma, its
            settings, if any.
    """
    method, comma, settings = label.partition(",")
    return f"{_METHOD_TITLES.get(method, method)}{comma}{settings}"


def in_table_order(methods: Iterable[str]) -> list[str]:
    """Returns methods in the order of tables.

    Methods without a place in this order follow, sorted by name.
    """
    known = list(_METHOD_TITLES)
    return sorted(
        set(methods),
        key=lambda m: (known.index(m) if m in known else len(known), m),
    )


def by_pair(items: Iterable[Any]) -> dict[Any, list[Any]]:
    """Returns the items of each pair of drives, by pair.

    Each item has an attribute `pair`.
    """
    groups: dict[Any, list[Any]] = {}
    for item in items:
        groups.setdefault(item.pair, []).append(item)
    return groups


def by_pair_and_method(items: Sequence[Any]) -> list[Any]:
    """Returns items sorted by pair of drives, and then by method.

    Pairs keep their order; methods are in the order of tables. Each item has
    the attributes `pair` and `method`.
    """
    pairs = list(dict.fromkeys(item.pair for item in items))
    methods = in_table_order(item.method for item in items)
    return sorted(
        items,
        key=lambda item: (pairs.index(item.pair), methods.index(item.method)),
    )


def p_value_text(value: float) -> str:
    """Returns a p-value with four decimals; "< 0.0001" if it has none.

    NaN becomes a dash.
    """
    return "< 0.0001" if value < 0.5e-4 else to_text(float(value))


def to_text(value: object) -> str:
    """Returns a value as the text that tables show."""
    if _is_missing(value):
        return MISSING
    if isinstance(value, bool):
        return str(int(value))
    return f"{value:.4f}" if isinstance(value, float) else str(value)


def escape_markdown(text: str) -> str:
    """Returns text that Markdown shows unchanged."""
    named = re.sub(r"&(?=#?\w+;)", "&amp;", text)
    # Markdown shows an underscore within a word as an underscore.
    return re.sub(r"(?<=\w)\\_(?=\w)", "_", named.translate(_MARKDOWN))


def _escape_latex(text: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in text)


class _Form(NamedTuple):
    """How a markup language writes the values of a table.

    `marks` are the formats of the best and the second best value in a row.
    `printed` is the format of our value followed by the paper's value.
    """

    escape: Callable[[str], str]
    marks: tuple[str, str]
    printed: str

    def cell(self, value: object) -> str:
        if not isinstance(value, Cell):
            return self.escape(to_text(value))
        text = self.escape(to_text(value.value))
        if value.rank is not None:
            text = self.marks[value.rank - 1].format(text)
        if _is_missing(value.printed):
            return text
        return self.printed.format(text, value.printed)


_MARKDOWN_FORM = _Form(escape_markdown, ("**{}**", "<u>{}</u>"), "{} ({:.4f})")
_HTML_FORM = _Form(
    html.escape, ("<b>{}</b>", "<u>{}</u>"), "{}<small>{:.4f}</small>"
)
_LATEX_FORM = _Form(
    _escape_latex,
    (r"\textbf{{{}}}", r"\underline{{{}}}"),
    r"\shortstack{{{}\\{{\scriptsize {:.4f}}}}}",
)


def _latex_row(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _is_text(value: object) -> bool:
    """Returns whether a cell contains words, and not a number as text."""
    return isinstance(value, str) and not _NUMBER.fullmatch(value)


def _is_missing(value: object) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))
