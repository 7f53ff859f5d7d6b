"""Truth by overlap: the part of a query's scan that a place's scan shows.

Poses are exact. The place's scan shows a point of the query's scan if the point
lies on a surface that the place's scan shows, see `seen_surfaces`. The overlap
is the part of the query's points that are shown. Parts that are hidden from the
place's sensor, or absent when it passes, are not shown.

The idea is that of OverlapNet (Chen et al., RSS 2020), which compares range
images pixel by pixel.
"""

from __future__ import annotations

import math

import numpy as np

from cns_drake.base.progress import Track, silent
from cns_drake.base.recordings.sequence import Sequence
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.seen_surfaces import TOLERANCE, SeenSurfaces
from evaluation.sequences.sampling import gather, sample_frames

# Number of points of a query's scan that are compared.
_NUM_POINTS = 8192


def overlap_matrix(
    database: Sequence,
    query: Sequence,
    protocol: RetrievalProtocol,
    track: Track = silent,
) -> np.ndarray:
    """Returns the overlap of every query with every place, (Q, D) float64.

    Single scans are compared, even if methods merge several. NaN for a query
    without a point.

    Args:
        database: the drive of the places.
        query: the drive of the queries, in the same world frame.
        protocol: for the frames of queries and places.
        track: reports progress.

    Raises:
        InputError: if a sequence cannot be read.
    """
    placed = sample_frames(database.X_WS[:, :3, 3], protocol.place_spacing)
    query_frames = sample_frames(query.X_WS[:, :3, 3], protocol.query_spacing)
    seen = [
        SeenSurfaces.of(gather(database, frame, 1, protocol.max_range))
        for frame in track(
            placed.tolist(), f"overlap: seeing {database.name}", len(placed)
        )
    ]
    X_WPs = database.X_WS[placed]
    reaches = np.array([one.reach for one in seen])
    result = np.zeros((len(query_frames), len(placed)))
    rows = track(
        range(len(query_frames)),
        f"overlap: comparing {query.name}",
        len(query_frames),
    )
    for row in rows:
        points = gather(query, int(query_frames[row]), 1, protocol.max_range)
        if len(points) == 0:
            result[row] = math.nan
            continue
        X_WQ = query.X_WS[query_frames[row]]
        reach = np.linalg.norm(points, axis=1).max()
        apart = np.linalg.norm(X_WPs[:, :3, 3] - X_WQ[:3, 3], axis=1)
        p_W = sampled(points) @ X_WQ[:3, :3].T + X_WQ[:3, 3]
        # Scans farther apart have no common points.
        for place in np.flatnonzero(apart <= reach + reaches + TOLERANCE):
            X_WP = X_WPs[place]
            p_P = (p_W - X_WP[:3, 3]) @ X_WP[:3, :3]
            result[row, place] = seen[place].share_of(p_P)
    return result


def best_overlaps(
    place_scans: list[np.ndarray],
    X_WPs: np.ndarray,
    query_scans: list[np.ndarray],
    X_WQs: np.ndarray,
    matches: np.ndarray,
) -> np.ndarray:
    """Returns the part (Q,) of each query's scan that its best match shows.

    Args:
        place_scans: D scans (N, 3), each in the frame of its sensor.
        X_WPs: (D, 4, 4) poses of these sensors.
        query_scans: Q scans.
        X_WQs: (Q, 4, 4) poses of their sensors.
        matches: (Q, D) bool, the truth.

    Returns:
        NaN for a query without a point or without a match.
    """
    matched = np.flatnonzero(matches.any(axis=0)).tolist()
    seen = {k: SeenSurfaces.of(place_scans[k].astype(float)) for k in matched}
    result = np.full(len(query_scans), math.nan)
    for row, scan in enumerate(query_scans):
        X_WQ = X_WQs[row]
        p_W = sampled(scan).astype(float) @ X_WQ[:3, :3].T + X_WQ[:3, 3]
        shares = [
            seen[k].share_of((p_W - X_WPs[k, :3, 3]) @ X_WPs[k, :3, :3])
            for k in np.flatnonzero(matches[row]).tolist()
        ]
        if shares:
            result[row] = max(shares)
    return result


def sampled(points: np.ndarray) -> np.ndarray:
    """Returns points, at most 8192 of N, drawn at random."""
    if len(points) <= _NUM_POINTS:
        return points
    rng = np.random.default_rng(len(points))
    return points[rng.choice(len(points), _NUM_POINTS, replace=False)]
