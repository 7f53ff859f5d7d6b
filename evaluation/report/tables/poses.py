"""Tables of the errors of estimated poses."""

from __future__ import annotations

from collections.abc import Sequence

from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.tables.columns import KEYS, PRINTED_KEYS, PROTOCOL
from evaluation.results.table_forms import (
    CAPTIONS,
    Columns,
    Table,
    by_pair_and_method,
)

# Name in files -> value.
_POSE_ERRORS: Columns[PlaceOutcome] = {
    "translation_median": lambda r: r.pose.translation_median,
    "translation_90": lambda r: r.pose.translation_90,
    "rotation_median_deg": lambda r: r.pose.rotation_median_deg,
    "rotation_90_deg": lambda r: r.pose.rotation_90_deg,
    "success": lambda r: r.pose.success,
    "recall_at_full_precision": lambda r: (
        r.by_mode["all"].curve.recall_at_full_precision
    ),
}


def pose_table(results: Sequence[PlaceOutcome]) -> Table:
    """Returns a table of the errors of estimated poses, for print."""
    names: list[str | tuple[str, str]] = [
        *(("translation [m]", part) for part in ("median", "90 %")),
        *(("rotation [deg]", part) for part in ("median", "90 %")),
        "success",
        "recall at full precision",
    ]
    return Table.of(
        by_pair_and_method(results),
        {
            **PRINTED_KEYS,
            **dict(zip(names, _POSE_ERRORS.values(), strict=True)),
        },
        CAPTIONS["poses"],
    )


def pose_error_numbers(results: Sequence[PlaceOutcome]) -> Table:
    """Returns a table of the errors of estimated poses, for `poses.csv`."""
    return Table.of(
        results,
        {
            **KEYS,
            "accepted_matches": lambda r: r.pose.num_accepted,
            **_POSE_ERRORS,
            **PROTOCOL,
        },
    )
