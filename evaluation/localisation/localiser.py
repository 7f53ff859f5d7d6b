"""Localises single scans in a map, each from a random initial pose.

Frames: world W, LiDAR S. An error has three components relative to the
vehicle's path: along it, across it (to the left) and up.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import time
from typing import NamedTuple

import numpy as np

from evaluation.alignment import Surface, point_to_plane_hessian
from evaluation.base import InputError, errors_at, from_xyz, poses, track, xyz
from evaluation.drives import Drive, cropped, sample_frames
from evaluation.localisation.estimators import Estimator
from evaluation.localisation.initial_poses import InitialPose, Starts
from evaluation.localisation.localisation_map import (
    FEWEST_POINTS,
    LocalisationMap,
)
from evaluation.localisation.results import MEASURED, QUERY
from evaluation.localisation.settings import HALF_EXTENT, Settings
from evaluation.maps import downsample
from evaluation.recognition import pose_error

# A query is localised if the map's drive, or a point of the map's file, is this
# near to its LiDAR [m].
NEAR = 7.5
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


class Query(NamedTuple):
    """A scan to localise, with its ground truth.

    Attributes:
        frame: number of the scan.
        stamp_ns: time of the scan [ns].
        scan: structured array (N,), in S.
        X_WS: (4, 4) ground-truth pose.
        R_WT: (3, 3) axes of the path: along, to the left, and up.
    """

    frame: int
    stamp_ns: int
    scan: np.ndarray
    X_WS: np.ndarray
    R_WT: np.ndarray


def read_queries(drive: Drive, frames: Sequence[int]) -> Iterator[Query]:
    """Yields the scans of a drive to localise; each is read when its turn is.

    Args:
        drive: the drive.
        frames: frames of the scans, in any order.

    Raises:
        InputError: a scan cannot be read.
    """
    X_WS, stamps = drive.X_WS, drive.stamps_ns
    R_WT = path_axes(X_WS[:, :3, 3], X_WS)
    with errors_at(drive.name):
        for frame in frames:
            # Coordinates alone, since queries may be stored.
            scan = from_xyz(xyz(drive.scan(frame)))
            stamp_ns = int(stamps[frame])
            yield Query(frame, stamp_ns, scan, X_WS[frame], R_WT[frame])


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
        self, asked: Query, initial: InitialPose
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Localises one scan and compares the result with the ground truth.

        Args:
            asked: the scan.
            initial: the initial pose.

        Returns:
            A record of `QUERY`; and the estimated pose X_WS (4, 4), or None. A
            scan with too few points has no pose.
        """
        X_WS, R_WT = asked.X_WS, asked.R_WT
        measured = cropped(asked.scan, HALF_EXTENT)
        points = downsample(measured, self.settings.scan_voxel)
        row = _record_of_start(asked.frame, asked.stamp_ns, initial)
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
        stamp_ns: time of the scan [ns].
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
        found: (4, 4) estimated pose of S in W.
        covariance: (6, 6) covariance of the estimate, see `_Fit`.
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


def localise(
    localisers: Sequence[Localiser],
    queries: Iterable[Query],
    starts: Sequence[Starts],
    label: str,
    number: int,
) -> list[np.ndarray]:
    """Localises scans, each independently of the others.

    Args:
        localisers: maps with their estimators.
        queries: the scans, each of which is taken once.
        starts: how the initial poses are sampled.
        label: name of the scans' drive, for the progress.
        number: number of scans, for the progress.

    Returns:
        For each localiser and each entry of `starts`, (K,) records of `QUERY`,
        in the order of the queries. The records of the first localiser come
        first.
    """
    done: list[list[np.ndarray]] = [
        [] for _ in range(len(localisers) * len(starts))
    ]
    for asked in track(queries, f"localising {label}", number, "scans"):
        ends = iter(done)
        for localiser in localisers:
            for drawn in starts:
                offset, turn = drawn.draw(asked.frame)
                initial = InitialPose.moved(asked.X_WS, offset, turn)
                with errors_at(label):
                    row, _ = localiser.query(asked, initial)
                next(ends).append(row)
    return [np.array(rows, QUERY) for rows in done]


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


# A point of a scan fits if a surface of the map is this near [m].
_FIT = 0.15
# Pairs farther apart say nothing about the fit [m].
_PAIR = 1.0
# Least standard deviation from a plane [m], even where a scan fits exactly.
_ROUGHNESS = 0.01
# Standard deviation of a plane's distance if no point of the map is near [m].
_UNKNOWN = 1.0
# Least eigenvalue of a Hessian: directions without constraints get a standard
# deviation of 100 m or rad.
_LEAST_EIGENVALUE = 1e-4
# Normals are exact to 3 deg. This is the square of the component along the
# surface that such an error produces; uncorrected, it would seem to constrain a
# scan along the surface.
_NORMAL_NOISE = math.sin(math.radians(3.0)) ** 2


@dataclass(frozen=True)
class _Fit:
    """The fit of a scan at a pose.

    Attributes:
        share: share of the scan's points that lie on a surface of the map.
        residual: root mean square distance of the scan's points from the planes
            at the nearest points of the map [m]. Points of the scan more than 1
            m from the map do not count; NaN if no point counts.
        covariance: (6, 6) covariance of a small motion about the LiDAR, in axes
            of W: rotation [rad], translation [m]. The covariance is the inverse
            Hessian of the point-to-plane error, corrected for the noise of the
            normals, times the square of the residual (at least 0.01 m).
    """

    share: float
    residual: float
    covariance: np.ndarray


def fit_at(surface: Surface, scan: np.ndarray, X_WS: np.ndarray) -> _Fit:
    """Returns how well a scan fits a map at a given pose, see `_Fit`.

    Args:
        surface: surface of the map.
        scan: (N, 3) points in the LiDAR's frame S [m].
        X_WS: (4, 4) the pose.
    """
    p_W = poses.transform(X_WS, scan)
    found, squares = surface.tree.batch_nearest_neighbor_search(p_W)
    is_pair = np.asarray(squares) < _PAIR**2
    nearest = np.asarray(found, dtype=np.int64)[is_pair]
    n_W = surface.normals[nearest]
    off = np.einsum("ni,ni->n", n_W, p_W[is_pair] - surface.points[nearest])
    arms = p_W[is_pair] - X_WS[:3, 3]
    residual, sigma = math.nan, _UNKNOWN
    if len(off):
        residual = math.sqrt(np.mean(off**2))
        sigma = max(residual, _ROUGHNESS)
    return _Fit(
        float(np.count_nonzero(np.abs(off) < _FIT) / len(scan)),
        residual,
        _bounded_inverse(_corrected_hessian(arms, n_W) / sigma**2),
    )


def _corrected_hessian(arms: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Returns the point-to-plane Hessian (6, 6) without the noise of normals.

    Args:
        arms: (N, 3) vectors from the LiDAR to the points, in W [m].
        normals: (N, 3) unit normals of the planes at the points, in W.
    """
    H = point_to_plane_hessian(arms, normals)
    for axis in np.eye(3):
        H -= _NORMAL_NOISE * point_to_plane_hessian(
            arms, np.broadcast_to(axis, arms.shape)
        )
    return H


def _bounded_inverse(H: np.ndarray) -> np.ndarray:
    """Returns the inverse of a Hessian (6, 6), with bounded eigenvalues."""
    values, vectors = np.linalg.eigh(H)
    return vectors / np.maximum(values, _LEAST_EIGENVALUE) @ vectors.T
