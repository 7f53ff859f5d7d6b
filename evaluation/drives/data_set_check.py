"""Public checks of data sets, as scikit-learn has for estimators."""

from collections.abc import Callable, Iterator, Mapping
import functools
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from cns_drake.base import InputError, errors_at, poses
from cns_drake.drives import Drive
from cns_drake.units import check_preset
from evaluation.drives.opening import open_drive

# How many scans are read, spread over the drive.
_NUM_SCANS = 8
# Greatest time between two scans that is plausible for a LiDAR [s].
_LONGEST_STEP = 60.0
# Least time [s].
_SHORTEST_STEP = 1e-3
# Greatest plausible speed of a vehicle [m/s].
_FASTEST = 100.0
# Plausible range of the median point [m].
_RANGES = (0.5, 500.0)
# The ground is looked for between these distances [m], in layers of this
# height [m].
_GROUND = (3.0, 30.0)
_LAYER = 0.25
# The ground lies at most this far above a LiDAR [m].
_HIGHEST_GROUND = 1.0
# Two scans are compared if the LiDAR moved or turned by this much [m], [rad]:
# near scans have most points in common, far ones show a fault more clearly.
_LEAST_MOVES = ((1.0, np.radians(5.0)), (10.0, np.radians(30.0)))
# Scans that are farther apart have too few points in common [m].
_FARTHEST_MOVE = 25.0
# Number of points that are compared, at most and at least.
_COMPARED = 1500
_FEWEST = 100
# Points that are so much higher than the ground's layer are not the ground's
# [m].
_GROUND_MARGIN = 0.5
_METRES_PER_FOOT = 0.3048
# Other poses are right if points then lie nearer by this factor.
_NEARER = 0.5
_AS_GIVEN = "nothing is wrong"
_MIRROR_Y = np.diag([1.0, -1.0, 1.0, 1.0])


def check_data_set(path: Path | str) -> None:
    """Checks that a drive of your own can be used by all programs.

    The checks, `data_set_checks`, open the drive and read some of its scans.
    They look for what readers often confuse, such as units, the axes of a frame
    and inverted poses. Points whose coordinates are not finite are beams
    without a return: they are allowed, and left out, as in all programs.

    Args:
        path: a drive, as `open_drive` takes it.

    Raises:
        InputError: the drive cannot be read, or something is wrong or not
            plausible. The error says in one line what it is.

    Example:
        from evaluation import check_data_set

        check_data_set("recordings/downtown_01")
    """
    drive = open_drive(Path(path))
    with errors_at(path, f"{drive.name}: "):
        for check in data_set_checks:
            check(drive)


_Faults = Callable[[Drive], Iterator[str]]
_Check = Callable[[Drive | Path | str], None]


def _check(*first: _Check) -> Callable[[_Faults], _Check]:
    """Returns a decorator: a function that yields faults becomes a check.

    Args:
        first: checks whose faults come first: they would spoil this one.
    """

    def made(faults: _Faults) -> _Check:
        @functools.wraps(faults)
        def check(drive: Drive | Path | str) -> None:
            opened = (
                drive if isinstance(drive, Drive) else open_drive(Path(drive))
            )
            for one in first:
                one(opened)
            for fault in faults(opened):
                raise InputError(f"{opened.name}: {fault}")

        return check

    return made


@_check()
def check_names(drive: Drive) -> Iterator[str]:
    """The drive has a name, and its LiDAR is known if it has one."""
    if not (drive.name.strip() and drive.name.isprintable()):
        yield f"name: {drive.name!r} is no name"
    lidars = (drive.scenario or {}).get("lidars", {})
    if not isinstance(lidars, Mapping) or not all(
        isinstance(one, Mapping) for one in lidars.values()
    ):
        yield "lidars: not a mapping of names to LiDARs"
        return
    preset = drive.lidar_section.get("preset")
    if preset is not None and drive.lidar_field is None:
        try:
            check_preset(str(preset))
        except ValueError as error:
            yield f"lidars: preset: {error}"


@_check()
def check_times(drive: Drive) -> Iterator[str]:
    """Two scans at least, in increasing times in nanoseconds."""
    number, stamps_ns = len(drive), drive.stamps_ns
    if number < 2:
        yield f"scans: {number} instead of two at least"
        return
    if stamps_ns.shape != (number,) or stamps_ns.dtype != np.int64:
        yield (
            f"times: {stamps_ns.dtype} of shape {stamps_ns.shape} instead of"
            f" int64 ({number},)"
        )
        return
    steps = np.diff(stamps_ns)
    if (steps <= 0).any():
        frame = int((steps <= 0).argmax()) + 1
        yield f"times: scan {frame} is not later than the scan before"
    step = float(np.median(steps)) * 1e-9
    if not _SHORTEST_STEP <= step <= _LONGEST_STEP:
        yield (
            f"times: a scan every {step:g} s; are they in nanoseconds, as they"
            " must be?"
        )


@_check()
def check_poses(drive: Drive) -> Iterator[str]:
    """Each scan has a finite rigid pose."""
    number, X_WS = len(drive), drive.X_WS
    if X_WS.shape != (number, 4, 4):
        yield f"poses: of shape {X_WS.shape}, not ({number}, 4, 4)"
        return
    for frame, X in enumerate(X_WS):
        if not poses.is_pose(X):
            yield f"poses: that of scan {frame} is no finite rigid pose"
            return
    if (np.abs(X_WS[:, :3, 3]) >= poses.FARTHEST).any():
        yield "poses: too far from the origin"


@_check(check_times, check_poses)
def check_motion(drive: Drive) -> Iterator[str]:
    """A vehicle can move as the poses say, and the LiDAR's z axis points up."""
    p_WS = drive.X_WS[:, :3, 3]
    steps = np.linalg.norm(np.diff(p_WS, axis=0), axis=1)
    speed = float(np.median(steps / (np.diff(drive.stamps_ns) * 1e-9)))
    if speed > _FASTEST:
        yield (
            f"poses: the LiDAR moves at {speed:.0f} m/s; are positions in"
            " metres, and times in nanoseconds?"
        )
    if float(np.median(drive.X_WS[:, 2, 2])) < 0.0:
        yield "poses: the LiDAR's z axis points down; it must point up"


def _some_frames(drive: Drive) -> list[int]:
    frames = np.linspace(0, len(drive) - 1, _NUM_SCANS)
    return np.unique(frames.astype(int)).tolist()


@_check(check_times)
def check_scans(drive: Drive) -> Iterator[str]:
    """A scan has x, y and z, and the same points each time it is read."""
    for frame in _some_frames(drive):
        scan = drive.scan(frame)
        names = scan.dtype.names or ()
        if scan.ndim != 1 or not {"x", "y", "z"} <= set(names):
            yield f"scan {frame}: no array of points with x, y and z"
        again = drive.scan(frame)
        if scan.dtype != again.dtype or scan.tobytes() != again.tobytes():
            yield f"scan {frame}: other points when it is read again"


def _clouds(drive: Drive) -> dict[int, np.ndarray]:
    """Returns frame -> points (N, 3) of some scans."""
    return {one: _returns(drive.scan(one)) for one in _some_frames(drive)}


@_check(check_scans)
def check_points(drive: Drive) -> Iterator[str]:
    """Points are in metres, and the ground is below the LiDAR."""
    clouds = _clouds(drive)
    empty = [frame for frame, cloud in clouds.items() if not len(cloud)]
    if len(empty) == len(clouds):
        yield f"scans: without points (scan {empty[0]} and others)"
        return
    points = np.concatenate(list(clouds.values()))
    median = float(np.median(np.linalg.norm(points, axis=1)))
    if not _RANGES[0] <= median <= _RANGES[1]:
        yield (
            f"scans: half of the points lie within {median:g} m; are the"
            " coordinates in metres?"
        )
    height = _fullest_height(points)
    if height is not None and height > _HIGHEST_GROUND:
        yield (
            f"scans: most points lie {height:.1f} m above the LiDAR, where no"
            " ground is; does the z axis point up?"
        )


def _returns(scan: np.ndarray) -> np.ndarray:
    """Returns the points (N, 3) of a scan, without beams that missed.

    Many drivers give such beams coordinates that are not finite; whoever reads
    a drive leaves them out.
    """
    points = np.stack([scan[axis].astype(np.float64) for axis in "xyz"], axis=1)
    return points[np.isfinite(points).all(axis=1)]


def _fullest_height(points: np.ndarray) -> float | None:
    """Returns the lower end of the layer with most points (N, 3) [m].

    It is the ground as a rule. None if no point is near.
    """
    distances = np.hypot(points[:, 0], points[:, 1])
    around = points[(distances > _GROUND[0]) & (distances < _GROUND[1]), 2]
    if not len(around):
        return None
    layers, counts = np.unique(
        np.floor(around / _LAYER).astype(int), return_counts=True
    )
    return float(layers[counts.argmax()] * _LAYER)


def _above_ground(points: np.ndarray) -> np.ndarray:
    """Returns the points (N, 3) that lie above the ground.

    Rings on a flat ground move with the LiDAR, and so say nothing of poses.
    """
    height = _fullest_height(points)
    if height is None:
        return points
    return points[points[:, 2] > height + _LAYER + _GROUND_MARGIN]


@_check(check_scans, check_poses)
def check_frames(drive: Drive) -> Iterator[str]:
    """Scans fit later ones as the poses place them, and in no other way."""
    trees = {
        frame: KDTree(above)
        for frame, cloud in _clouds(drive).items()
        if len(above := _above_ground(cloud)) >= _FEWEST
    }
    for least_move in _LEAST_MOVES:
        gaps = _gaps(drive, trees, *least_move)
        given = gaps.pop(_AS_GIVEN, 0.0)
        best = min(gaps, key=lambda name: gaps[name], default=_AS_GIVEN)
        if best in gaps and gaps[best] < _NEARER * given:
            yield (
                "poses: neighbouring scans fit better"
                f" ({gaps[best]:.2f} m instead of {given:.2f} m) if {best}"
            )


# What `check_data_set` checks, for `pytest.mark.parametrize`: functions of a
# drive, or of its path, each of which raises an InputError.
data_set_checks: list[_Check] = [
    check_names,
    check_times,
    check_poses,
    check_motion,
    check_scans,
    check_points,
    check_frames,
]


def _gaps(
    drive: Drive,
    trees: Mapping[int, KDTree],
    least_move: float,
    least_turn: float,
) -> dict[str, float]:
    """Returns how far scans lie from later ones, by what may be wrong [m].

    Args:
        drive: the drive.
        trees: frame -> the points of its scan above the ground.
        least_move, least_turn: see `_moved_frame`.
    """
    found: dict[str, list[float]] = {}
    rng = np.random.default_rng(0)
    for frame, tree in trees.items():
        other = _moved_frame(drive.X_WS, frame, least_move, least_turn)
        if other is None:
            continue
        beside = _above_ground(_returns(drive.scan(other)))
        if len(beside) < _FEWEST:
            continue
        some = beside[rng.permutation(len(beside))[:_COMPARED]]
        placed = _placements(drive.X_WS[frame], drive.X_WS[other])
        for name, X_there in placed.items():
            moved = some @ X_there[:3, :3].T + X_there[:3, 3]
            distance, _ = tree.query(moved)
            found.setdefault(name, []).append(float(np.median(distance)))
    return {name: float(np.mean(some)) for name, some in found.items()}


def _placements(X_WA: np.ndarray, X_WB: np.ndarray) -> dict[str, np.ndarray]:
    """Returns where a scan B lies beside a scan A, by what may be wrong.

    Args:
        X_WA, X_WB: (4, 4) poses of the LiDAR, as given.

    Returns:
        What is wrong -> the map (4, 4) from points of B to points of A.
    """
    X_AB = poses.inverse(X_WA) @ X_WB
    in_feet = X_AB.copy()
    in_feet[:3, 3] /= _METRES_PER_FOOT
    transposed = [X_WA.copy(), X_WB.copy()]
    for X in transposed:
        X[:3, :3] = X[:3, :3].T
    found = {
        _AS_GIVEN: X_AB,
        "the poses are inverted: X_SW instead of X_WS?": (
            X_WA @ poses.inverse(X_WB)
        ),
        "their rotations are transposed": (
            poses.inverse(transposed[0]) @ transposed[1]
        ),
        "the points of all scans are in one frame already": np.eye(4),
        "the points are in feet, and the poses in metres": in_feet,
        "y is mirrored: a left-handed frame?": _MIRROR_Y @ X_AB @ _MIRROR_Y,
    }
    for axis, yaw_deg in (("left", 90), ("right", -90), ("back", 180)):
        # X_SC, where C is the frame of the points.
        X_SC = poses.yaw_pose(np.radians(yaw_deg), 0.0, 0.0)
        found[f"the points' x axis points to the {axis}"] = (
            poses.inverse(X_SC) @ X_AB @ X_SC
        )
    return found


def _moved_frame(
    X_WS: np.ndarray, frame: int, least_move: float, least_turn: float
) -> int | None:
    """Returns the next scan from a pose that differs enough, or None.

    Args:
        X_WS: (N, 4, 4) poses of the LiDAR.
        frame: number of a scan.
        least_move, least_turn: one of both is enough [m], [rad].
    """
    X = poses.inverse(X_WS[frame]) @ X_WS[frame + 1 :]
    moves = np.linalg.norm(X[:, :3, 3], axis=1)
    turns = np.arccos(
        np.clip((np.trace(X[:, :3, :3], axis1=1, axis2=2) - 1) / 2, -1.0, 1.0)
    )
    far = np.flatnonzero((moves >= least_move) | (turns >= least_turn))
    if not len(far) or moves[far[0]] > _FARTHEST_MOVE:
        return None
    return frame + 1 + int(far[0])
