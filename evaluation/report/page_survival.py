"""The page's section on the survival of each method."""

from __future__ import annotations

from collections.abc import Sequence

from evaluation.recognition.survival import Kept, Survival
from evaluation.report.method_titles import title
from evaluation.report.survival_tables import (
    NO_CONTROL,
    by_pair,
    interval_text,
    percent,
)
from evaluation.report.tables import to_text


def survival_groups(
    survivals: Sequence[Survival],
) -> list[tuple[str, list[dict[str, object]]]]:
    """Returns the name of each pair and its rows, as the page shows them."""
    return [
        (f"{map_name} {' → '.join(stages)}", [_row(one) for one in group])
        for (map_name, *stages), group in by_pair(survivals).items()
    ]


def _row(one: Survival) -> dict[str, object]:
    return {
        "title": title(one.method),
        "has_control": one.unchanged is not None,
        "AUC": _shown(one, one.auc),
        "R@1": _shown(one, one.recall_at_1),
        "full_precision": f"{one.full_precision:.3f}",
    }


def _shown(one: Survival, kept: Kept) -> dict[str, str]:
    has_control = one.unchanged is not None
    return {
        "unchanged": f"{kept.unchanged:.3f}" if has_control else NO_CONTROL,
        "changed": f"{kept.changed:.3f}",
        "share": percent(kept.share) if has_control else to_text(None),
        "interval": interval_text(kept) if has_control else "",
    }
