"""The findings of a ladder in words: the causes that cost a method most."""

from __future__ import annotations

from collections.abc import Sequence
import math

from evaluation.report.ladder_rows import LadderRow
from evaluation.report.method_titles import in_table_order, title

# A kept share of AUC from this one on counts as a small loss.
_MUCH = 0.95
# Least difference of the kept shares with and without the gate that is named.
_DIFFERENT = 0.1
# Rungs with more than one cause.
_NONE, _ALL = "none", "all"


def ladder_text(rows: Sequence[LadderRow]) -> str:
    """Returns a paragraph for each map.

    Args:
        rows: of all maps.
    """
    maps = dict.fromkeys(row.rung.map_name for row in rows)
    return "\n\n".join(
        _paragraph([row for row in rows if row.rung.map_name == name])
        for name in maps
    )


def _paragraph(rows: Sequence[LadderRow]) -> str:
    first = rows[0].rung
    parts = [
        f"{first.map_name.capitalize()}, {rows[0].queries} queries of drive"
        f" {first.query}: what each cause of change, at its strongest level,"
        " leaves of the AUC without a change (95 % intervals)."
    ]
    ungated, gated = (
        _strongest([row for row in rows if row.is_gated == is_gated])
        for is_gated in (False, True)
    )
    sentences = [
        _sentence([row for row in ungated if row.method == method])
        for method in in_table_order(row.method for row in ungated)
    ]
    if any(sentences):
        parts.append(f"Without the gate: {'; '.join(filter(None, sentences))}.")
        parts.append(_mildest(ungated))
        parts.append(_difference(ungated, gated))
    return " ".join(filter(None, parts))


def _sentence(rows: Sequence[LadderRow]) -> str:
    """Returns the losses of one method; "" if its AUC without a change is 0."""
    known = {
        row.rung.cause: row for row in rows if not math.isnan(row.kept.share)
    }
    together = known.pop(_ALL, None)
    known.pop(_NONE, None)
    parts = []
    if known:
        worst = min(known.values(), key=lambda row: row.kept.share)
        parts.append(
            f"keeps {_kept(worst)} whatever the cause"
            if worst.kept.share >= _MUCH
            else f"loses most by {_cause(worst)} ({worst.rung.strength}), which"
            f" leaves {_kept(worst)}"
        )
    if together is not None:
        parts.append(f"keeps {_kept(together)} under all causes together")
    return f"{title(rows[0].method)} {', and '.join(parts)}" if parts else ""


def _mildest(rows: Sequence[LadderRow]) -> str:
    """Returns the causes that cost no method much."""
    shares: dict[str, list[float]] = {}
    for row in rows:
        is_single = row.rung.cause not in (_NONE, _ALL)
        if is_single and not math.isnan(row.kept.share):
            shares.setdefault(_cause(row), []).append(row.kept.share)
    least = {cause: min(values) for cause, values in shares.items()}
    mild = [cause for cause, share in least.items() if share >= _MUCH]
    much = f"{100.0 * _MUCH:.0f} % or more"
    if not shares:
        return ""
    if not mild:
        return f"No cause leaves {much} to every method."
    return f"To every method {much} are left by {', '.join(mild)}."


def _difference(
    ungated: Sequence[LadderRow], gated: Sequence[LadderRow]
) -> str:
    """Returns the sentence on causes whose cost depends on the gate."""
    before = {(row.rung.cause, row.method): row for row in ungated}
    changed = [
        f"{title(row.method)} under {_cause(row)} keeps"
        f" {_percent(row.kept.share)} instead of {_percent(other.kept.share)}"
        for row in gated
        if (other := before.get((row.rung.cause, row.method))) is not None
        and abs(row.kept.share - other.kept.share) >= _DIFFERENT
    ]
    much = f"{100.0 * _DIFFERENT:.0f} points"
    if not changed:
        return f"The gate changes nothing by {much} or more."
    return (
        f"With the gate, {'; '.join(changed)}; all else changes by less than"
        f" {much}."
    )


def _strongest(rows: Sequence[LadderRow]) -> list[LadderRow]:
    """Returns the row of the strongest level of each cause and method."""
    found: dict[tuple[str, str], LadderRow] = {}
    for row in rows:
        key = row.rung.cause, row.method
        if key not in found or found[key].rung.level < row.rung.level:
            found[key] = row
    return list(found.values())


def _cause(row: LadderRow) -> str:
    return row.rung.cause.replace("_", " ")


def _kept(row: LadderRow) -> str:
    low, high = row.kept.interval.low, row.kept.interval.high
    text = _percent(row.kept.share)
    if math.isnan(low):
        return text
    return f"{text} ({100.0 * low:.0f} to {100.0 * high:.0f})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
