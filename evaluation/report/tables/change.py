"""Table of the change between the drives of each pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.place_numbers import kept_share
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.tables.columns import Evidence
from evaluation.results.table_forms import CAPTIONS, Table


def change_table(
    results: Sequence[ChangeResult],
    reference: Reference = NO_REFERENCE,
    evidence: Evidence = MappingProxyType({}),
) -> Table:
    """Returns Table I of a report: the change between the drives of each pair.

    Args:
        results: change of each pair.
        reference: published results to put next to them.
        evidence: (database, query) -> evidence from scans, for the column with
            the visible change.
    """

    def visible(one: ChangeResult) -> tuple[float | None, ...]:
        return visible_change(evidence, one.report.source, one.report.target)

    table = Table.of(
        results,
        {
            "map": lambda r: r.map_name,
            "stages": lambda r: " ↔ ".join(r.stages),
            "TCR_sym": lambda r: r.report.change.symmetric,
            "paper": lambda r: reference.change(r.map_name, r.stages),
            "earlier → later": lambda r: r.report.change.source_to_target.ratio,
            "later → earlier": lambda r: r.report.change.target_to_source.ratio,
            "same stage, both routes": lambda r: (
                r.report.control.symmetric if r.report.control else None
            ),
            "where both drove": lambda r: (
                r.report.masked.symmetric if r.report.masked else None
            ),
            "voxels in hulls": lambda r: r.report.change.num_in_hull,
            "unchanged": lambda r: r.report.change.num_unchanged,
            "visible change": lambda r: visible(r)[0],
            "minus the control's": lambda r: visible(r)[2],
            "share left": lambda r: visible(r)[3],
            "queries": lambda r: visible(r)[1],
            "least of the grids": lambda r: r.report.spread[0],
            "greatest": lambda r: r.report.spread[1],
        },
        CAPTIONS["change"],
    )
    names = {result.map_name for result in results}
    further = tuple(
        (label, stages, None, value, *(None,) * (len(table.header) - 4))
        for label, stages, value in reference.further_changes(names)
    )
    return replace(table, rows=table.rows + further)


def visible_change(
    evidence: Evidence, database: str, query: str
) -> tuple[float | None, ...]:
    """Returns four values on a pair's visible change; None if unknown.

    The values are: the mean visible change (share of a query's scan that its
    right place does not show); the number of queries; the mean minus the mean
    in the control; and this difference as a share of the pair's mean.
    """
    known = evidence.get((database, query))
    if known is None:
        return (None,) * 4
    whole, queries = known.mean_visible_change
    added = known.visible_change_added
    return whole, queries, added, float(kept_share(added, whole))
