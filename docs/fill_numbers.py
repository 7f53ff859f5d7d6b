"""Fills the numbers and tables of the documents from CSV files.

    python docs/fill_numbers.py

A comment names a file of `docs/notes` (or, with a slash, of the repository) and
the rows that count, and lists numbers; in the text, a mark follows each:

    <!-- numbers of ladder.csv map=suburbia metric=relative_auc verified=0
    fog {value cause=weather method=layered-overlap:.0%}
    -->
    Fog leaves layered overlap 86<!--fog--> % of its AUC.

Braces contain a query and a format, whose `%` only multiplies by 100. A query
is a column, after `min`, `max`, `mean`, `median` or `count` if several rows
count, and further conditions (`a=1|2`, `a!=1`). `min mean COLUMN by map` is the
least of the means of all maps. Without a format, it is the text of the cell.

A table follows the comment that describes it in YAML. Its lines are the
combinations of the values of `rows`; its columns have the heads and templates
of `cells`, or are the values of `columns` with the template `cell`. An axis
names a column of the file, and may choose and rename its values:

    <!-- table of what_changes.csv metric=relative_auc_strict
    rows: {cause: {missing: fronts, both: fronts and furniture}, verified: }
    columns: {method: [ring++, btc]}
    cell: '{mean value:.2f} ({min value:.2f}–{max value:.2f})'
    -->
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import csv
import functools
import itertools
from pathlib import Path
import re
import shlex
import statistics
import sys
from typing import Any, TypeAlias

import yaml

ROOT = Path(__file__).resolve().parents[1]
# As a program, this file is not in the package `docs`.
sys.path.insert(0, str(ROOT))

from evaluation.results import in_table_order, title  # noqa: E402

Rows: TypeAlias = Sequence[Mapping[str, str]]
_STATISTICS = {
    "min": min,
    "max": max,
    "mean": statistics.fmean,
    "median": statistics.median,
    "count": len,
}
_NUMBERS = re.compile(r"<!-- numbers of (.+)\n((?:.+\n)+?)-->")
_NUMBER = re.compile(r"(?:(?<![\w.-])[+-]?\d[\d.,]*)?<!--([a-z0-9-]+)-->")
_QUERY = re.compile(r"{([^{}]+)}")
_UNKNOWN = "–"
_TABLE = re.compile(r"(<!-- table of (.+)\n((?:.+\n)+?)-->\n\n)((?:\|.*\n)*)")


def csv_rows(name: str) -> Rows:
    """Returns the rows of a file of `docs/notes`, or of the repository."""
    return _read(ROOT / (name if "/" in name else f"docs/notes/{name}"))


@functools.cache
def _read(path: Path) -> Rows:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def filled(text: str) -> str:
    """Returns the text of a page with its numbers and tables.

    Raises:
        ValueError: a mark has no number, or a number no mark; or a query finds
            no value, or several different ones without a statistic.
    """
    found: dict[str, str] = {}
    for source, lines in _NUMBERS.findall(text):
        for line in lines.splitlines():
            name, template = line.split(" ", 1)
            if name in found:
                raise ValueError(f"{name}: is there twice")
            found[name] = _fill(template, _selected(source))
            if found[name] == _UNKNOWN:
                raise ValueError(f"{name}: no row has a value")
    marked = set(_NUMBER.findall(text))
    if marked != found.keys():
        raise ValueError(f"{marked ^ found.keys()}: mark without its number")
    text = _NUMBER.sub(lambda mark: f"{found[mark[1]]}<!--{mark[1]}-->", text)
    return _TABLE.sub(lambda one: one[1] + _table(one[2], one[3]), text)


def _selected(source: str) -> Rows:
    name, *conditions = shlex.split(source)
    return _where(csv_rows(name), conditions)


def _where(rows: Rows, conditions: Iterable[str]) -> Rows:
    """Returns the rows that meet conditions, such as `a=1|2` and `a!=1`."""
    for condition in conditions:
        key, _, text = condition.partition("=")
        wanted, column = text.split("|"), key.removesuffix("!")
        is_wanted = column == key
        rows = [row for row in rows if (row[column] in wanted) == is_wanted]
    return rows


def _fill(template: str, rows: Rows) -> str:
    """Returns a template whose queries are replaced by what they find.

    If one of them finds nothing, the result is a dash.
    """
    found = []
    for query in _QUERY.findall(template):
        words, colon, form = query.rpartition(":")
        value = _query(words if colon else form, rows)
        if value is None:
            return _UNKNOWN
        if colon:
            text = f"{float(value):{form}}".removesuffix("%")
            # What rounds to 0 has no sign.
            value = re.sub(r"^-(?=[0.]+$)", "", text)
        found.append(str(value))
    return _QUERY.sub(lambda _: found.pop(0), template)


def _query(query: str, rows: Rows) -> Any:
    """Returns what a query finds; None if no row has a value."""
    words = shlex.split(query)
    conditions = [word for word in words if "=" in word]
    rows = _where(rows, conditions)
    words = [word for word in words if "=" not in word]
    if "by" in words:
        outer, *inner, _, key = words
        groups = dict.fromkeys(row[key] for row in rows)
        of_groups = (
            _query(shlex.join(inner), [row for row in rows if row[key] == one])
            for one in groups
        )
        values = [one for one in of_groups if one is not None]
        return _STATISTICS[outer](values) if values else None
    *name, column = words
    cells = [row[column] for row in rows if row[column]]
    if name == ["count"]:
        return len(cells)
    if not name and len(set(cells)) > 1:
        raise ValueError(f"{query}: {len(cells)} values, and no statistic")
    if not cells:
        return None
    return _STATISTICS[name[0]](map(float, cells)) if name else cells[0]


def _table(source: str, description: str) -> str:
    rows = _selected(source)
    asked = yaml.safe_load(description)
    lines = [_axis(rows, key, one) for key, one in asked["rows"].items()]
    heads: list[tuple[str, str, str]] = [
        (head, "", template)
        for head, template in asked.get("cells", {}).items()
    ]
    for key, one in asked.get("columns", {}).items():
        heads = [
            (head, condition, asked["cell"])
            for condition, head in _axis(rows, key, one)
        ]
    table = [[*asked["rows"], *(head for head, *_ in heads)]]
    for line in itertools.product(*lines):
        of_line = _where(rows, [condition for condition, _ in line])
        if of_line:
            cells = [
                _fill(template, _where(of_line, [condition][: bool(condition)]))
                for _, condition, template in heads
            ]
            table.append([*(name for _, name in line), *cells])
    head, *body = (f"| {' | '.join(cells)} |\n" for cells in table)
    return "".join([head, "|---" * len(table[0]) + "|\n", *body])


def _axis(rows: Rows, key: str, chosen: Any) -> list[tuple[str, str]]:
    """Returns the condition and the name of each value of an axis."""
    values = chosen or dict.fromkeys(row[key] for row in rows)
    if key == "method" and not isinstance(chosen, dict):
        if not chosen:
            values = in_table_order(values)
        values = {value: title(value) for value in values}
    if not isinstance(values, dict):
        values = {str(value): str(value) for value in values}
    return [(f"{key}={value}", name or value) for value, name in values.items()]


if __name__ == "__main__":
    for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")):
        page.write_text(filled(page.read_text("utf-8")), "utf-8")
