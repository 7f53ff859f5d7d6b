"""The tables of reasons for wrong best places."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from evaluation.recognition.fault_kinds import (
    FAULT_KINDS,
    PairEvidence,
    fault_kinds,
)
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import PROTOCOL_COLUMNS, protocol_values
from evaluation.report.method_titles import title
from evaluation.report.result_tables import by_pair_and_method
from evaluation.report.tables import Table

FAULT_CAPTION = (
    "Why best places are wrong: of all queries with a wrong best place, how"
    " many have none in the database (no place); got no candidate; were put"
    " just too far away, within two radii; have a right place from which less"
    " than half of their scan is seen, since something hides it (hidden) or"
    " for another reason (no overlap); have a right place of whose standing"
    " points a quarter or more has come or gone (changed, and the class of"
    " most of it); were taken to a twin, which fits on them as well as the"
    " right place does. Elsewhere is the method's own fault. Each counts"
    " once, under the first of these."
)
# Evidence of pairs of drives.
Evidence = Mapping[tuple[str, str], PairEvidence]


def fault_table(
    results: Sequence[RecognitionResult], evidence: Evidence
) -> Table:
    """Returns the table for print: a row for each pair and method.

    Args:
        results: of all pairs and methods.
        evidence: (database, query) -> evidence; a pair without it has no row.
    """
    rows = []
    for result, kinds, changed in _counted(results, evidence):
        wrong = kinds.total()
        shares = [
            f"{100.0 * kinds[kind] / wrong:.0f} %" if kinds[kind] else None
            for kind in FAULT_KINDS
        ]
        names = ", ".join(f"{n} {name}" for name, n in changed.most_common())
        rows.append(
            (
                result.map_name,
                " → ".join(result.stages),
                title(result.method),
                wrong,
                *shares,
                names or None,
            )
        )
    header = ("map", "DB → query", "method", "wrong")
    words = (kind.replace("_", " ") for kind in FAULT_KINDS)
    return Table(
        (*header, *words, "changed by"), tuple(rows), caption=FAULT_CAPTION
    )


def fault_numbers(
    results: Sequence[RecognitionResult], evidence: Evidence
) -> Table:
    """Returns all counts, as `why.csv` has them."""
    rows = [
        (
            *result.pair,
            result.method,
            len(result.outcome.outcomes),
            kinds.total(),
            *(kinds[kind] for kind in FAULT_KINDS),
            " ".join(f"{name}:{n}" for name, n in changed.most_common())
            or None,
            *protocol_values(result.outcome.protocol),
        )
        for result, kinds, changed in _counted(results, evidence)
    ]
    header = ("map", "db", "query", "method", "queries", "wrong")
    return Table(
        (*header, *FAULT_KINDS, "changed_by", *PROTOCOL_COLUMNS), tuple(rows)
    )


def _counted(
    results: Sequence[RecognitionResult], evidence: Evidence
) -> Iterator[tuple[RecognitionResult, Counter[str], Counter[str]]]:
    """Yields results with their faults, and the classes that changed."""
    for result in by_pair_and_method(results):
        known = evidence.get((result.outcome.database, result.outcome.query))
        if known is None:
            continue
        kinds = fault_kinds(result, known)
        yield (
            result,
            Counter(kind for kind in kinds if kind),
            Counter(
                name
                for kind, name in zip(kinds, known.changed_classes, strict=True)
                if kind == "changed"
            ),
        )
