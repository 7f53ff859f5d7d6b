"""The numbers of a report as rows of the one table of results."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from evaluation.recognition.place_outcome import PlaceOutcome, place_numbers
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.pose_errors import pose_success
from evaluation.report.page import Report
from evaluation.results.table import Results, Row

EXPERIMENT = "stages"
_STAGE = "both.stage"
# The stage of the database: its own, or that of the query on the same routes.
_OWN, _LAST = "own", "last"
_SEED = 1


def report_rows(report: Report) -> Results:
    """Returns the table of a report's pairs and of their controls.

    It is that of the experiment `stages`: the control of a pair is the
    condition in which the database is of the query's stage.
    """
    return Results.of([*_place_rows(report), *_change_rows(report)])


def _place_rows(report: Report) -> Iterator[Row]:
    for one in report.survivals:
        changed = _outcome(report, one.changed)
        unchanged = None
        if one.unchanged is not None:
            unchanged = _outcome(report, one.unchanged)
        for stage, now in ((_LAST, unchanged), (_OWN, changed)):
            if now is None:
                continue
            key: dict[str, Any] = {
                "experiment": EXPERIMENT,
                "map": one.changed.map_name,
                "database": one.changed.outcome.database,
                "query": one.changed.outcome.query,
                "seed": _SEED,
                "factors": {_STAGE: stage},
                "method": now.method,
                "gate": now.is_gated,
                "protocol": one.protocol.name,
            }
            number = len(now.outcomes)
            for metric, value, interval in place_numbers(now, unchanged):
                yield Row(
                    **key,
                    task="place",
                    metric=metric,
                    value=value,
                    low=interval.low,
                    high=interval.high,
                    n=number,
                )
            success = pose_success(now.pose_errors, now.outcomes)
            if not np.isnan(success):
                yield Row(
                    **key,
                    task="pose",
                    metric="pose_success",
                    value=success,
                    n=int(now.outcomes.has_match.sum()),
                )


def _outcome(report: Report, result: RecognitionResult) -> PlaceOutcome:
    """Returns the outcome of a result, query by query."""
    outcome, found = result.outcome, result.outcome.retrieval
    track = report.tracks[outcome.query]
    frames = found.query_frames
    evidence = report.evidence.get((outcome.database, outcome.query))
    overlaps = np.full(len(frames), np.nan)
    if evidence is not None:
        overlaps = evidence.overlaps
    return PlaceOutcome.of(
        outcome.method,
        outcome.protocol.gate,
        found,
        (track.stamps_ns[frames], track.X_WS[frames, :3, 3]),
        [outcome.database] * len(found.database_frames),
        overlaps,
        outcome.protocol.radius,
    )


def _change_rows(report: Report) -> Iterator[Row]:
    names = {
        (one.changed.map_name, *one.changed.stages): one.changed.outcome
        for one in report.survivals
    }
    for change in report.changes:
        outcome = names.get((change.map_name, *change.stages))
        if outcome is None:
            continue
        for stage, found in (
            (_LAST, change.report.control),
            (_OWN, change.report.change),
        ):
            if found is not None:
                yield Row(
                    experiment=EXPERIMENT,
                    map=change.map_name,
                    database=outcome.database,
                    query=outcome.query,
                    seed=_SEED,
                    factors={_STAGE: stage},
                    task="change",
                    method="",
                    gate=False,
                    protocol=outcome.protocol.name,
                    metric="tcr_sym",
                    value=float(found.symmetric),
                    n=found.num_in_hull,
                )
