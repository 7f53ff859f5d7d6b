"""Place recognition between two drives: what is asked, and what is right.

The protocol of the paper: queries every 10 m, database every 5 m, a match
lies within 7.5 m, points limited to [-100, 100] m. What it leaves open is
fixed as follows.

- "Every d metres" is along the trajectory: frame i is taken when the length
  of the path so far first reaches a multiple of d. The first frame is one.
- Distances between query and database are between the positions of the
  sensor, in three dimensions, limit included.
- The limit of 100 m holds for each of x, y, z in the frame of the sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evaluation import points as point_arrays
from evaluation import poses
from evaluation.methods.method import Method
from evaluation.progress import Track, silent
from evaluation.sequences.sequence import Sequence, check_same_world

QUERY_SPACING = 10.0
DATABASE_SPACING = 5.0
MATCH_RADIUS = 7.5
CROP = 100.0


@dataclass(frozen=True)
class Retrieval:
    """Scores of all queries against all places, with the truth.

    Attributes:
        query_frames: (Q,) frame of each query in its sequence.
        database_frames: (D,) frame of each place.
        scores: (Q, D) float64, higher is more similar, NaN for a place that
            the method does not consider.
        distances: (Q, D) float64 between the sensor positions [m].
    """

    query_frames: np.ndarray
    database_frames: np.ndarray
    scores: np.ndarray
    distances: np.ndarray

    @property
    def matches(self) -> np.ndarray:
        """(Q, D) bool, which place is a true match of which query."""
        return self.distances <= MATCH_RADIUS


def sample_frames(positions: np.ndarray, spacing: float) -> np.ndarray:
    """Returns frames at equal distances along a trajectory.

    Args:
        positions: (N, 3) [m], N >= 1.
        spacing: between two frames, along the path [m].

    Returns:
        (K,) increasing frame numbers; the first is 0.
    """
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    passed = np.floor(travelled / spacing).astype(np.int64)
    return np.flatnonzero(np.diff(passed, prepend=-1) > 0)


def crop(points: np.ndarray) -> np.ndarray:
    """Returns the finite points (N, 3) within the limits of the protocol."""
    # A comparison with NaN is false.
    return points[(np.abs(points) <= CROP).all(axis=1)]


def gather(sequence: Sequence, frame: int, num_scans: int) -> np.ndarray:
    """Returns the cloud that a method describes at a frame.

    Args:
        sequence: the drive.
        frame: the first scan.
        num_scans: how many consecutive scans are merged; fewer at the end
            of the drive.

    Returns:
        (N, 3) float64, cropped, in the sensor frame of the first scan.
    """
    last = min(frame + num_scans, len(sequence))
    X_WS = sequence.X_WS
    X_S0W = poses.inverse(X_WS[frame])
    clouds = []
    for index in range(frame, last):
        cloud = point_arrays.xyz(sequence.scan(index))
        if index > frame:
            cloud = poses.transform(X_S0W @ X_WS[index], cloud)
        clouds.append(cloud)
    return crop(np.concatenate(clouds))


def retrieve(
    database: Sequence,
    query: Sequence,
    method: Method,
    track: Track = silent,
) -> Retrieval:
    """Asks for every query which places of the database look like it.

    Args:
        database: the drive whose places are known.
        query: the drive that asks; in the same world frame.
        method: describes and compares.
        track: reports progress.

    Raises:
        InputError: if a sequence cannot be read, or the two are not of the
            same world.
    """
    check_same_world(database, query)
    p_WDs = database.X_WS[:, :3, 3]
    p_WQs = query.X_WS[:, :3, 3]
    database_frames = sample_frames(p_WDs, DATABASE_SPACING)
    query_frames = sample_frames(p_WQs, QUERY_SPACING)
    places = method.build_database(
        [
            method.describe_place(
                gather(database, frame, method.scans_per_place)
            )
            for frame in track(
                database_frames,
                f"describing {database.name}",
                len(database_frames),
            )
        ]
    )
    scores = np.empty((len(query_frames), len(database_frames)))
    numbered = track(
        list(enumerate(query_frames)),
        f"querying {query.name}",
        len(query_frames),
    )
    for row, frame in numbered:
        descriptor = method.describe(
            gather(query, frame, method.scans_per_place)
        )
        scores[row] = method.score(descriptor, places)
    offsets = p_WQs[query_frames, None, :] - p_WDs[None, database_frames, :]
    return Retrieval(
        query_frames=query_frames,
        database_frames=database_frames,
        scores=scores,
        distances=np.linalg.norm(offsets, axis=2),
    )
