"""The conditions that all tables have, and why others are left out."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from cns_drake.base import InputError
from evaluation.results.keys import KEYS, LAST, STAGE
from evaluation.results.metric_tables import SHIPPED, Condition, MetricTable
from evaluation.results.table import Row


def common_conditions(
    own: Sequence[MetricTable],
    shipped: MetricTable,
    paths: Sequence[Path],
) -> tuple[list[Condition], list[str]]:
    """Returns the conditions that all tables have, and notes for the user.

    If the shipped table has none of the conditions that two or more tables of
    the user have in common, only the user's tables count.

    Args:
        own: the user's tables.
        shipped: the shipped table.
        paths: paths of the user's tables, for errors.

    Raises:
        InputError: the tables have no condition in common.
    """
    common = own[0].conditions
    for table in own[1:]:
        common = [
            condition
            for condition in common
            if condition in set(table.conditions)
        ]
    with_shipped = [
        condition
        for condition in common
        if condition in set(shipped.conditions)
    ]
    if with_shipped:
        others = (*own, shipped)
        return with_shipped, _notes_on_left_out(own, others, with_shipped)
    if len(own) > 1 and common:
        notes = _notes_on_left_out(own, own, common)
        return common, [
            *notes,
            "the shipped tables have none of these conditions",
        ]
    names = ", ".join(map(str, paths))
    others = (*own[1:], *([] if own[1:] else [shipped]))
    beside = "" if len(own) > 1 else " with the shipped tables"
    why = _why_nothing_is_common(own[0], others[0])
    raise InputError(f"{names}: no condition in common{beside} ({why})")


def _notes_on_left_out(
    own: Sequence[MetricTable],
    tables: Sequence[MetricTable],
    common: Iterable[Condition],
) -> list[str]:
    """Returns notes on the conditions that only some of the tables have."""
    kept = set(common)
    notes: Counter[str] = Counter()
    for table in own:
        left = {c: r for (_, c), r in table.rows.items() if c not in kept}
        for condition, row in left.items():
            other = next(
                lacking
                for lacking in tables
                if lacking is not table
                and condition not in set(lacking.conditions)
            )
            wanted = row.without("method", "protocol")
            alike = [
                candidate
                for candidate in other.rows.values()
                if candidate.without("method", "protocol") == wanted
            ]
            name = "the shipped tables" if other.name == SHIPPED else other.name
            lack = "lack" if other.name == SHIPPED else "lacks"
            why = f"as {name} {lack} them"
            if alike:
                why = (
                    f"by protocol {_protocol_text(row)}, not"
                    f" {_protocol_text(alike[0])} in {name}"
                )
            notes[f"{table.name}: left out, {why}"] += 1
    return [f"{why}: {count} conditions" for why, count in notes.items()]


def _protocol_text(row: Row) -> str:
    return f"{row.protocol} ({row.protocol_digest or 'unknown'})"


def without_controls(
    conditions: list[Condition],
) -> tuple[list[Condition], list[str]]:
    """Returns the conditions with a change, and a note on the others.

    If no condition has a change, the result contains all conditions.
    """
    changed = [
        condition for condition in conditions if (STAGE, LAST) not in condition
    ]
    left = len(conditions) - len(changed)
    if not left or not changed:
        return conditions, []
    return changed, [
        f"left out, as nothing changes in them ({STAGE} {LAST}): {left}"
        " conditions"
    ]


def _why_nothing_is_common(table: MetricTable, other: MetricTable) -> str:
    """Returns as text why two tables have no condition in common."""
    rows = [list(compared.rows.values()) for compared in (table, other)]
    factors = {
        name: None
        for of_table in rows
        for row in of_table
        for name in row.factors
    }
    for column in (*(name for name in KEYS if name != "version"), *factors):
        first, second = (
            sorted({str(row[column]) for row in of_table}) for of_table in rows
        )
        if column != "method" and not {*first} & {*second}:
            return (
                f"{column}: {', '.join(first[:3])} in {table.name}, but"
                f" {', '.join(second[:3])} in {other.name}"
            )
    return "each value is in both, but no row has the same ones in all columns"


def reduced_to(table: MetricTable, common: Iterable[Condition]) -> MetricTable:
    """Returns a table reduced to some of its conditions."""
    kept = set(common)
    rows = {key: row for key, row in table.rows.items() if key[1] in kept}
    return replace(table, rows=rows)
