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
from scipy.spatial.transform import Rotation

from cns_drake.base import points as clouds
from cns_drake.base import poses
from cns_drake.base.csv_files import write_csv
from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError, errors_at
from cns_drake.base.json_text import json_values
from cns_drake.base.progress import track
from evaluation.clouds.cloud_files import read_cloud
from evaluation.clouds.notes import OnNote
from evaluation.drives.sampling import cropped, sample_frames
from evaluation.drives.scan_files import FileDrive
from evaluation.localisation.estimators import (
    FEWEST_POINTS,
    Estimator,
    LocalisationMap,
    Settings,
    fit_at,
)
from evaluation.localisation.robust import MAX_RANGE
from evaluation.maps.voxel_maps import thin
from evaluation.recognition.auroc import auroc
from evaluation.recognition.number import Number
from evaluation.recognition.pose_errors import (
    SUCCESS_ROTATION_DEG,
    SUCCESS_TRANSLATION,
    pose_error,
)

# Results with errors of at most these are right [m, deg].
RIGHT_TRANSLATION = 0.3
RIGHT_ROTATION_DEG = 1.0
# Greatest distance of a start [m]; beyond it lies place recognition.
FARTHEST_START = 50.0
# A query is localised if the map's drive, or a point of the map's file, is this
# near to its LiDAR [m].
NEAR = 7.5
# Numbers of the summary that go into a table of results.
_SHOWN = (
    "success_03m_1deg",
    "success_2m_5deg",
    "translation_median",
    "translation_95",
    "rotation_median_deg",
    "auroc_own_score",
)
# Share of the right results whose scores pass the suggested threshold.
_BELIEVED = 0.95
# Number of queries that wait, per process.
_WAITING = 4

# One row per query: its frame and time; the start's offset in W [m], and its
# turn as a rotation vector in S; errors of the result; scores; standard
# deviations of the result from its covariance [m]; the share of the scan that,
# at the ground-truth pose, has no point of the map within a voxel, NaN if the
# scan has too few points to be aligned; number of steps, and CPU time [s].
QUERY = np.dtype(
    [
        ("frame", "<i8"),
        ("stamp_ns", "<i8"),
        *(
            (name, "<f8")
            for name in (
                "start_x",
                "start_y",
                "start_z",
                "start_turn_x_deg",
                "start_turn_y_deg",
                "start_turn_z_deg",
                "translation_error",
                "rotation_error_deg",
                "along",
                "across",
                "up",
                "own_score",
                "fit",
                "residual",
                "std_along",
                "std_across",
                "std_up",
                "unmapped",
            )
        ),
        ("iterations", "<i8"),
        ("seconds", "<f8"),
    ]
)
COLUMNS = tuple(QUERY.fields or ())


@dataclass(frozen=True)
class Starts:
    """How the random initial poses of scans are sampled.

    Attributes:
        radius: distance of each initial position from the ground-truth position
            [m].
        turn_deg: angle between each initial orientation and the ground truth
            [deg].
        seed: seed of the random directions in which initial poses are moved and
            rotated.

    Raises:
        InputError: if a value is out of range.
    """

    radius: float
    turn_deg: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.radius <= FARTHEST_START:
            raise InputError(
                f"--start: {self.radius:g} m is not above 0 and up to"
                f" {FARTHEST_START:g}"
            )
        if not 0.0 <= self.turn_deg <= 180.0:
            raise InputError(
                f"--start-turn: {self.turn_deg:g} deg is not from 0 to 180"
            )
        if self.seed < 0:
            raise InputError(f"--seed: {self.seed} is below 0")

    def draw(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Returns the random error of a frame's initial pose.

        Returns:
            (3,) offset of the position in W, in a random direction [m]; (3,)
            rotation about a random axis, as a rotation vector in S [rad].
            Offset and rotation depend only on the seed and the frame.
        """
        rng = np.random.default_rng([self.seed, frame])
        offset, axis = rng.normal(size=(2, 3))
        return (
            self.radius * offset / np.linalg.norm(offset),
            math.radians(self.turn_deg) * axis / np.linalg.norm(axis),
        )


class OneScan(FileDrive):
    """A point cloud that is read as a drive: one scan at the origin of W."""

    def __init__(self, path: Path, columns: int | None = None):
        """Opens the point cloud.

        Args:
            path: its file.
            columns: number of columns of a `.bin` file; by default guessed from
                the values.
        """
        notes: list[str] = []
        scan = read_cloud(path, columns, notes.append)
        super().__init__(
            name=path.name,
            world_frame="map",
            files=[path],
            stamps_ns=np.zeros(1, np.int64),
            X_WS=np.eye(4)[None],
            read=lambda path, stamp_ns: scan,
            notes=tuple(notes),
        )

    def scan(self, index: int) -> np.ndarray:
        """Returns all points of the cloud, including points at the origin.

        Other drives leave out points at the origin, which stand for beams
        without a return. In this cloud, such a point can be real.
        """
        return self._read(self._files[index], 0)


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


def way_axes(p_WS: np.ndarray, X_WS: np.ndarray) -> np.ndarray:
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
    stands = np.linalg.norm(along, axis=1) < 1e-3
    along[stands] = X_WS[stands, :3, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.cross([0.0, 0.0, 1.0], along)
    # A path straight up has no direction to the left.
    steep = np.linalg.norm(left, axis=1) < 1e-6
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
        offset: np.ndarray,
        turn: np.ndarray,
        X_WS0: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Localises one scan and compares the result with the ground truth.

        Args:
            frame: number of the scan.
            stamp_ns: time of the scan [ns].
            scan: structured array, in S.
            X_WS: (4, 4) ground-truth pose.
            R_WT: (3, 3) axes of the path: along, to the left, and up.
            offset: (3,) vector from the ground-truth to the initial position,
                in W [m].
            turn: (3,) rotation vector from the ground-truth to the initial
                orientation, in S [rad].
            X_WS0: the initial pose; by default it follows from `offset` and
                `turn`.

        Returns:
            A record of `QUERY`; and the estimated pose X_WS (4, 4), or None. A
            scan with too few points has no pose.
        """
        if X_WS0 is None:
            R = Rotation.from_rotvec(turn).as_matrix()
            X_WS0 = poses.make_pose(X_WS[:3, :3] @ R, X_WS[:3, 3] + offset)
        measured = cropped(scan, MAX_RANGE)
        points = thin(measured, self.settings.scan_voxel)
        row = np.zeros((), QUERY)
        for name in COLUMNS[8:-2]:
            row[name] = np.nan
        row["own_score"] = row["fit"] = -math.inf
        row["frame"], row["stamp_ns"] = frame, stamp_ns
        for axis, o, t in zip("xyz", offset, np.degrees(turn), strict=True):
            row[f"start_{axis}"], row[f"start_turn_{axis}_deg"] = o, t
        if len(points) < FEWEST_POINTS:
            return row, None
        begin = time.process_time()
        found = self.estimator(self.surroundings, points, measured, X_WS0)
        row["seconds"] = time.process_time() - begin
        row["iterations"], end = found.iterations, found.X_WS
        far = self.surroundings.distances(poses.transform(X_WS, points))
        row["unmapped"] = np.mean(far > self.settings.voxel)
        if end is not None:
            fit = fit_at(self.surroundings.surface, points, end)
            row["own_score"] = fit.share if found.score is None else found.score
            row["fit"], row["residual"] = fit.share, fit.residual
            row["translation_error"], row["rotation_error_deg"] = pose_error(
                end, np.eye(4), X_WS
            )
            errors = R_WT.T @ (end[:3, 3] - X_WS[:3, 3])
            spread = R_WT.T @ fit.covariance[3:, 3:] @ R_WT
            for k, name in enumerate(("along", "across", "up")):
                row[name] = errors[k]
                row[f"std_{name}"] = math.sqrt(spread[k, k])
        return row, end


# The localisers in a forked process.
_localisers: Sequence[Localiser]


def _query(
    starts: Sequence[Starts],
    frame: int,
    stamp_ns: int,
    scan: np.ndarray,
    X_WS: np.ndarray,
    R_WT: np.ndarray,
) -> list[np.ndarray]:
    """Returns a record for each localiser and each of its initial poses."""
    found = []
    for localiser in _localisers:
        for some in starts:
            drawn = some.draw(frame)
            row, _ = localiser.query(frame, stamp_ns, scan, X_WS, R_WT, *drawn)
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
    R_WT = way_axes(X_WS[:, :3, 3], X_WS)
    jobs = max(1, min(jobs, len(frames)))

    def arguments(frame: int) -> tuple:
        scan = query.scan(frame)
        # Only the coordinates are passed on: a scan would be copied to the
        # process with all its fields.
        scan = clouds.from_xyz(clouds.xyz(scan))
        stamp_ns = int(stamps[frame])
        return starts, frame, stamp_ns, scan, X_WS[frame], R_WT[frame]

    def rows() -> Iterator[list[np.ndarray]]:
        if jobs == 1 or "fork" not in multiprocessing.get_all_start_methods():
            for frame in frames:
                yield _query(*arguments(frame))
            return
        context = multiprocessing.get_context("fork")
        with ProcessPoolExecutor(jobs, context) as pool:
            for first in range(0, len(frames), _WAITING * jobs):
                some = frames[first : first + _WAITING * jobs]
                waiting = [pool.submit(_query, *arguments(f)) for f in some]
                for one in waiting:
                    yield one.result()

    _localisers = localisers
    with errors_at(query.name):
        done = list(
            track(rows(), f"localising {query.name}", len(frames), "scans")
        )
    return [np.array(list(some), QUERY) for some in zip(*done, strict=True)]


def is_right(
    rows: np.ndarray,
    translation: float = RIGHT_TRANSLATION,
    rotation_deg: float = RIGHT_ROTATION_DEG,
) -> np.ndarray:
    """Returns which results have errors within given limits, (K,) bool.

    Args:
        rows: (K,) results, records of `QUERY`.
        translation: greatest error of the position [m].
        rotation_deg: greatest error of the orientation [deg].
    """
    return (rows["translation_error"] <= translation) & (
        rows["rotation_error_deg"] <= rotation_deg
    )


def note_sparse(name: str, rows: np.ndarray, on_note: OnNote) -> None:
    """Notes how many scans had too few points to be aligned, if any.

    Args:
        name: name of the query drive.
        rows: (K,) results, records of `QUERY`.
        on_note: is called with the note.
    """
    if sparse := np.count_nonzero(np.isnan(rows["unmapped"])):
        on_note(
            f"{name}: {sparse} of {len(rows)} scans have fewer than"
            f" {FEWEST_POINTS} points after thinning; they count as"
            " failures"
        )


def _believed_from(rows: np.ndarray) -> float:
    """Returns the score that 95 % of the right results reach, or NaN."""
    scores = rows["own_score"][is_right(rows)]
    if len(scores) == 0:
        return math.nan
    return float(np.quantile(scores, 1.0 - _BELIEVED, method="lower"))


def summary(rows: np.ndarray) -> dict[str, float | int | None]:
    """Returns a summary of localised scans, for JSON.

    Success rates count all queries; quantiles count queries with a pose.

    Args:
        rows: (K,) results, records of `QUERY`.
    """
    right = is_right(rows)
    posed = rows[~np.isnan(rows["translation_error"])]

    def quantile(name: str, part: float) -> float | None:
        values = np.abs(posed[name])
        return float(np.quantile(values, part)) if len(values) else None

    least = _believed_from(rows)
    believed = rows["own_score"] >= least
    near = is_right(rows, SUCCESS_TRANSLATION, SUCCESS_ROTATION_DEG)
    found: dict[str, float | int | None] = {
        "queries": len(rows),
        "without_pose": len(rows) - len(posed),
        "success_03m_1deg": float(right.mean()),
        "success_2m_5deg": float(near.mean()),
        "translation_median": quantile("translation_error", 0.5),
        "translation_95": quantile("translation_error", 0.95),
        "rotation_median_deg": quantile("rotation_error_deg", 0.5),
        "rotation_95_deg": quantile("rotation_error_deg", 0.95),
    }
    for name in ("along", "across", "up"):
        found[f"{name}_median"] = quantile(name, 0.5)
        found[f"std_{name}_median"] = quantile(f"std_{name}", 0.5)
    # A small residual, or a small deviation, is a high score.
    deviation = np.max(
        [rows[f"std_{name}"] for name in ("along", "across", "up")], axis=0
    )
    for name, scores in (
        ("own_score", rows["own_score"]),
        ("fit", rows["fit"]),
        ("residual", -rows["residual"]),
        ("hessian", -deviation),
    ):
        found[f"auroc_{name}"] = auroc(scores, right)
    found["believed_from"] = least
    # Without a right result, there is no threshold.
    harmful = float((believed & ~right).sum()) if right.any() else math.nan
    wrong = int((~right).sum())
    found["confident_wrong"] = harmful / len(rows)
    found["confident_of_wrong"] = harmful / wrong if wrong else None
    known = rows["unmapped"][~np.isnan(rows["unmapped"])]
    found["unmapped_mean"] = float(known.mean()) if len(known) else None
    found["seconds_mean"] = float(rows["seconds"].mean())
    return json_values(found)


def numbers(rows: np.ndarray, method: str) -> Iterator[Number]:
    """Yields a method's results for `results.csv`, a `Number` for each metric.

    Args:
        rows: (K,) results, records of `QUERY`.
        method: name of the method.
    """
    found = summary(rows)
    for name in _SHOWN:
        if (value := found[name]) is not None:
            yield Number(method, False, name, float(value), n=len(rows))


def columns(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Returns the columns of `queries.csv` from results: name -> (K,) values.

    Args:
        rows: (K,) results, records of `QUERY`.
    """
    scores = rows["own_score"]
    return {
        "query_frame": rows["frame"],
        "query_stamp_ns": rows["stamp_ns"],
        "correct": is_right(rows),
        # Queries are where the map is.
        "has_match": np.ones(len(rows), bool),
        "score": np.where(np.isfinite(scores), scores, np.nan),
        "translation_error": rows["translation_error"],
        "rotation_error_deg": rows["rotation_error_deg"],
    }


def write_rows(rows: np.ndarray, path: Path) -> None:
    """Writes results as CSV, one row per query; unknown numbers are empty."""
    cells = (
        [
            ""
            if isinstance(value, float) and not math.isfinite(value)
            else value
            for value in row
        ]
        for row in rows.tolist()
    )
    write_csv(path, rows.dtype.names or (), cells)


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
