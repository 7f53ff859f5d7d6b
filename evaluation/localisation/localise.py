"""Localises single scans in a map, each from a random initial pose.

Frames: world W, LiDAR S. An error has three components relative to the
vehicle's path: along it, across it (to the left) and up.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
import math
import multiprocessing
from pathlib import Path
import time

import numpy as np

from cns_drake.base import points as clouds
from cns_drake.base import poses
from cns_drake.base.errors import InputError, errors_at
from cns_drake.base.progress import track
from cns_drake.drives.drive import Drive
from evaluation.drives.sampling import sample_frames
from evaluation.drives.scan_clouds import cropped
from evaluation.localisation.estimators import Estimator
from evaluation.localisation.fit import fit_at
from evaluation.localisation.initial_poses import InitialPose, Starts
from evaluation.localisation.localisation_map import (
    FEWEST_POINTS,
    LocalisationMap,
)
from evaluation.localisation.results import MEASURED, QUERY
from evaluation.localisation.settings import MAX_RANGE, Settings
from evaluation.maps.voxel_maps import downsample
from evaluation.recognition.pose_errors import pose_error

# A query is localised if the map's drive, or a point of the map's file, is this
# near to its LiDAR [m].
NEAR = 7.5
# Number of queries that wait, per process.
_WAITING = 4
# A sensor that moves less than this between two frames stands [m].
_STANDS = 1e-3
# Least horizontal share of the direction of a path that is not straight up.
_STEEP = 1e-6


def mapped_frames(
    place: Drive | Path, surroundings: LocalisationMap, query: Drive
) -> np.ndarray:
    """Returns which frames of a query drive lie within the map, (N,) bool.

    A frame lies within the map if it is at most `NEAR` [m] from the map's drive
    or, if the map is a file, from a point of the map.

    Args:
        place: drive or file from which the map was made.
        surroundings: the map.
        query: the query drive.

    Raises:
        InputError: no frame lies within the map.
    """
    p_WQ = query.X_WS[:, :3, 3]
    if isinstance(place, Drive):
        from scipy.spatial import cKDTree

        distances, _ = cKDTree(place.X_WS[:, :3, 3]).query(p_WQ)
    else:
        distances = surroundings.distances(p_WQ)
    is_mapped = distances <= NEAR
    if not is_mapped.any():
        raise InputError(
            f"{query.name}: nowhere within {NEAR:g} m of the map of"
            f" {surroundings.name}; the nearest scan is"
            f" {distances.min():.1f} m away"
        )
    return is_mapped


def path_axes(p_WS: np.ndarray, X_WS: np.ndarray) -> np.ndarray:
    """Returns rotations R_WT (N, 3, 3), where T is the frame of the path.

    The axes of T point along the path, to the left of it, and up.

    Args:
        p_WS: (N, 3) positions of a drive [m].
        X_WS: (N, 4, 4) poses of the drive. Where the sensor does not move, the
            x axis of S is used as the direction of the path.
    """
    along = np.zeros_like(p_WS)
    if len(p_WS) > 1:
        along = np.gradient(p_WS, axis=0)
    stands = np.linalg.norm(along, axis=1) < _STANDS
    along[stands] = X_WS[stands, :3, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.cross([0.0, 0.0, 1.0], along)
    # A path straight up has no direction to the left.
    steep = np.linalg.norm(left, axis=1) < _STEEP
    left[steep] = X_WS[steep, :3, 1]
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    return np.stack([along, left, np.cross(along, left)], axis=2)


@dataclass(frozen=True, eq=False)
class Localiser:
    """Localises scans in one map by one estimator.

    Attributes:
        surroundings: the map.
        estimator: function that registers a scan, see
            `evaluation.localisation.estimators.make_estimator`.
        settings: settings for downsampling scans.
    """

    surroundings: LocalisationMap
    estimator: Estimator
    settings: Settings

    def query(
        self,
        frame: int,
        stamp_ns: int,
        scan: np.ndarray,
        X_WS: np.ndarray,
        R_WT: np.ndarray,
        initial: InitialPose,
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Localises one scan and compares the result with the ground truth.

        Args:
            frame: number of the scan.
            stamp_ns: time of the scan [ns].
            scan: structured array, in S.
            X_WS: (4, 4) ground-truth pose.
            R_WT: (3, 3) axes of the path: along, to the left, and up.
            initial: the initial pose.

        Returns:
            A record of `QUERY`; and the estimated pose X_WS (4, 4), or None. A
            scan with too few points has no pose.
        """
        measured = cropped(scan, MAX_RANGE)
        points = downsample(measured, self.settings.scan_voxel)
        row = _record_of_start(frame, stamp_ns, initial)
        if len(points) < FEWEST_POINTS:
            return row, None
        begin = time.process_time()
        found = self.estimator(
            self.surroundings, points, measured, initial.X_WS
        )
        row["seconds"] = time.process_time() - begin
        row["iterations"], end = found.iterations, found.X_WS
        far = self.surroundings.distances(poses.transform(X_WS, points))
        row["unmapped"] = np.mean(far > self.settings.voxel)
        if end is not None:
            fit = fit_at(self.surroundings.surface, points, end)
            row["own_score"] = fit.share if found.score is None else found.score
            row["fit"], row["residual"] = fit.share, fit.residual
            _record_errors(row, end, fit.covariance, X_WS, R_WT)
        return row, end


def _record_of_start(
    frame: int, stamp_ns: int, initial: InitialPose
) -> np.ndarray:
    """Returns a record of `QUERY` in which only the initial pose is known.

    Args:
        frame: number of the scan.
        stamp_ns: time of the scan [ns].
        initial: the initial pose.
    """
    row = np.zeros((), QUERY)
    for name in MEASURED:
        row[name] = np.nan
    row["own_score"] = row["fit"] = -math.inf
    row["frame"], row["stamp_ns"] = frame, stamp_ns
    turn_deg = np.degrees(initial.turn)
    for k, axis in enumerate("xyz"):
        row[f"start_{axis}"] = initial.offset[k]
        row[f"start_turn_{axis}_deg"] = turn_deg[k]
    return row


def _record_errors(
    row: np.ndarray,
    found: np.ndarray,
    covariance: np.ndarray,
    X_WS: np.ndarray,
    R_WT: np.ndarray,
) -> None:
    """Enters the errors of an estimated pose into its record of `QUERY`.

    Args:
        row: the record.
        found: (4, 4) estimated pose of S in W.
        covariance: (6, 6) covariance of the estimate, see `Fit`.
        X_WS: (4, 4) ground-truth pose.
        R_WT: (3, 3) axes of the path.
    """
    row["translation_error"], row["rotation_error_deg"] = pose_error(
        found, np.eye(4), X_WS
    )
    errors = R_WT.T @ (found[:3, 3] - X_WS[:3, 3])
    spread = R_WT.T @ covariance[3:, 3:] @ R_WT
    for k, name in enumerate(("along", "across", "up")):
        row[name] = errors[k]
        row[f"std_{name}"] = math.sqrt(spread[k, k])


# The localisers in a forked process.
_localisers: Sequence[Localiser]


def _localise_from_all_starts(
    starts: Sequence[Starts],
    frame: int,
    stamp_ns: int,
    scan: np.ndarray,
    X_WS: np.ndarray,
    R_WT: np.ndarray,
) -> list[np.ndarray]:
    """Returns a record for each localiser and each initial pose of a scan.

    The localisers are those of the process. For the other arguments, see
    `Localiser.query`.

    Args:
        starts: how the initial poses are sampled.
    """
    found = []
    for localiser in _localisers:
        for drawn in starts:
            initial = InitialPose.moved(X_WS, *drawn.draw(frame))
            row, _ = localiser.query(frame, stamp_ns, scan, X_WS, R_WT, initial)
            found.append(row)
    return found


def localise(
    localisers: Sequence[Localiser],
    query: Drive,
    frames: Sequence[int],
    starts: Sequence[Starts],
    jobs: int = 1,
) -> list[np.ndarray]:
    """Localises scans of a drive, each independently of the others.

    Each scan is read once.

    Args:
        localisers: maps with their estimators.
        query: the drive.
        frames: frames of the scans, in any order.
        starts: how the initial poses are sampled.
        jobs: number of processes, where the system can fork.

    Returns:
        For each localiser and each entry of `starts`, (K,) records of `QUERY`,
        in the order of the frames. The records of the first localiser come
        first.

    Raises:
        InputError: a scan cannot be read.
    """
    global _localisers
    X_WS, stamps = query.X_WS, query.stamps_ns
    R_WT = path_axes(X_WS[:, :3, 3], X_WS)
    jobs = max(1, min(jobs, len(frames)))

    def arguments(frame: int) -> tuple:
        """Returns what `_localise_from_all_starts` needs for a frame."""
        scan = query.scan(frame)
        # Only the coordinates are passed on: a scan would be copied to the
        # process with all its fields.
        scan = clouds.from_xyz(clouds.xyz(scan))
        stamp_ns = int(stamps[frame])
        return starts, frame, stamp_ns, scan, X_WS[frame], R_WT[frame]

    def rows() -> Iterator[list[np.ndarray]]:
        """Yields the records of each frame, in order."""
        if jobs == 1 or "fork" not in multiprocessing.get_all_start_methods():
            for frame in frames:
                yield _localise_from_all_starts(*arguments(frame))
            return
        context = multiprocessing.get_context("fork")
        with ProcessPoolExecutor(jobs, context) as pool:
            for first in range(0, len(frames), _WAITING * jobs):
                batch = frames[first : first + _WAITING * jobs]
                waiting = [
                    pool.submit(_localise_from_all_starts, *arguments(f))
                    for f in batch
                ]
                for future in waiting:
                    yield future.result()

    _localisers = localisers
    with errors_at(query.name):
        done = list(
            track(rows(), f"localising {query.name}", len(frames), "scans")
        )
    return [
        np.array(list(records), QUERY) for records in zip(*done, strict=True)
    ]


def query_frames(
    query: Drive, is_mapped: np.ndarray, spacing: float
) -> list[int]:
    """Returns the frames of a query drive that are localised in the map.

    Args:
        query: the drive of N frames.
        is_mapped: (N,) bool, whether a frame lies within the map.
        spacing: distance driven between two chosen frames [m].

    Returns:
        Increasing frame numbers, at least one.
    """
    frames = sample_frames(query.X_WS[:, :3, 3], spacing)
    chosen = frames[is_mapped[frames]]
    # A short pass through the map may lie between two sampled frames.
    return (chosen if len(chosen) else np.flatnonzero(is_mapped)[:1]).tolist()
