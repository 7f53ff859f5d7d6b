"""The section of the page that tells what change leaves of each method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import html

from evaluation.recognition.survival import Kept, Survival
from evaluation.report.method_titles import title
from evaluation.report.survival_tables import (
    NO_CONTROL,
    SURVIVAL_CAPTION,
    by_pair,
    interval_text,
    percent,
    survival_summary,
)
from evaluation.report.tables import to_text


def survival_section(survivals: Sequence[Survival], figure: str) -> str:
    """Returns the section; empty without any result.

    Args:
        survivals: of all pairs and methods.
        figure: element with the chart; empty if no pair has a control.
    """
    if not survivals:
        return ""
    auc = _table(survivals, "AUC", lambda one: one.auc)
    # A line never begins with the sign of per cent.
    summary = html.escape(survival_summary(survivals)).replace(" %", "&nbsp;%")
    recall = _table(survivals, "R@1", lambda one: one.recall_at_1)
    return (
        "<h2>Which method survives the change?</h2>"
        f"<p>{summary}</p>"
        f"<p>{html.escape(SURVIVAL_CAPTION)}</p>"
        f'<div class="survival">{figure}{auc}</div>'
        f"<details><summary>The same of R@1</summary>{recall}</details>"
    )


def _table(
    survivals: Sequence[Survival],
    metric: str,
    kept_of: Callable[[Survival], Kept],
) -> str:
    """Returns a table as narrow as a phone, with a body for each pair."""
    names = (
        *(metric, "without change", "with change", "kept"),
        "recall at full precision",
    )
    header = "".join(f'<th scope="col">{name}</th>' for name in names)
    bodies = []
    for (map_name, *stages), group in by_pair(survivals).items():
        name = html.escape(f"{map_name} {' → '.join(stages)}")
        rows = [f'<tr><th colspan="5" scope="rowgroup">{name}</th></tr>']
        rows += [_row(one, kept_of(one)) for one in group]
        bodies.append(f"<tbody>{''.join(rows)}</tbody>")
    return (
        '<div class="scrolling" tabindex="0"><table class="kept">'
        f"<thead><tr>{header}</tr></thead>{''.join(bodies)}</table></div>"
    )


def _row(one: Survival, kept: Kept) -> str:
    if one.unchanged is None:
        before, share = NO_CONTROL, to_text(None)
    else:
        before = f"{kept.unchanged:.3f}"
        share = f"<b>{percent(kept.share)}</b>"
        if interval_text(kept):
            share += f"<small>{interval_text(kept)}</small>"
    name = html.escape(title(one.method))
    return (
        f'<tr><th scope="row">{name}</th><td>{before}</td>'
        f"<td>{kept.changed:.3f}</td><td>{share}</td>"
        f"<td>{one.full_precision:.3f}</td></tr>"
    )
