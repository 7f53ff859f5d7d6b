"""Table with a row for each query: its frame, its top-ranked place, and why."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.recognition.fault_names import PairEvidence, fault_kinds
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import PROTOCOL_COLUMNS
from evaluation.report.tables.columns import KEYS, Evidence, of_result
from evaluation.results.table_forms import Columns, Table, keyed

# Frame, time and pose of a sensor, as columns of files.
_FRAME_COLUMNS = ("frame", "stamp_ns", "x", "y", "z", "qx", "qy", "qz", "qw")


@dataclass(frozen=True)
class DriveTrack:
    """Time stamps and sensor poses of all frames of a drive.

    Attributes:
        stamps_ns: (N,) int64 time stamps [ns].
        X_WS: (N, 4, 4) poses of the sensor.
    """

    stamps_ns: np.ndarray
    X_WS: np.ndarray

    def moments(self, frames: np.ndarray) -> list[np.ndarray]:
        """Returns number, time stamp and sensor pose of given frames.

        Args:
            frames: (Q,) frame numbers; a number below 0 stands for no frame.

        Returns:
            Nine arrays (Q,) of objects: frame, stamp [ns], x, y, z [m], and qx,
            qy, qz, qw of the orientation. All values are None where there is no
            frame.
        """
        X_WS = self.X_WS[frames]
        quats_xyzw = Rotation.from_matrix(X_WS[:, :3, :3]).as_quat()
        poses = np.concatenate([X_WS[:, :3, 3], quats_xyzw], axis=1)
        columns = [
            column.astype(object)
            for column in (frames, self.stamps_ns[frames], *poses.T)
        ]
        for column in columns:
            column[frames < 0] = None
        return columns


class _QueryRows(NamedTuple):
    """The data for the rows of the queries of one result.

    `query` and `match` contain the columns `_FRAME_COLUMNS` of the queries and
    of their top-ranked places.
    """

    result: PlaceOutcome
    query: list[np.ndarray]
    match: list[np.ndarray]
    evidence: PairEvidence | None


def _frame_columns(side: str) -> Columns[_QueryRows]:
    return keyed(
        {f"{side}_{name}": k for k, name in enumerate(_FRAME_COLUMNS)},
        lambda q, k: getattr(q, side)[k],
    )


_QUERY_COLUMNS: Columns[_QueryRows] = {
    **of_result(KEYS),
    "correct": lambda q: q.result.outcomes.is_right,
    "has_match": lambda q: q.result.outcomes.has_match,
    "score": lambda q: q.result.outcomes.best_scores,
    "first_right_rank": lambda q: q.result.outcomes.known_ranks,
    "places": lambda q: q.result.outcomes.num_places,
    "block": lambda q: q.result.outcomes.own_blocks,
    "query_drive": lambda q: q.result.query,
    **_frame_columns("query"),
    "match_drive": lambda q: q.result.database,
    **_frame_columns("match"),
    "distance": lambda q: q.result.columns["distance"],
    "translation_error": lambda q: q.result.pose_errors.translation,
    "rotation_error_deg": lambda q: q.result.pose_errors.rotation_deg,
    **keyed(
        {name: name for name in PROTOCOL_COLUMNS},
        lambda q, name: getattr(q.result.protocol, name),
    ),
    "why": lambda q: q.evidence and fault_kinds(q.result, q.evidence),
    "overlap": lambda q: q.evidence and q.evidence.overlaps,
    "hidden": lambda q: q.evidence and q.evidence.hidden_shares,
    "changed": lambda q: q.evidence and q.evidence.changed,
    "changed_class": lambda q: q.evidence and q.evidence.changed_classes,
    "right_fit": lambda q: q.evidence and q.evidence.right_fits,
    "wrong_fit": lambda q: q.evidence and q.evidence.fits[q.result.method],
    "visible_change": lambda q: q.evidence and q.evidence.visible_changes,
    "protocol": attrgetter("result.protocol_name"),
}


def query_table(
    results: Iterable[PlaceOutcome],
    tracks: Mapping[str, DriveTrack],
    evidence: Evidence,
) -> Table:
    """Returns a table with a row for each query of each result.

    Rows are in the order of `results`.

    Args:
        results: results of methods on pairs of drives.
        tracks: drive -> its frames, for all drives in the results.
        evidence: names of database and query drive -> evidence on why
            top-ranked places are wrong. The columns with reasons are empty for
            a pair without evidence.
    """

    def queries(outcome: PlaceOutcome) -> _QueryRows:
        return _QueryRows(
            outcome,
            tracks[outcome.query].moments(outcome.columns["query_frame"]),
            tracks[outcome.database].moments(outcome.columns["match_frame"]),
            evidence.get((outcome.database, outcome.query)),
        )

    return Table.of(map(queries, results), _QUERY_COLUMNS)
