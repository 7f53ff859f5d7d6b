"""Columns that several tables of a report share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evaluation.recognition.fault_names import PairEvidence
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.results.table_forms import (
    Columns,
    keyed,
    protocol_columns,
    title,
)

# Evidence for pairs of drives: (database, query) -> evidence.
Evidence = Mapping[tuple[str, str], PairEvidence]


def of_result(columns: Columns[PlaceOutcome]) -> Columns[Any]:
    """Returns columns of results, applied to the field `result` of items."""
    return keyed(columns, lambda item, value: value(item.result))


# The first columns of tables for print.
PRINTED_KEYS: Columns[PlaceOutcome] = {
    "map": lambda r: r.pair[0],
    "DB → query": lambda r: " → ".join(r.pair[1:]),
    "method": lambda r: title(r.method),
}
# The first columns of files.
KEYS: Columns[PlaceOutcome] = {
    "map": lambda r: r.pair[0],
    "db": lambda r: r.pair[1],
    "query": lambda r: r.pair[2],
    "method": lambda r: r.method,
}
# The last columns of files.
PROTOCOL = protocol_columns("")
