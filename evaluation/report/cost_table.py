"""The table of the costs of methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, fields

from evaluation.recognition.costs import Cost
from evaluation.report.method_titles import in_table_order, title
from evaluation.report.tables import Table

COST_CAPTION = (
    "What each method costs on one core of the machine that made this report:"
    " time of the processor, medians over some scans. This table alone"
    " differs from run to run (--no-costs leaves it out)."
)


def cost_table(costs: Sequence[Cost]) -> Table:
    """Returns the table for print, a row for each method."""
    by_method = {cost.method: cost for cost in costs}
    rows = []
    for method in in_table_order(by_method):
        cost = by_method[method]
        rows.append(
            (
                title(method),
                cost.scans_per_place,
                f"{cost.points:.0f}",
                f"{cost.describe_ms:.1f}",
                f"{cost.query_ms:.1f}",
                cost.places,
                f"{cost.place_bytes:.0f}",
            )
        )
    return Table(
        (
            "method",
            "scans a place",
            "points",
            "describe [ms]",
            "query [ms]",
            "of places",
            "bytes a place",
        ),
        tuple(rows),
        caption=COST_CAPTION,
    )


def cost_numbers(costs: Sequence[Cost]) -> Table:
    """Returns all numbers, as `costs.csv` has them."""
    header = tuple(field.name for field in fields(Cost))
    return Table(header, tuple(astuple(cost) for cost in costs))
