"""Tables of the AUC differences between methods on each pair of drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.significance import Difference, compared_by_auc
from evaluation.report.tables.columns import KEYS, PRINTED_KEYS, of_result
from evaluation.results.table_forms import (
    CAPTIONS,
    Table,
    by_pair,
    by_pair_and_method,
    p_value_text,
    title,
)


class MethodDifference(NamedTuple):
    """The AUC of a method minus the AUC of another, on a pair of drives.

    Attributes:
        result: result of the first method.
        other: result of the second method.
        difference: the difference.
        p_value: p-value of the difference, corrected for the number of
            differences on this pair of drives; NaN if unknown.
    """

    result: PlaceOutcome
    other: PlaceOutcome
    difference: Difference
    p_value: float


def method_differences(
    results: Sequence[PlaceOutcome],
) -> list[MethodDifference]:
    """Returns the AUC difference of any two methods on each pair of drives.

    All queries count (mode `all`).
    """
    found: list[MethodDifference] = []
    for outcomes in by_pair(by_pair_and_method(results)).values():
        compared = compared_by_auc(
            {k: [outcome.outcomes] for k, outcome in enumerate(outcomes)}
        )
        found += [
            MethodDifference(outcomes[a], outcomes[b], difference, p)
            for (a, b), (difference, p) in compared.items()
        ]
    return found


def difference_numbers(differences: Sequence[MethodDifference]) -> Table:
    """Returns the AUC differences between methods, for `differences.csv`."""
    return Table.of(
        differences,
        {
            **of_result({n: KEYS[n] for n in ("map", "db", "query")}),
            "gate": lambda d: d.result.protocol.gate,
            "method_a": lambda d: d.result.method,
            "method_b": lambda d: d.other.method,
            "difference": lambda d: d.difference.value,
            "low": lambda d: d.difference.interval.low,
            "high": lambda d: d.difference.interval.high,
            "p": lambda d: d.p_value,
            "protocol": lambda d: d.result.protocol_name,
        },
    )


def difference_table(differences: Sequence[MethodDifference]) -> Table:
    """Returns the AUC differences between methods, for print."""
    names = "map", "DB → query"
    return Table.of(
        differences,
        {
            **of_result({name: PRINTED_KEYS[name] for name in names}),
            "method A": lambda d: title(d.result.method),
            "method B": lambda d: title(d.other.method),
            "A - B": lambda d: d.difference.value,
            "low": lambda d: d.difference.interval.low,
            "high": lambda d: d.difference.interval.high,
            "p": lambda d: p_value_text(d.p_value),
        },
        CAPTIONS["differences"],
    )
