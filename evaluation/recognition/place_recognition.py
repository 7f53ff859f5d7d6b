"""Measures one method on one pair of drives, from scans to numbers."""

import numpy as np

from cns_drake.base.drives.drive import Drive
from evaluation.methods.method import Method
from evaluation.recognition.place_outcome import (
    PlaceOutcome,
    check_has_match,
)
from evaluation.recognition.protocol import RECORDED_PROTOCOL, RetrievalProtocol
from evaluation.recognition.retrieval import Retrieval, retrieve


def run(
    database: Drive,
    query: Drive,
    method: Method,
    protocol: RetrievalProtocol = RECORDED_PROTOCOL,
    *,
    across_maps: bool = False,
    overlaps: np.ndarray | None = None,
) -> PlaceOutcome:
    """Returns the outcome of a method on a pair of drives.

    Args:
        database, query: the drives.
        method: the method.
        protocol: protocol of the comparison.
        across_maps: whether the drives may be from maps with different names.
        overlaps: (Q, D) share of each query's scan that each place's scan
            shows; by default computed from the scans. Used only for matches by
            overlap.

    Raises:
        InputError: if a drive cannot be read, the drives are not in the same
            world, the method returns an invalid result, or no query has a
            match.
    """
    found = retrieve(
        database,
        query,
        method,
        protocol,
        across_maps=across_maps,
        overlaps=overlaps,
    )
    return judge_retrieval(method, database.name, query, found, protocol)


def judge_retrieval(
    method: Method,
    database: str,
    query: Drive,
    retrieval: Retrieval,
    protocol: RetrievalProtocol,
) -> PlaceOutcome:
    """Returns the outcome of a method on a pair of drives, from its scores.

    Args:
        method: the method.
        database: name of the drive of the places.
        query: the drive of the queries.
        retrieval: scores and truth of all pairs of a query and a place.
        protocol: protocol of the retrieval.

    Raises:
        InputError: if no query has a match.
    """
    frames = retrieval.query_frames
    outcome = PlaceOutcome.of(
        method.name,
        method,
        protocol,
        retrieval,
        (query.name, query.stamps_ns[frames], query.X_WS[frames, :3, 3]),
        [database] * len(retrieval.database_frames),
    )
    check_has_match(outcome)
    return outcome
