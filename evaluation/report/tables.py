"""Tables of numbers, written as Markdown, LaTeX, HTML and CSV."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import csv
from dataclasses import dataclass, replace
import html
import io
import math
import re

MISSING = "–"

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
# Characters that turn text into a table, a link, a picture or a tag.
_MARKDOWN = {ord(c): f"\\{c}" for c in "\\`*_[]|"} | {
    ord("<"): "&lt;",
    ord(">"): "&gt;",
}


@dataclass(frozen=True)
class Cell:
    """A number that is ranked in its row, with the paper's number beside it.

    Attributes:
        value: our number; None or NaN if there is none.
        printed: the paper's number; None if there is none.
        rank: 1 for the best of its row, 2 for the second, None for others.
    """

    value: float | None
    printed: float | None = None
    rank: int | None = None


@dataclass(frozen=True)
class Table:
    """Rows under a header; numbers stay numbers until they are written.

    Attributes:
        header: name of each column.
        rows: one value for each column: text, a number, a `Cell`, or None for
            an empty one.
        groups: names over columns, each with the number of columns that it
            spans; empty names are left out. Groups span all columns, or there
            are none.
        caption: what the table shows.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    caption: str = ""

    def without_empty(self, name: str) -> Table:
        """Returns the table without a column that has no value in any row.

        Args:
            name: of the column; the table has no groups.
        """
        column = self.header.index(name)
        if not all(_is_missing(row[column]) for row in self.rows):
            return self
        return replace(
            self,
            header=self.header[:column] + self.header[column + 1 :],
            rows=tuple(r[:column] + r[column + 1 :] for r in self.rows),
        )

    def to_csv(self) -> str:
        """Returns the table with all digits; a missing value is empty.

        A cell becomes two columns; the second holds the paper's number.
        """
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        columns = list(zip(*self.rows, strict=True)) or [()] * len(self.header)
        expanded = []
        for name, group, column in zip(
            self.header, self._group_of_each(), columns, strict=True
        ):
            full = f"{group} {name}".strip()
            if any(isinstance(value, Cell) for value in column):
                expanded.append([full, *(value.value for value in column)])
                expanded.append(
                    [f"paper's {full}", *(value.printed for value in column)]
                )
            else:
                expanded.append([full, *column])
        for row in zip(*expanded, strict=True):
            writer.writerow(["" if _is_missing(v) else v for v in row])
        return stream.getvalue()

    def to_markdown(self) -> str:
        """Returns the table with four decimals, as the paper prints them.

        The paper's values follow in brackets.
        """
        header = [
            escape_markdown(f"{group} {name}".strip())
            for group, name in zip(
                self._group_of_each(), self.header, strict=True
            )
        ]
        lines = [header, ["---"] * len(self.header)]
        lines += [[_to_markdown(value) for value in row] for row in self.rows]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)

    def to_html(self) -> str:
        """Returns a `table` element."""
        parts = ["<table>"]
        if self.caption:
            parts.append(f"<caption>{html.escape(self.caption)}</caption>")
        parts.append("<thead>")
        if self.groups:
            cells = "".join(
                f'<th colspan="{span}" class="group">{html.escape(name)}</th>'
                for name, span in self.groups
            )
            parts.append(f"<tr>{cells}</tr>")
        names = "".join(f"<th>{html.escape(name)}</th>" for name in self.header)
        parts.append(f"<tr>{names}</tr></thead><tbody>")
        for row in self.rows:
            cells = "".join(f"<td>{_to_html(value)}</td>" for value in row)
            parts.append(f"<tr>{cells}</tr>")
        parts.append("</tbody></table>")
        return "".join(parts)

    def to_latex(self) -> str:
        r"""Returns a `table*` for a document with the package booktabs."""
        lines = [
            "% Needs \\usepackage{booktabs}; \\resizebox is of graphicx.",
            r"\begin{table*}",
            r"\centering",
        ]
        if self.caption:
            lines.append(rf"\caption{{{_escape(self.caption)}}}")
        lines += [
            r"\resizebox{\textwidth}{!}{%",
            rf"\begin{{tabular}}{{@{{}}{'c' * len(self.header)}@{{}}}}",
            r"\toprule",
        ]
        if self.groups:
            lines += self._latex_groups()
        lines.append(_latex_row(_escape(name) for name in self.header))
        lines.append(r"\midrule")
        lines += [_latex_row(map(_to_latex, row)) for row in self.rows]
        lines += [r"\bottomrule", r"\end{tabular}}", r"\end{table*}"]
        return "\n".join(lines) + "\n"

    def _latex_groups(self) -> list[str]:
        names, rules, column = [], [], 1
        for name, span in self.groups:
            names.append(rf"\multicolumn{{{span}}}{{c}}{{{_escape(name)}}}")
            if name:
                rules.append(rf"\cmidrule(lr){{{column}-{column + span - 1}}}")
            column += span
        return [_latex_row(names), "".join(rules)]

    def _group_of_each(self) -> list[str]:
        """Returns the name over each column."""
        if not self.groups:
            return [""] * len(self.header)
        return [name for name, span in self.groups for _ in range(span)]


def ranked(
    values: Sequence[float | None], printed: Sequence[float | None]
) -> list[Cell]:
    """Returns the cells of a row with the greatest two marked.

    Values that are equal as printed, with four decimals, share a rank.
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


def to_text(value: object) -> str:
    """Returns a value as tables show it."""
    if _is_missing(value):
        return MISSING
    return f"{value:.4f}" if isinstance(value, float) else str(value)


def escape_markdown(text: str) -> str:
    """Returns text that Markdown shows unchanged."""
    named = re.sub(r"&(?=#?\w+;)", "&amp;", text)
    # Markdown shows an underscore within a word as an underscore.
    return re.sub(r"(?<=\w)\\_(?=\w)", "_", named.translate(_MARKDOWN))


def _to_markdown(value: object) -> str:
    if not isinstance(value, Cell):
        return escape_markdown(to_text(value))
    text = to_text(value.value)
    if value.rank == 1:
        text = f"**{text}**"
    elif value.rank == 2:
        text = f"<u>{text}</u>"
    return text if value.printed is None else f"{text} ({value.printed:.4f})"


def _to_html(value: object) -> str:
    if not isinstance(value, Cell):
        return html.escape(to_text(value))
    text = to_text(value.value)
    tag = {1: "b", 2: "u"}.get(value.rank or 0)
    if tag:
        text = f"<{tag}>{text}</{tag}>"
    if value.printed is None:
        return text
    return f"{text}<small>{value.printed:.4f}</small>"


def _to_latex(value: object) -> str:
    if not isinstance(value, Cell):
        return _escape(to_text(value))
    text = _escape(to_text(value.value))
    if value.rank == 1:
        text = rf"\textbf{{{text}}}"
    elif value.rank == 2:
        text = rf"\underline{{{text}}}"
    if value.printed is None:
        return text
    return rf"\shortstack{{{text}\\{{\scriptsize {value.printed:.4f}}}}}"


def _latex_row(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _escape(text: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in text)


def _is_missing(value: object) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))
