"""Ground truth by overlap: how much of a query's scan a place's scan shows.

Poses are exact. A point of the query's scan counts as shown if it lies on a
surface of the place's scan, see `evaluation.recognition.seen_surfaces`. The
overlap is the share of the query's points that are shown. Points that were
occluded for the place's sensor, or absent when the sensor passed, are not
shown.

The idea comes from OverlapNet (Chen et al., RSS 2020), which compares range
images pixel by pixel.
"""

from collections.abc import Callable, Sequence
import math
from pathlib import Path
from typing import Protocol

import numpy as np

from evaluation.base import InputError, poses, read_records, track, write_csv
from evaluation.drives import Drive, cloud_at, sample_frames
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.seen_surfaces import TOLERANCE, SeenSurfaces

# Greatest number of points of a query's scan that are compared.
_NUM_POINTS = 8192
_COLUMNS = ("query_frame", "database_frame", "overlap")


class Seen(Protocol):
    """The surfaces that a sensor sees from a place.

    Attributes:
        reach: distance of the farthest surface [m].
    """

    @property
    def reach(self) -> float: ...

    def share_of(self, points: np.ndarray) -> float:
        """Returns the share of points that the sensor sees.

        Args:
            points: (N, 3) points in the sensor's frame [m].
        """
        ...


def overlap_matrix(
    database: Drive,
    query: Drive,
    protocol: RetrievalProtocol,
    see: Callable[[int], Seen] | None = None,
) -> np.ndarray:
    """Returns the overlap of every query with every place, (Q, D) float64.

    Single scans are compared, even if methods merge several scans. The overlap
    is NaN for a query without a point.

    Args:
        database: the drive of the places.
        query: the drive of the queries, in the same world frame.
        protocol: protocol that determines the frames of queries and places.
        see: function that returns the surfaces seen at a frame of the database.
            By default these are the surfaces of the frame's scan, and at most
            8192 points of a query are compared.

    Raises:
        InputError: if a drive cannot be read.
    """

    def see_scan(frame: int) -> Seen:
        return SeenSurfaces.of(
            cloud_at(database, frame, 1, protocol.half_extent)
        )

    query_frames, placed = compared_frames(database, query, protocol)
    clouds = [
        protocol.query_scan(query, frame)
        for frame in track(
            query_frames.tolist(),
            f"overlap: reading {query.name}",
            len(query_frames),
            "scans",
        )
    ]
    if see is None:
        see = see_scan
        clouds = [sample_points(points) for points in clouds]
    X_WQs = protocol.query_poses(query.X_WS[query_frames], query_frames)
    reaches = np.array(
        [np.linalg.norm(points, axis=1).max(initial=0.0) for points in clouds]
    )
    result = np.zeros((len(query_frames), len(placed)))
    result[[len(points) == 0 for points in clouds]] = math.nan
    columns = track(
        range(len(placed)),
        f"overlap: comparing {database.name}",
        len(placed),
        "places",
    )
    for column in columns:
        seen = see(int(placed[column]))
        X_PW = poses.inverse(database.X_WS[placed[column]])
        X_PQs = X_PW @ X_WQs
        apart = np.linalg.norm(X_PQs[:, :3, 3], axis=1)
        # Scans farther apart have no common points.
        is_near = apart <= reaches + seen.reach + TOLERANCE
        for row in np.flatnonzero(is_near & ~np.isnan(result[:, column])):
            X_PQ = X_PQs[row]
            p_P = clouds[row] @ X_PQ[:3, :3].T + X_PQ[:3, 3]
            result[row, column] = seen.share_of(p_P)
    return result


def compared_frames(
    database: Drive, query: Drive, protocol: RetrievalProtocol
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the frames of queries and of places that are compared.

    Args:
        database: the drive of the places.
        query: the drive of the queries.
        protocol: protocol with the spacings of queries and places.

    Returns:
        (Q,) increasing frame numbers of the query drive; (D,) of the database.

    Example:
        from evaluation import RetrievalProtocol, compared_frames, open_drive

        database, query = map(open_drive, ("output/first", "output/second"))
        protocol = RetrievalProtocol(query_spacing=20.0)
        queries, places = compared_frames(database, query, protocol)
    """
    return (
        sample_frames(query.X_WS[:, :3, 3], protocol.query_spacing),
        sample_frames(database.X_WS[:, :3, 3], protocol.place_spacing),
    )


def overlaps_with_best_match(
    place_scans: Sequence[np.ndarray],
    X_WPs: np.ndarray,
    query_scans: Sequence[np.ndarray],
    X_WQs: np.ndarray,
    matches: np.ndarray,
) -> np.ndarray:
    """Returns the share of each query's scan that its best match shows.

    Scans are sorted and compared once for all radii of a match.

    Args:
        place_scans: D scans (N, 3), each in the frame of its sensor.
        X_WPs: (D, 4, 4) poses of these sensors.
        query_scans: Q scans.
        X_WQs: (Q, 4, 4) poses of their sensors.
        matches: (R, Q, D) bool, whether a place is a true match of a query, by
            each of R radii.

    Returns:
        (R, Q) greatest share of the query's scan that the scan of a match
        shows; NaN for a query without points or without a match.
    """
    matched = np.flatnonzero(matches.any(axis=(0, 1))).tolist()
    seen = {k: SeenSurfaces.of(place_scans[k].astype(float)) for k in matched}
    result = np.full(matches.shape[:2], math.nan)
    for row, scan in enumerate(query_scans):
        X_WQ = X_WQs[row]
        p_W = sample_points(scan).astype(float) @ X_WQ[:3, :3].T + X_WQ[:3, 3]
        near = np.flatnonzero(matches[:, row].any(axis=0))
        shares = np.array(
            [
                seen[k].share_of((p_W - X_WPs[k, :3, 3]) @ X_WPs[k, :3, :3])
                for k in near.tolist()
            ]
        )
        for number, is_match in enumerate(matches[:, row, near]):
            if is_match.any():
                result[number, row] = shares[is_match].max()
    return result


def sample_points(points: np.ndarray) -> np.ndarray:
    """Returns at most 8192 of N points, sampled at random.

    Equal numbers of points give the same sample, so that values of points can
    be sampled like their coordinates.

    Args:
        points: (N, ...) points, or values of points.
    """
    if len(points) <= _NUM_POINTS:
        return points
    rng = np.random.default_rng(len(points))
    return points[rng.choice(len(points), _NUM_POINTS, replace=False)]


def write_overlaps(
    path: Path,
    query_frames: np.ndarray,
    database_frames: np.ndarray,
    overlaps: np.ndarray,
) -> None:
    """Writes the overlap of each query with each place as CSV.

    The columns are `query_frame`, `database_frame` and `overlap`. The overlap
    is empty for a query without a point.

    Args:
        path: CSV file to write.
        query_frames: (Q,) frames of the queries.
        database_frames: (D,) frames of the places.
        overlaps: (Q, D) share of each query's scan that each place's scan
            shows.

    Raises:
        InputError: if the file cannot be written.
    """
    rows = (
        (frame, place, "" if math.isnan(value) else f"{value:.6f}")
        for frame, row in zip(query_frames, overlaps, strict=True)
        for place, value in zip(database_frames, row, strict=True)
    )
    write_csv(path, _COLUMNS, rows)


def read_overlaps(
    path: Path, query_frames: np.ndarray, database_frames: np.ndarray
) -> np.ndarray:
    """Returns the overlaps (Q, D) from a CSV table.

    Args:
        path: path of the table.
        query_frames: (Q,) frames of the queries. The table must have D rows for
            the first query, then D rows for the second query, and so on.
        database_frames: (D,) frames of the places.

    Raises:
        InputError: the file cannot be read, a number is impossible, or the
            table has other rows than one for each query and place, in order.
    """
    expected = [
        (int(frame), int(place))
        for frame in query_frames
        for place in database_frames
    ]
    frames, values = [], []
    for line, row in read_records(path, _COLUMNS):
        where = f"{path}: line {line}"
        try:
            frames.append((int(row["query_frame"]), int(row["database_frame"])))
            values.append(float(row["overlap"] or math.nan))
        except ValueError:
            raise InputError(f"{where}: not a number") from None
        if not (math.isnan(values[-1]) or 0.0 <= values[-1] <= 1.0):
            raise InputError(f"{where}: overlap: not between 0 and 1")
    if frames != expected:
        raise InputError(
            f"{path}: query_frame, database_frame: not those of these drives"
            " and spacings"
        )
    return np.reshape(values, (len(query_frames), len(database_frames)))
