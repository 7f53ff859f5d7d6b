"""Table of the change between the drives of each pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.place_metrics import kept_share
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

    def visible(result: ChangeResult) -> VisibleChange:
        report = result.report
        return visible_change(evidence, report.source, report.target)

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
            "visible change": lambda r: visible(r).share,
            "minus the control's": lambda r: visible(r).added,
            "share left": lambda r: visible(r).added_share,
            "queries": lambda r: visible(r).queries,
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


class VisibleChange(NamedTuple):
    """Visible change between the drives of a pair; None where it is unknown.

    Attributes:
        share: mean share of a query's scan that its right place does not show.
        queries: number of queries.
        added: `share` minus the mean in the control.
        added_share: `added` as a share of `share`.
    """

    share: float | None = None
    queries: int | None = None
    added: float | None = None
    added_share: float | None = None


def visible_change(
    evidence: Evidence, database: str, query: str
) -> VisibleChange:
    """Returns the visible change of a pair of drives."""
    known = evidence.get((database, query))
    if known is None:
        return VisibleChange()
    share, queries = known.mean_visible_change
    added = known.visible_change_added
    return VisibleChange(share, queries, added, float(kept_share(added, share)))
