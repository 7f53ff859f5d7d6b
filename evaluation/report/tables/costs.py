"""Tables of the time and memory that each method takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from operator import attrgetter

from evaluation.recognition.costs import Cost
from evaluation.results.table_forms import (
    CAPTIONS,
    Table,
    in_table_order,
    title,
)


def cost_table(costs: Sequence[Cost]) -> Table:
    """Returns the table of the methods' costs, with a row for each method."""
    by_method = {cost.method: cost for cost in costs}
    return Table.of(
        map(by_method.__getitem__, in_table_order(by_method)),
        {
            "method": lambda c: title(c.method),
            "scans a place": lambda c: c.scans_per_place,
            "points": lambda c: f"{c.points:.0f}",
            "describe [ms]": lambda c: f"{c.describe_ms:.1f}",
            "query [ms]": lambda c: f"{c.query_ms:.1f}",
            "of places": lambda c: c.places,
            "bytes a place": lambda c: f"{c.place_bytes:.0f}",
        },
        CAPTIONS["costs"],
    )


def cost_numbers(costs: Sequence[Cost]) -> Table:
    """Returns `costs.csv`: the fields of `Cost`, a row for each method."""
    return Table.of(costs, {f.name: attrgetter(f.name) for f in fields(Cost)})
