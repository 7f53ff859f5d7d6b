"""The numbers of a report as rows of the table of results."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.fault_kinds import PairEvidence
from evaluation.recognition.place_outcome import (
    PlaceOutcome,
    place_numbers,
    pose_numbers,
)
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.results.table import Row

EXPERIMENT = "stages"
STAGE = "both.stage"
# The stage of the database: its own, or that of the query on the same routes.
OWN, LAST = "own", "last"
_SEED = 1
# A result, and that of its control, if there is one.
Controlled = tuple[RecognitionResult, RecognitionResult | None]


def place_rows(
    pairs: Iterable[Controlled],
    tracks: Mapping[str, Any],
    evidence: Mapping[tuple[str, str], PairEvidence],
) -> Iterator[Row]:
    """Yields the results of place recognition: controls, then pairs.

    They are rows of the experiment `stages`. The control of a pair is the
    condition in which the database is of the query's stage. All queries' drives
    have a `DriveTrack`.
    """

    def outcome(
        result: RecognitionResult, overlaps: np.ndarray | None
    ) -> PlaceOutcome:
        one, found = result.outcome, result.outcome.retrieval
        frames, track = found.query_frames, tracks[one.query]
        return PlaceOutcome.of(
            one.method,
            one.protocol.gate,
            found,
            (track.stamps_ns[frames], track.X_WS[frames, :3, 3]),
            [one.database] * len(found.database_frames),
            np.full(len(frames), np.nan) if overlaps is None else overlaps,
            one.protocol.radius,
        )

    outcomes = []
    for changed, unchanged in pairs:
        both = changed.outcome.database, changed.outcome.query
        known = evidence.get(both)
        after = outcome(changed, getattr(known, "overlaps", None))
        before = None
        if unchanged is not None:
            before = outcome(unchanged, getattr(known, "unchanged", None))
        outcomes.append((changed, after, before))
    for stage in (LAST, OWN):
        for changed, after, before in outcomes:
            now = before if stage == LAST else after
            if now is None:
                continue
            for task, numbers in (
                ("place", place_numbers),
                ("pose", pose_numbers),
            ):
                for number in numbers(now, before):
                    yield Row.of(
                        number,
                        experiment=EXPERIMENT,
                        map=changed.map_name,
                        database=changed.outcome.database,
                        query=changed.outcome.query,
                        seed=_SEED,
                        factors={STAGE: stage},
                        task=task,
                        protocol=changed.outcome.protocol.name,
                    )


def change_rows(
    pairs: Iterable[Controlled], changes: Iterable[ChangeResult]
) -> Iterator[Row]:
    """Yields TCR_sym of pairs, without the change and with it."""
    of_stages = {
        (one.map_name, *stages): one.report
        for one in changes
        for stages in (one.stages, one.stages[::-1])
    }
    keys = {(one.map_name, *one.stages): one.outcome for one, _ in pairs}
    for pair in filter(of_stages.__contains__, keys):
        outcome, report = keys[pair], of_stages[pair]
        for stage, change in ((LAST, report.control), (OWN, report.change)):
            if change is not None:
                yield Row(
                    experiment=EXPERIMENT,
                    map=pair[0],
                    database=outcome.database,
                    query=outcome.query,
                    seed=_SEED,
                    factors={STAGE: stage},
                    task="change",
                    method="",
                    gate=False,
                    protocol=outcome.protocol.name,
                    metric="tcr_sym",
                    value=float(change.symmetric),
                    n=change.num_in_hull,
                )
