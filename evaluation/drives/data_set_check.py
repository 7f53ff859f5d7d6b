"""Public checks of data sets, as scikit-learn has for estimators."""

from collections.abc import Callable, Iterator, Mapping, Sequence
import functools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import KDTree
import small_gicp

from evaluation.base import InputError, errors_at, note, poses, step_lengths
from evaluation.drives.data_set import check_interface
from evaluation.drives.drive import Drive
from evaluation.drives.kitti import KittiDrive
from evaluation.drives.opening import open_drive
from evaluation.lidar_sheets import check_preset

# How many scans are read, spread over the drive.
_NUM_SCANS = 8
# Greatest time between two scans that is plausible for a LiDAR [s].
_LONGEST_STEP = 60.0
# Least time [s].
_SHORTEST_STEP = 1e-3
# Times between the scans of LiDARs [s]: 1 to 100 Hz, with some margin. Not
# three powers of ten, so that only one unit can be meant.
_USUAL_STEPS = (0.009, 1.1)
_TIME_UNITS = {
    "seconds": 1.0,
    "milliseconds": 1e-3,
    "microseconds": 1e-6,
    "nanoseconds": 1e-9,
}
# A table of this name has seconds; all other times are nanoseconds.
_SECONDS = "times.txt"
# What is wrong with a drive if nothing is.
_AS_GIVEN = "nothing is wrong"
# Scans are this far from each other at most [m].
_FARTHEST_MOVE = 25.0
# Number of points that are compared at most.
_COMPARED = 3000
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
# Motion is measured from scan to scan until it is this long [m], in this many
# steps. After a small step [m], the next one has twice as many scans.
_MEASURED = 3.0
_MOST_STEPS = 6
_SMALL_STEP = 0.5
# Least number of points of a scan that is registered.
_FEWEST = 100
# Voxels of the points that are registered [m], and the greatest distances of
# pairs, one stage after the other [m].
_VOXEL = 0.3
_STAGES = (4.0, 1.5, 0.6)
# Points fit if their counterparts are this near [m], and scans if this share of
# their points fits.
_FITTING = 0.3
_FITTING_SHARE = 0.5
# A motion says something from this length on [m].
_LEAST_MOTION = 1.0
# Points that are so much higher than the ground's layer are not the ground's
# [m].
_GROUND_MARGIN = 0.5
_METRES_PER_FOOT = 0.3048
# Poses claim the measured motion if they differ by at most this share of it, or
# other poses do not fit better by this factor.
_CLOSE = 0.15
_BETTER = 0.5
# Ratio of the length that scans measure to the length that poses claim -> what
# is wrong.
_RATIOS = {
    1000.0: "the poses are in kilometres",
    1e-2: "the poses are in centimetres",
    1e-3: "the poses are in millimetres",
    1.0 / _METRES_PER_FOOT: "the points are in feet, and the poses in metres",
    _METRES_PER_FOOT: "the poses are in feet",
}
# Poses that claim a smaller share of the motion stand still.
_STILL = 1e-5
# Least turn of the poses against the points that is named [rad].
_TURNED = np.radians(5.0)
_MIRROR_Y = np.diag([1.0, -1.0, 1.0, 1.0])
# Where the points' x, y and z axes point, seen from the poses' frame -> X_PS.
_AXES = {
    "the points' x axis points to the left": ("y", "-x", "z"),
    "the points' x axis points to the right": ("-y", "x", "z"),
    "the points' x axis points to the back": ("-x", "-y", "z"),
    "the poses have the axes of a camera": ("z", "-x", "-y"),
}


def check_data_set(drive: Drive | Path | str, **options: Any) -> None:
    """Checks that a drive of your own can be used by all programs.

    The checks, `data_set_checks`, open the drive and read some of its scans.
    They look for what readers often confuse, such as units, the axes of a frame
    and inverted poses. Points whose coordinates are not finite are beams
    without a return: they are allowed, and left out, as in all programs.

    Args:
        drive: an open drive, or its path, as `open_drive` takes it.
        options: options of `open_drive` for a path, such as `poses`.

    Raises:
        InputError: the drive cannot be read, or something is wrong or not
            plausible. The error says in one line what it is.

    Example:
        from evaluation import check_data_set

        check_data_set("recordings/downtown_01")
    """
    if isinstance(drive, Drive):
        if options:
            raise InputError(
                f"{drive.name}: {', '.join(options)}: the drive is open; give"
                " options with a path"
            )
        opened, place = drive, drive.name
    else:
        opened, place = open_drive(Path(drive), **options), str(drive)
    with errors_at(place, f"{opened.name}: "):
        for check in data_set_checks:
            check(opened)


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
def check_types(drive: Drive) -> Iterator[str]:
    """The values have the types and shapes of the interface `Drive`."""
    try:
        check_interface(drive)
    except InputError as error:
        yield str(error)


@_check(check_types)
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


@_check(check_types)
def check_times(drive: Drive) -> Iterator[str]:
    """Two scans at least, in increasing times in nanoseconds."""
    number, stamps_ns = len(drive), drive.stamps_ns
    if number < 2:
        yield f"scans: {number} instead of two at least"
        return
    if stamps_ns.dtype != np.int64:
        yield f"times: {stamps_ns.dtype} instead of int64"
        return
    steps = np.diff(stamps_ns)
    if (steps <= 0).any():
        frame = int((steps <= 0).argmax()) + 1
        yield f"times: scan {frame} is not later than the scan before"
    step = float(np.median(steps)) * 1e-9
    if not _SHORTEST_STEP <= step <= _LONGEST_STEP:
        place, wanted = _time_unit(drive)
        meant = [
            name
            for name, unit in _TIME_UNITS.items()
            if _USUAL_STEPS[0]
            < step * unit / _TIME_UNITS[wanted]
            < _USUAL_STEPS[1]
        ]
        yield f"{place}: a scan every {step:g} s" + (
            f": numbers in {meant[0]}? They must be in {wanted}"
            if meant
            else f"; are they in {wanted}, as they must be?"
        )


def _time_unit(drive: Drive) -> tuple[str, str]:
    """Returns where the times of a drive are, and their unit."""
    if any(file.name == _SECONDS for file in drive.files):
        return _SECONDS, "seconds"
    return "times", "nanoseconds"


@_check(check_types)
def check_poses(drive: Drive) -> Iterator[str]:
    """Each scan has a finite rigid pose."""
    X_WS = drive.X_WS
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
    steps = step_lengths(p_WS)
    speed = float(np.median(steps / (np.diff(drive.stamps_ns) * 1e-9)))
    if speed > _FASTEST:
        yield (
            f"poses: the LiDAR moves at {speed:.0f} m/s; are positions in"
            f" metres, and times in {_time_unit(drive)[1]}?"
        )
    jump = int(steps.argmax())
    if steps[jump] > _FASTEST * _LONGEST_STEP:
        yield (
            f"poses: scan {jump + 1} lies {steps[jump]:.0f} m from scan {jump};"
            " leave out the scan with the wrong pose"
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


@_check(check_scans, check_points, check_poses)
def check_frames(drive: Drive) -> Iterator[str]:
    """The motion that the poses claim is the one that the scans measure."""
    found = [_motion(drive, frame) for frame in _some_frames(drive)[:-1]]
    motions = [one for one in found if one is not None]
    if not motions:
        note(
            f"{drive.name}: frames: not checked: no two neighbouring scans can"
            " be registered to each other"
        )
        return
    lengths = [
        np.linalg.norm([X[:3, 3] for X in of], axis=1).max()
        for of in (
            [one.X_AB for one in motions],
            [_claimed(drive, one) for one in motions],
        )
    ]
    measured, claimed = lengths
    if max(lengths) < _LEAST_MOTION:
        note(
            f"{drive.name}: frames: not checked: from scan to scan, neither the"
            f" poses nor the points move by {_LEAST_MOTION:g} m"
        )
        return
    if claimed < _STILL * measured:
        yield f"poses: all alike, but the scans move by {measured:.2f} m"
        return
    if measured < _CLOSE * min(claimed, _LEAST_MOTION):
        yield (
            f"poses: the LiDAR moves by {claimed:.2f} m between scans that"
            f" measure {measured:.2f} m; the points of all scans are in one"
            " frame already"
        )
        return
    fits = {
        name: _fit(motions, made) for name, made in _placements(drive).items()
    }
    given = fits.pop(_AS_GIVEN)
    name, best = min(fits.items(), key=lambda item: item[1].error)
    if given.error < max(_CLOSE, best.error / _BETTER):
        name, best = _AS_GIVEN, given
    if best.error > 2.0 * _CLOSE:
        if abs(given.turn) > _TURNED and given.turned_error < 2.0 * _CLOSE:
            deg = np.degrees(given.turn)
            line = _tr_line(drive, poses.yaw_pose(given.turn))
            yield f"poses: turned by {deg:.0f} deg against the points{line}"
            return
        note(
            f"{drive.name}: frames: what the scans measure differs by"
            f" {best.error:.0%} from what the poses claim, and no turn, axis or"
            " unit explains it"
        )
        return
    if name != _AS_GIVEN:
        turns = _turns(drive)
        line = _tr_line(drive, turns[name]) if name in turns else ""
        yield (
            f"poses: neighbouring scans fit better (off by {best.error:.0%} of"
            f" the motion instead of {given.error:.0%}) if {name}{line}"
        )
    if not 1.0 - _CLOSE < best.ratio < 1.0 + _CLOSE:
        near = min(_RATIOS, key=lambda one: abs(np.log(best.ratio / one)))
        is_near = abs(np.log(best.ratio / near)) < _CLOSE
        ratio = f"{float(f'{best.ratio:.3g}'):g}"
        what = _RATIOS[near] if is_near else "the poses have no scale"
        yield (
            f"poses: scans move {ratio} times as far as the poses claim:"
            f" {what}? Multiply the poses' positions by {ratio}"
        )


# What `check_data_set` checks, for `pytest.mark.parametrize`: functions of a
# drive, or of its path, each of which raises an InputError.
data_set_checks: list[_Check] = [
    check_types,
    check_names,
    check_times,
    check_poses,
    check_motion,
    check_scans,
    check_points,
    check_frames,
]


class _Motion(NamedTuple):
    """A motion that scans measure.

    Attributes:
        first, last: numbers of the two scans A and B.
        X_AB: (4, 4) pose of B in A, by registration.
    """

    first: int
    last: int
    X_AB: np.ndarray


class _Fit(NamedTuple):
    """How well poses claim the measured motions.

    Attributes:
        error: root mean square of the differences, as a share of the motion.
        ratio: measured length by claimed length.
        turn: yaw of the claimed motions against the measured ones [rad].
        turned_error: the error without this yaw.
    """

    error: float
    ratio: float
    turn: float
    turned_error: float


def _motion(drive: Drive, frame: int) -> _Motion | None:
    """Measures the motion from a scan on; None if scans do not fit."""
    X_AB, last, stride = np.eye(4), frame, 1
    cloud = _above_ground(_returns(drive.scan(frame)))
    placed = _placements(drive).values()
    for _ in range(_MOST_STEPS):
        other = last + stride
        if other >= len(drive):
            break
        beside = _above_ground(_returns(drive.scan(other)))
        guesses = [np.eye(4), *(claim(last, other) for claim in placed)]
        X_step = _registered(cloud, beside, guesses)
        if X_step is None:
            break
        X_AB, last, cloud = X_AB @ X_step, other, beside
        if np.linalg.norm(X_step[:3, 3]) < _SMALL_STEP:
            stride *= 2
        if np.linalg.norm(X_AB[:3, 3]) > _MEASURED:
            break
    return None if last == frame else _Motion(frame, last, X_AB)


def _registered(
    target: np.ndarray, source: np.ndarray, guesses: Sequence[np.ndarray]
) -> np.ndarray | None:
    """Returns the pose (4, 4) of one scan in the other; None without a fit.

    Args:
        target, source: (N, 3) points.
        guesses: poses (4, 4) from which registrations begin.
    """
    if min(len(target), len(source)) < _FEWEST:
        return None
    tree = KDTree(target)
    some = source[np.random.default_rng(0).permutation(len(source))[:_COMPARED]]
    aim, aim_tree = small_gicp.preprocess_points(target, _VOXEL)
    moved, _ = small_gicp.preprocess_points(some, _VOXEL)
    best, share = None, _FITTING_SHARE
    for guess in guesses:
        if np.linalg.norm(guess[:3, 3]) > _FARTHEST_MOVE:
            continue
        X = guess
        for distance in _STAGES:
            X = small_gicp.align(
                aim,
                moved,
                aim_tree,
                init_T_target_source=X,
                max_correspondence_distance=distance,
            ).T_target_source
        away, _ = tree.query(poses.transform(X, some))
        fitting = float((away < _FITTING).mean())
        if fitting > share:
            best, share = X, fitting
            if share > 0.9:
                break
    return best


def _placements(
    drive: Drive,
) -> dict[str, Callable[[int, int], np.ndarray]]:
    """Returns where a scan B lies beside a scan A, by what may be wrong.

    Returns:
        What is wrong -> the pose (4, 4) of B in A, given their numbers.
    """
    X_WS = drive.X_WS

    def claimed(a: int, b: int) -> np.ndarray:
        return poses.inverse(X_WS[a]) @ X_WS[b]

    def transposed(a: int, b: int) -> np.ndarray:
        X = X_WS[[a, b]].copy()
        X[:, :3, :3] = np.swapaxes(X[:, :3, :3], 1, 2)
        return poses.inverse(X[0]) @ X[1]

    def turned(X_PS: np.ndarray) -> Callable[[int, int], np.ndarray]:
        return lambda a, b: np.linalg.inv(X_PS) @ claimed(a, b) @ X_PS

    return {
        _AS_GIVEN: claimed,
        "the poses are inverted: X_SW instead of X_WS?": (
            lambda a, b: X_WS[a] @ poses.inverse(X_WS[b])
        ),
        "their rotations are transposed": transposed,
        "y is mirrored: a left-handed frame?": turned(_MIRROR_Y),
        **{name: turned(X_PS) for name, X_PS in _turns(drive).items()},
    }


def _turns(drive: Drive) -> dict[str, np.ndarray]:
    """Returns what may be wrong with axes -> X_PS (4, 4)."""
    found = {name: _X_PS(axes) for name, axes in _AXES.items()}
    X_CS = _applied(drive)
    if not np.allclose(X_CS, np.eye(4)):
        found["the poses are of the LiDAR already"] = poses.inverse(X_CS)
    return found


def _applied(drive: Drive) -> np.ndarray:
    """Returns the `Tr` (4, 4) with which the reader of KITTI made the poses."""
    return drive.X_CS if isinstance(drive, KittiDrive) else np.eye(4)


def _X_PS(axes: Sequence[str]) -> np.ndarray:
    """Returns the pose (4, 4) of the points' frame, by where its axes point."""
    X = np.eye(4)
    X[:3, :3] = 0.0
    for column, axis in enumerate(axes):
        X["xyz".index(axis[-1]), column] = -1.0 if axis[0] == "-" else 1.0
    return X


def _tr_line(drive: Drive, X_PS: np.ndarray) -> str:
    """Returns the line that corrects the axes, for the end of a message."""
    # It takes the place of the line that is applied already.
    Tr = np.round((_applied(drive) @ X_PS)[:3].ravel(), 9) + 0.0
    numbers = " ".join(f"{value:.6g}" for value in Tr)
    return f" (in the layout of KITTI, write Tr: {numbers} into calib.txt)"


def _fit(
    motions: Sequence[_Motion], made: Callable[[int, int], np.ndarray]
) -> _Fit:
    """Returns how well poses claim motions, whatever their scale is."""
    X_AB = np.array([one.X_AB for one in motions])
    claimed = np.array([made(one.first, one.last) for one in motions])
    p, q = claimed[:, :3, 3], X_AB[:, :3, 3]
    # Rotations count by how far they move a point at a motion's length.
    length = np.linalg.norm(q, axis=1)
    R = np.swapaxes(claimed[:, :3, :3], 1, 2) @ X_AB[:, :3, :3]
    cosine = (np.trace(R, axis1=1, axis2=2) - 1.0) / 2.0
    angles = np.arccos(np.clip(cosine, -1.0, 1.0))
    turn = float(
        np.angle(np.sum((p[:, 0] + 1j * p[:, 1]) * (q[:, 0] - 1j * q[:, 1])))
    )

    def error(p: np.ndarray) -> tuple[float, float]:
        ratio = max(float((p * q).sum() / max((p * p).sum(), 1e-30)), 1e-9)
        off = np.linalg.norm(ratio * p - q, axis=1)
        total = np.hypot(off, angles * length)
        return float(np.sqrt((total**2).sum() / (length**2).sum())), ratio

    found, ratio = error(p)
    turned, _ = error(p @ poses.yaw_pose(turn)[:3, :3])
    return _Fit(found, ratio, turn, turned)


def _claimed(drive: Drive, motion: _Motion) -> np.ndarray:
    """Returns the motion (4, 4) that the poses claim."""
    return _placements(drive)[_AS_GIVEN](motion.first, motion.last)
