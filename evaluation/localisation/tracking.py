"""Tracks a drive in a map: each scan is registered from the last estimate."""

from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import InputError, poses, track
from evaluation.drives import Drive, sample_frames, travelled
from evaluation.localisation.initial_poses import InitialPose, Starts
from evaluation.localisation.localiser import Localiser, Query, path_axes
from evaluation.localisation.results import (
    COLUMNS,
    QUERY,
    RIGHT_TRANSLATION,
    Localised,
)

# Distance driven between two aligned scans [m].
SPACING = 2.0
# A vehicle with a greater error is lost [m].
LOST = 2.0
# The drift of the odometry changes after this length of path [m].
_DRIFT_LENGTH = 100.0
# Drift of the heading in deg/m, relative to the drift as a share: a drift of 1
# % in length goes with 0.01 deg/m.
_TURN_OF_DRIFT_DEG = 1.0
_DRIFT_SEED = 5

TRACKED = np.dtype(
    [
        ("stretch", "<i8"),
        *((name, "<f8") for name in ("way", "step", "track_error")),
        *QUERY.descr,
    ]
)


def drifting_steps(
    X_WS: np.ndarray, way: np.ndarray, drift: float, seed: int
) -> np.ndarray:
    """Returns the motion between poses as a drifting odometry measures it.

    The odometry has a relative error of lengths, and a drift of the heading
    [deg/m]. Error and drift are sampled anew every 100 m of path, from normal
    distributions of mean 0 and standard deviation `drift`.

    Args:
        X_WS: (N, 4, 4) ground-truth poses of the LiDAR.
        way: (N,) length of the path up to each pose [m].
        drift: standard deviation of both errors; 0 for none. For example, 0.01
            means 1 % of each length and 0.01 deg/m of heading.
        seed: seed of the random numbers.

    Returns:
        (N - 1, 4, 4) pose of the LiDAR in its frame at the previous pose.
    """
    steps = poses.inverse(X_WS[:-1]) @ X_WS[1:]
    part = (way[1:] // _DRIFT_LENGTH).astype(np.int64)
    rng = np.random.default_rng([seed, _DRIFT_SEED])
    length_error, turn_rate_deg = (
        drift * rng.normal(size=(int(part[-1]) + 1, 2))[part].T
    )
    steps[:, :3, 3] *= 1.0 + length_error[:, None]
    turn = np.radians(_TURN_OF_DRIFT_DEG * turn_rate_deg * np.diff(way))
    # The vertical of the world, in the LiDAR's frame.
    up_S = X_WS[:-1, 2, :3]
    R = Rotation.from_rotvec(turn[:, None] * up_S).as_matrix()
    steps[:, :3, :3] = R @ steps[:, :3, :3]
    steps[:, :3, 3] = np.einsum("nij,nj->ni", R, steps[:, :3, 3])
    return steps


def track_drive(
    localiser: Localiser,
    query: Drive,
    is_mapped: np.ndarray,
    starts: Starts,
    drift: float,
) -> np.ndarray:
    """Tracks a drive along each section of its path that the map covers.

    In each section, the initial pose of the first scan is random. The initial
    pose of each later scan is the last estimate, moved by the odometry.

    Args:
        localiser: the map and the estimator.
        query: the drive.
        is_mapped: (N,) bool, which frames lie within the map.
        starts: how the initial pose of a section's first scan is sampled.
        drift: see `drifting_steps`.

    Returns:
        (K,) records of `TRACKED`. Before the fields of `QUERY`, each record
        contains the number of the section; the lengths of path since the
        drive's first scan and since the previous scan [m]; and the error of the
        tracked position [m]. The tracked position is the result of the
        alignment, or the position by odometry if the alignment has no result.

    Raises:
        InputError: a scan cannot be read, or fewer than two scans lie within
            the map.
    """
    X_WS = query.X_WS
    way = travelled(X_WS[:, :3, 3])
    R_WT = path_axes(X_WS[:, :3, 3], X_WS)
    frames = sample_frames(X_WS[:, :3, 3], SPACING)
    frames = frames[is_mapped[frames]]
    if len(frames) < 2:
        raise InputError(
            f"{query.name}: {len(frames)} scans, {SPACING:g} m apart, in the"
            " map; a track has two and more"
        )
    steps = drifting_steps(X_WS[frames], way[frames], drift, starts.seed)
    rows = _untracked_rows(frames, is_mapped, way)
    begins = np.diff(rows["stretch"], prepend=-1) > 0
    last: np.ndarray | None = None
    for k in track(
        range(len(frames)), f"tracking {query.name}", len(frames), "scans"
    ):
        frame = int(frames[k])
        if begins[k] or last is None:
            initial = InitialPose.moved(X_WS[frame], *starts.draw(frame))
        else:
            initial = InitialPose.compared(last @ steps[k - 1], X_WS[frame])
        stamp_ns, scan = int(query.stamps_ns[frame]), query.scan(frame)
        asked = Query(frame, stamp_ns, scan, X_WS[frame], R_WT[frame])
        row, end = localiser.query(asked, initial)
        last = end
        if last is None:
            # The estimate continues by odometry.
            _, offset, turn = initial
            last = InitialPose.moved(X_WS[frame], offset, turn).X_WS
        for name in COLUMNS:
            rows[name][k] = row[name]
        rows["track_error"][k] = np.linalg.norm(
            last[:3, 3] - X_WS[frame, :3, 3]
        )
    return rows


def _untracked_rows(
    frames: np.ndarray, is_mapped: np.ndarray, way: np.ndarray
) -> np.ndarray:
    """Returns records of `TRACKED` with sections and lengths of path only.

    Args:
        frames: (K,) frames that are aligned.
        is_mapped: (N,) bool, which frames of the drive lie within the map.
        way: (N,) length of the path up to each frame [m].
    """
    rows = np.zeros(len(frames), TRACKED)
    # Between two sections, the drive left the map.
    gaps = np.add.reduceat(~is_mapped, frames)[:-1] > 0
    rows["stretch"] = np.concatenate([[0], np.cumsum(gaps)])
    rows["way"] = way[frames]
    rows["step"][1:] = np.where(gaps, 0.0, np.diff(way[frames]))
    return rows


@dataclass(frozen=True, eq=False)
class Tracked(Localised):
    """A tracked drive, which has further metrics.

    Attributes:
        rows: (K,) records of `TRACKED`.
    """

    @property
    def way(self) -> float:
        """Length of the path in the map [m]."""
        return float(self.rows["step"].sum())

    @property
    def stretches(self) -> int:
        """Number of sections of the path in the map."""
        return int(self.rows["stretch"][-1]) + 1

    @property
    def within_03m(self) -> float:
        """Share of the path on which the position is right."""
        is_near = self.rows["track_error"] <= RIGHT_TRANSLATION
        near = float(self.rows["step"][is_near].sum())
        return near / self.way if self.way else math.nan

    @cached_property
    def lost(self) -> list[tuple[float, bool]]:
        """Over which length of path the track was lost, for each loss.

        The track is lost while the position is off by more than `LOST`. Each
        loss is its length [m], and whether the track was found again. A track
        that is not found again counts as lost up to the end of the mapped
        section.
        """
        found = []
        for stretch in np.unique(self.rows["stretch"]):
            rows = self.rows[self.rows["stretch"] == stretch]
            lost = rows["track_error"] > LOST
            begins = np.flatnonzero(np.diff(lost.astype(int), prepend=0) == 1)
            for begin in begins.tolist():
                back = np.flatnonzero(~lost[begin:])
                end = begin + int(back[0]) if len(back) else len(rows) - 1
                way = float(rows["way"][end] - rows["way"][begin])
                found.append((way, bool(len(back))))
        return found

    @property
    def losses(self) -> int:
        """Number of losses."""
        return len(self.lost)

    @property
    def lost_per_km(self) -> float:
        """Number of losses per kilometre of path."""
        return 1000.0 * self.losses / self.way if self.way else math.nan

    @property
    def lost_for_good(self) -> int:
        """Number of losses after which the track is not found again."""
        return sum(not is_back for _, is_back in self.lost)

    @property
    def back_after_median(self) -> float:
        """Median length of path until the track is found again [m]."""
        back = [length for length, is_back in self.lost if is_back]
        return float(np.median(back)) if back else math.nan


def localised(rows: np.ndarray) -> Localised:
    """Returns localised scans, or a tracked drive, from their records."""
    return (Tracked if rows.dtype == TRACKED else Localised)(rows)
