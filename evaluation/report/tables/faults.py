"""Tables of the reasons why top-ranked places are wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from evaluation.recognition.fault_names import (
    ELSEWHERE_KINDS,
    FAULT_KINDS,
    fault_kinds,
    fault_words,
)
from evaluation.recognition.faults import ELSEWHERE
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.tables.columns import (
    KEYS,
    PRINTED_KEYS,
    Evidence,
    of_result,
)
from evaluation.results.table_forms import (
    CAPTIONS,
    Table,
    by_pair_and_method,
    keyed,
    protocol_columns,
)


class _FaultCounts(NamedTuple):
    """Why top-ranked places are wrong: reasons, and changed classes."""

    result: PlaceOutcome
    kinds: Counter[str]
    changed: Counter[str]

    @property
    def wrong(self) -> int:
        """Number of wrong top-ranked places of queries that have a match."""
        return self.kinds.total() - self.kinds["no_place"]

    @property
    def elsewhere(self) -> int:
        """Number of all kinds of the reason `elsewhere`, as in tables."""
        return sum(self.kinds[kind] for kind in ELSEWHERE_KINDS)


def fault_table(results: Sequence[PlaceOutcome], evidence: Evidence) -> Table:
    """Returns a table, for print, on why top-ranked places are wrong."""

    def share(one: _FaultCounts, kind: str) -> str | None:
        part = one.kinds[kind] / max(one.wrong, 1)
        return f"{100.0 * part:.0f} %" if part else None

    return Table.of(
        _fault_counts(results, evidence),
        {
            **of_result(PRINTED_KEYS),
            "wrong": lambda count: count.wrong,
            **keyed({fault_words(k): k for k in FAULT_KINDS[1:]}, share),
            "changed by": lambda count: (
                ", ".join(
                    f"{name} ({n})" for name, n in count.changed.most_common()
                )
                or None
            ),
        },
        CAPTIONS["faults"],
    )


def fault_numbers(results: Sequence[PlaceOutcome], evidence: Evidence) -> Table:
    """Returns the table `why.csv`: why top-ranked places were wrong.

    For each method on each pair of drives, the table counts the queries with a
    wrong top-ranked place, by reason.
    """
    return Table.of(
        _fault_counts(results, evidence),
        {
            **of_result(KEYS),
            "queries": lambda count: len(count.result.outcomes),
            "wrong": lambda count: count.wrong,
            **keyed(
                {kind: kind for kind in FAULT_KINDS},
                lambda count, kind: count.kinds[kind],
            ),
            ELSEWHERE: lambda count: count.elsewhere,
            "changed_by": lambda count: (
                " ".join(
                    f"{name}:{n}" for name, n in count.changed.most_common()
                )
                or None
            ),
            **protocol_columns("result."),
        },
    )


def _fault_counts(
    results: Sequence[PlaceOutcome], evidence: Evidence
) -> Iterator[_FaultCounts]:
    for result in by_pair_and_method(results):
        known = evidence.get((result.database, result.query))
        if known is None:
            continue
        kinds = fault_kinds(result, known)
        yield _FaultCounts(
            result,
            Counter(filter(None, kinds)),
            Counter(
                name
                for kind, name in zip(kinds, known.changed_classes, strict=True)
                if kind == "changed"
            ),
        )
