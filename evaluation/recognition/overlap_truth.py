"""Truth by overlap: what a place's scan shows of what a query's shows.

Poses are exact, and a scan says how far away the surfaces around its sensor
are. A point of the query's scan is shown by the place's scan if it lies on one
of these: in the direction in which it lies from the place's sensor, the place
has returns, and the point's distance is between that of the nearest and that
of the farthest of them, or within `TOLERANCE` of that. Directions are cells of
1 deg of azimuth and 2 deg of elevation, with the cells above and below, since
beams of a spinning LiDAR lie far apart in elevation. The overlap is the part
of the query's points that are shown. What the place's sensor cannot see, and
what is not there when it passes, does not count.

The idea is that of OverlapNet (Chen et al., RSS 2020), which compares range
images pixel by pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.base.progress import Track, silent
from cns_drake.base.recordings.sequence import Sequence
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.sequences.sampling import gather, sample_frames

TOLERANCE = 0.5
_ROW_DEG = 2.0
_COLUMN_DEG = 1.0
_ROWS = round(180.0 / _ROW_DEG)
_COLUMNS = round(360.0 / _COLUMN_DEG)


@dataclass(frozen=True)
class SeenRanges:
    """How far away the surfaces around a sensor are.

    Attributes:
        nearest: (rows, columns) float64 least distance of a return in a cell,
            or one above or below it [m]; infinite without one.
        farthest: (rows, columns) float64 greatest distance; -infinite.
        reach: of the farthest return of all [m].
    """

    nearest: np.ndarray
    farthest: np.ndarray
    reach: float

    @classmethod
    def of(cls, points: np.ndarray) -> SeenRanges:
        """Returns what a scan (N, 3), in its sensor's frame, shows."""
        nearest, farthest = _ranges(np.ascontiguousarray(points))
        reach = float(np.linalg.norm(points, axis=1).max(initial=0.0))
        return cls(
            nearest=np.minimum.reduce(_with_neighbours(nearest, math.inf)),
            farthest=np.maximum.reduce(_with_neighbours(farthest, -math.inf)),
            reach=reach,
        )

    def share_of(self, points: np.ndarray) -> float:
        """Returns which part of points (N, 3) is shown; NaN without points.

        Args:
            points: in this sensor's frame.
        """
        if len(points) == 0:
            return math.nan
        shown = _count_shown(
            np.ascontiguousarray(points), self.nearest, self.farthest
        )
        return float(shown / len(points))


def overlap_matrix(
    database: Sequence,
    query: Sequence,
    protocol: RetrievalProtocol,
    track: Track = silent,
) -> np.ndarray:
    """Returns the overlap of every query with every place, (Q, D) float64.

    Of single scans, whatever number of them methods merge. NaN for a query
    without a point.

    Args:
        database: the drive whose places are known.
        query: the drive that asks, in the same world frame.
        protocol: says where queries and places are.
        track: reports progress.

    Raises:
        InputError: if a sequence cannot be read.
    """
    placed = sample_frames(database.X_WS[:, :3, 3], protocol.place_spacing)
    asking = sample_frames(query.X_WS[:, :3, 3], protocol.query_spacing)
    seen = [
        SeenRanges.of(gather(database, frame, 1, protocol.max_range))
        for frame in track(
            placed.tolist(), f"overlap: seeing {database.name}", len(placed)
        )
    ]
    X_WPs = database.X_WS[placed]
    reaches = np.array([one.reach for one in seen])
    result = np.zeros((len(asking), len(placed)))
    rows = track(
        range(len(asking)), f"overlap: comparing {query.name}", len(asking)
    )
    for row in rows:
        points = gather(query, int(asking[row]), 1, protocol.max_range)
        if len(points) == 0:
            result[row] = math.nan
            continue
        X_WQ = query.X_WS[asking[row]]
        reach = np.linalg.norm(points, axis=1).max()
        apart = np.linalg.norm(X_WPs[:, :3, 3] - X_WQ[:3, 3], axis=1)
        p_W = points @ X_WQ[:3, :3].T + X_WQ[:3, 3]
        # Farther apart, no point of one is within reach of the other.
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
    """Returns how much of each query the best of its matches shows, (Q,).

    Args:
        place_scans: D scans (N, 3), each in the frame of its sensor.
        X_WPs: (D, 4, 4) poses of these sensors.
        query_scans: Q scans.
        X_WQs: (Q, 4, 4) poses of theirs.
        matches: (Q, D) bool, the truth.

    Returns:
        NaN for a query without a point or without a match.
    """
    asked = np.flatnonzero(matches.any(axis=0)).tolist()
    seen = {k: SeenRanges.of(place_scans[k].astype(float)) for k in asked}
    result = np.full(len(query_scans), math.nan)
    for row, scan in enumerate(query_scans):
        X_WQ = X_WQs[row]
        p_W = scan.astype(float) @ X_WQ[:3, :3].T + X_WQ[:3, 3]
        shares = [
            seen[k].share_of((p_W - X_WPs[k, :3, 3]) @ X_WPs[k, :3, :3])
            for k in np.flatnonzero(matches[row]).tolist()
        ]
        if shares:
            result[row] = max(shares)
    return result


def _with_neighbours(cells: np.ndarray, border: float) -> list[np.ndarray]:
    """Returns the cells, and those above and below each."""
    padded = np.pad(cells, ((1, 1), (0, 0)), constant_values=border)
    return [padded[:-2], padded[1:-1], padded[2:]]


@compiled
def _cell_of(x: float, y: float, z: float) -> tuple[int, int, float]:
    """Returns row and column of a direction, and the distance."""
    flat = math.hypot(x, y)
    row = int((math.degrees(math.atan2(z, flat)) + 90.0) / _ROW_DEG)
    column = int((math.degrees(math.atan2(y, x)) + 180.0) / _COLUMN_DEG)
    # Straight up, and straight back, round to the limit.
    return min(row, _ROWS - 1), column % _COLUMNS, math.hypot(flat, z)


@compiled
def _ranges(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and the greatest distance in each cell."""
    nearest = np.full((_ROWS, _COLUMNS), np.inf)
    farthest = np.full((_ROWS, _COLUMNS), -np.inf)
    for i in range(len(points)):
        row, column, distance = _cell_of(
            points[i, 0], points[i, 1], points[i, 2]
        )
        nearest[row, column] = min(nearest[row, column], distance)
        farthest[row, column] = max(farthest[row, column], distance)
    return nearest, farthest


@compiled
def _count_shown(
    points: np.ndarray, nearest: np.ndarray, farthest: np.ndarray
) -> int:
    """Returns how many points lie where the returns of their cell do."""
    count = 0
    for i in range(len(points)):
        row, column, distance = _cell_of(
            points[i, 0], points[i, 1], points[i, 2]
        )
        if (
            nearest[row, column] - TOLERANCE
            <= distance
            <= farthest[row, column] + TOLERANCE
        ):
            count += 1
    return count
