"""The table of all queries of all pairs and methods."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.recognition.fault_kinds import PairEvidence, fault_kinds
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import (
    PROTOCOL_COLUMNS,
    protocol_values,
)
from evaluation.report.tables import Table

_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_HEADER = (
    "map",
    "db",
    "query",
    "method",
    "correct",
    "has_match",
    "score",
    "first_right_rank",
    "places",
    "query_drive",
    "query_frame",
    "query_stamp_ns",
    *(f"query_{name}" for name in _POSE),
    "match_drive",
    "match_frame",
    "match_stamp_ns",
    *(f"match_{name}" for name in _POSE),
    "distance",
    "translation_error",
    "rotation_error_deg",
    *PROTOCOL_COLUMNS,
    "why",
    "overlap",
    "hidden",
    "changed",
    "changed_class",
    "right_fit",
    "wrong_fit",
)


@dataclass(frozen=True)
class DriveTrack:
    """Times and poses of the sensor.

    Attributes:
        stamps_ns: (N,) int64 of all frames.
        X_WS: (N, 4, 4) poses there.
    """

    stamps_ns: np.ndarray
    X_WS: np.ndarray


def query_table(
    results: Iterable[tuple[tuple[str, str, str], RecognitionResult]],
    tracks: Mapping[str, DriveTrack],
    evidence: Mapping[tuple[str, str], PairEvidence],
) -> Table:
    """Returns a row for each pair, method and query, in the queries' order.

    Args:
        results: each with its map, database and query.
        tracks: drive -> its track, for all drives.
        evidence: (database, query) -> evidence of why best places are wrong;
            its columns are empty for pairs without it.
    """
    rows = tuple(
        row
        for pair, result in results
        for row in _rows(
            pair,
            result,
            tracks,
            evidence.get((result.outcome.database, result.outcome.query)),
        )
    )
    return Table(_HEADER, rows)


def _rows(
    pair: tuple[str, str, str],
    result: RecognitionResult,
    tracks: Mapping[str, DriveTrack],
    evidence: PairEvidence | None,
) -> Iterator[tuple[object, ...]]:
    outcome = result.outcome
    retrieval, outcomes = outcome.retrieval, outcome.outcomes
    best_places = retrieval.best_places.tolist()
    errors = retrieval.pose_errors
    protocol = protocol_values(outcome.protocol)
    query_track, database_track = (
        tracks[outcome.query],
        tracks[outcome.database],
    )
    nothing = (None,) * (2 + len(_POSE))
    kinds = fault_kinds(result, evidence) if evidence else []
    for query, frame in enumerate(retrieval.query_frames.tolist()):
        score = float(outcomes.best_scores[query])
        rank = float(outcomes.first_right_ranks[query])
        match: tuple[object, ...] = nothing
        distance = math.nan
        place = best_places[query]
        if place >= 0:
            match = _moment(
                database_track, int(retrieval.database_frames[place])
            )
            distance = float(retrieval.distances[query, place])
        yield (
            *pair,
            result.method,
            int(outcomes.is_right[query]),
            int(outcomes.has_match[query]),
            score,
            int(rank) if math.isfinite(rank) else None,
            outcomes.num_places,
            outcome.query,
            *_moment(query_track, frame),
            outcome.database,
            *match,
            distance,
            float(errors.translation[query]),
            float(errors.rotation_deg[query]),
            *protocol,
            *(
                (None,) * 7
                if evidence is None
                else (
                    kinds[query] or None,
                    float(evidence.overlaps[query]),
                    float(evidence.hidden[query]),
                    float(evidence.changed[query]),
                    evidence.changed_classes[query] or None,
                    float(evidence.right_fits[query]),
                    float(evidence.fits[result.method][query]),
                )
            ),
        )


def _moment(track: DriveTrack, frame: int) -> tuple[object, ...]:
    """Returns frame, stamp, position and quaternion of the sensor."""
    X_WS = track.X_WS[frame]
    quat_xyzw = Rotation.from_matrix(X_WS[:3, :3]).as_quat()
    return (
        frame,
        int(track.stamps_ns[frame]),
        *X_WS[:3, 3].tolist(),
        *quat_xyzw.tolist(),
    )
