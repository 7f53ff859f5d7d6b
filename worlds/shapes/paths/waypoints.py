"""Paths along waypoints, for worlds without a road network."""

from collections.abc import Callable, Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import (
    InputError,
    arctan2,
    cos,
    poses,
    read_rows,
    repeated,
    sin,
    step_lengths,
    tan,
    to_number,
    wrapped,
)
from worlds.shapes.paths.centreline import Centreline
from worlds.shapes.paths.lane_path import (
    DENSE_SPACING,
    LanePath,
    check_length,
    sample_lane_path,
)
from worlds.shapes.paths.u_turn import LOOP_RADIUS, loop_corners

# Radius of the arcs that round corners, where the neighbouring waypoints leave
# room for it [m].
_CORNER_RADIUS = 8.0
# No car turns round between waypoints that are closer together [m].
_LEAST_APART = 1.0
# A car cannot turn on the spot: greatest turn at a waypoint.
_SHARPEST_TURN_DEG = 150.0
# Waypoints closer than this to the one before count as the same [m].
_SAME_PLACE = 1e-3


def load_waypoint_path(
    path: Path | str,
    spacing: float,
    *,
    u_turns: bool = False,
    ground: Callable[[np.ndarray], np.ndarray] | None = None,
) -> LanePath:
    """Returns the path along the waypoints in a file.

    Each line of the CSV file contains one waypoint: x, y and, if given, z of
    the vehicle frame in W [m]. The origin of this frame is on the ground.
    Without the third number, `ground` gives z along the path. If the first line
    contains the names of the columns, the columns can be in another order, and
    there can be further columns, of which `velocity` limits the speed [m/s].

    The path is the line from waypoint to waypoint, with corners rounded by arcs
    of 8 m radius. Where the waypoints are too close together, the radius is
    smaller: an arc takes at most half of each segment. At a right angle, the
    path is up to 3.3 m from the corner. The height follows a monotone cubic
    over the distance travelled.

    Args:
        path: the file.
        spacing: approximate distance between the points of the path [m].
        u_turns: whether the car turns round in its tightest loop where the path
            turns by more than 150 degrees at a waypoint. The far end of the
            loop is at the waypoint. Without `u_turns`, such a turn is an error.
        ground: function that returns the heights (N,) of the ground at places
            (N, 2) in W, which are 2 m apart along the path [m]; by default, a
            file without z is an error.

    Raises:
        InputError: a line of the file is not usable, or the path turns too
            sharply, is too short or is too long for a drive. The message names
            the file and, if the fault is in a single line, the line.
    """
    path = Path(path)
    points, limits, lines, _ = read_waypoints(path)
    if not np.isnan(points).any():
        ground = None
    elif ground is None:
        raise InputError(f"{path}: has no column z")
    names = [f"{path}: line {line}" for line in lines]
    made = make_waypoint_path(
        points, spacing, names, path, u_turns=u_turns, ground=ground
    )
    if np.isinf(limits).all():
        return made
    return replace(made, speed_limits=_limits_along(made, points, limits))


def _limits_along(
    path: LanePath, points: np.ndarray, limits: np.ndarray
) -> np.ndarray:
    """Returns the speed limits (N,) at the points of a path [m/s].

    Between two waypoints, the limit changes evenly. It is at least 0.5 m/s:
    files end with a velocity of 0, at which a car would never arrive.

    Args:
        path: the path along the waypoints.
        points, limits: the waypoints, see `Waypoints`.
    """
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    # Rounded corners are a little shorter.
    share = np.linspace(0.0, 1.0, len(path.points))
    found = np.interp(share * along[-1], along, limits)
    return np.maximum(found, _SLOWEST)


def make_waypoint_path(
    waypoints: ArrayLike,
    spacing: float,
    names: Sequence[str] | None = None,
    source: object = "waypoints",
    *,
    u_turns: bool = False,
    ground: Callable[[np.ndarray], np.ndarray] | None = None,
) -> LanePath:
    """Returns the path along waypoints, without speed limits.

    Args:
        waypoints: (N, 3) positions of the vehicle frame [m].
        spacing: approximate distance between the points of the path [m].
        names: N names of the waypoints, for error messages.
        source: name of the list of waypoints, for error messages.
        u_turns: whether turns by more than 150 degrees are driven as loops.
        ground: gives the heights of the path instead of the waypoints, see
            `load_waypoint_path`.

    Raises:
        InputError: fewer than two different waypoints, a turn by more than 150
            degrees without `u_turns` or without room, or a path that is too
            short or too long.
    """
    waypoints = np.asarray(waypoints, dtype=float)
    if names is None:
        names = [f"{source}: {k}" for k in range(len(waypoints))]
    steps = step_lengths(waypoints[:, :2])
    kept = np.flatnonzero(np.concatenate([[True], steps > _SAME_PLACE]))
    waypoints = waypoints[kept]
    if len(waypoints) < 2:
        raise InputError(f"{source}: fewer than two different waypoints")
    names = [names[k] for k in kept.tolist()]
    edges = np.diff(waypoints[:, :2], axis=0)
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    headings = arctan2(edges[:, 1], edges[:, 0])
    turns = np.pi - (np.pi - np.diff(headings)) % (2 * np.pi)
    is_loop = np.abs(turns) > np.radians(_SHARPEST_TURN_DEG)
    if not u_turns:
        _refuse_loops(turns, is_loop, lengths, names)
    free = _free_lengths(lengths, turns, is_loop, names)
    usable = np.minimum(lengths / 2, free)
    room = np.minimum(usable[:-1], usable[1:])
    tangents = tan(np.where(is_loop, 0.0, np.abs(turns)) / 2)
    radii = np.minimum(_CORNER_RADIUS, room / np.maximum(tangents, 1e-9))
    corners = [waypoints[:1]]
    corner_radii = []
    for at, loops in enumerate(is_loop):
        corner = waypoints[at + 1 : at + 2]
        if loops:
            xy = _loop_corners_at(corner[0, :2], headings[at], turns[at])
            z = np.full(len(xy), corner[0, 2])
            corner = np.column_stack([xy, z])
        corners.append(corner)
        corner_radii += [LOOP_RADIUS if loops else radii[at]] * len(corner)
    return _rounded_path(
        np.concatenate([*corners, waypoints[-1:]]),
        np.array(corner_radii),
        spacing,
        source,
        ground,
    )


def _refuse_loops(
    turns: np.ndarray,
    is_loop: np.ndarray,
    lengths: np.ndarray,
    names: list[str],
) -> None:
    """Raises an InputError if any inner waypoint needs a loop.

    Args:
        turns: (N - 2,) turns at the inner ones of N waypoints [rad].
        is_loop: (N - 2,) whether such a turn needs a loop.
        lengths: (N - 1,) distances between neighbouring waypoints [m].
        names: names of all waypoints.
    """
    for k in np.flatnonzero(is_loop):
        apart = lengths[k : k + 2].min()
        if apart < _LEAST_APART:
            raise InputError(
                f"{names[k + 1]}: turns back {apart:.2g} m behind the one"
                " before, as noise does; leave out waypoints that are less"
                f" than {_LEAST_APART:g} m apart"
            )
        raise InputError(
            f"{names[k + 1]}: turns by {np.degrees(abs(turns[k])):.0f} "
            f"deg; a car can turn by {_SHARPEST_TURN_DEG:.0f} deg at "
            "most; with u_turns: true it turns round there in a loop"
        )


def _free_lengths(
    lengths: np.ndarray,
    turns: np.ndarray,
    is_loop: np.ndarray,
    names: list[str],
) -> np.ndarray:
    """Returns the lengths (N - 1,) of segments that loops leave free [m].

    Args:
        lengths: (N - 1,) lengths of the segments between N waypoints [m].
        turns: (N - 2,) turns at the inner waypoints [rad].
        is_loop: (N - 2,) whether the car turns round there in a loop.
        names: names of the N waypoints, for error messages.

    Raises:
        InputError: a segment is too short for its loops.
    """
    taken = np.where(is_loop, _loop_approach(turns), 0.0)
    taken = np.concatenate([[0.0], taken, [0.0]])
    free = lengths - taken[:-1] - taken[1:]
    for k in np.flatnonzero((free < 0) & (lengths > 0)):
        raise InputError(
            f"{names[k + 1]}: turning round needs {lengths[k] - free[k]:.2f} "
            "m between this waypoint and the one before, which are "
            f"{lengths[k]:.2f} m apart"
        )
    return free


def _rounded_path(
    corners: np.ndarray,
    radii: np.ndarray,
    spacing: float,
    source: object,
    ground: Callable[[np.ndarray], np.ndarray] | None,
) -> LanePath:
    """Returns the path along corners (N, 3), rounded with N - 2 radii [m]."""
    curve = Centreline(corners[:, :2], radii)
    check_length(curve.length, source)
    edges = np.diff(corners[:, :2], axis=0)
    headings = arctan2(edges[:, 1], edges[:, 0])
    turns = np.abs(wrapped(np.diff(headings)))
    along = np.linspace(
        0.0, curve.length, int(np.ceil(curve.length / DENSE_SPACING)) + 1
    )
    from scipy.interpolate import PchipInterpolator

    # The curve passes each corner in the middle of its arc.
    saved = 2 * radii * tan(turns / 2) - radii * turns
    shortened = np.concatenate([[0.0], np.cumsum(saved)])
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    at_corners = np.concatenate([[0.0], np.cumsum(lengths)])
    at_corners[1:-1] -= (shortened[:-1] + shortened[1:]) / 2
    at_corners[-1] -= shortened[-1]
    stations, heights = at_corners, corners[:, 2]
    if ground is not None:
        count = int(np.ceil(curve.length / _GROUND_SPACING)) + 1
        stations = np.linspace(0.0, curve.length, count)
        heights = ground(curve.evaluate(stations)[:, :2])
    z = PchipInterpolator(stations, heights)(along)
    points = np.column_stack([curve.evaluate(along)[:, :2], z])
    return sample_lane_path(
        points, np.full(len(along), np.inf), spacing, source
    )


def _loop_approach(turns: np.ndarray) -> np.ndarray:
    """Returns how far before its waypoint each of N loops begins [m].

    The loop also ends at this distance (N,) behind the waypoint. `turns` (N,)
    contains the angles by which the path turns at the waypoints [rad].
    """
    aside = cos(turns / 2)
    return LOOP_RADIUS * (
        np.abs(sin(turns / 2)) + np.sqrt(4 - (1 + aside) ** 2)
    )


def _loop_corners_at(
    place: np.ndarray, heading: float, turn: float
) -> np.ndarray:
    """Returns the corners of a loop whose far end is a waypoint (2,) [m].

    The car arrives with a heading and turns by an angle, positive to the left
    [rad].
    """
    if turn < 0:
        mirror = np.array([1.0, -1.0])
        return _loop_corners_at(place * mirror, -heading, -turn) * mirror
    outwards = heading - (np.pi - turn) / 2
    centre = place - LOOP_RADIUS * np.array(
        [math.cos(outwards), math.sin(outwards)]
    )
    aside = LOOP_RADIUS * math.cos(turn / 2)
    return loop_corners(
        centre, heading, heading + turn, LOOP_RADIUS, aside, aside
    )


# Distance along the path between places at which the ground is asked [m].
_GROUND_SPACING = 2.0
# Least limit of speed [m/s].
_SLOWEST = 0.5


class Waypoints(NamedTuple):
    """The waypoints in a file.

    Attributes:
        points: (N, 3) positions [m]; z is NaN in a file without z.
        limits: (N,) speed limits, the column `velocity` [m/s]; infinite without
            it.
        lines: line number of each waypoint.
        unused: names of columns that are not used.
    """

    points: np.ndarray
    limits: np.ndarray
    lines: list[int]
    unused: list[str]


def read_waypoints(path: Path | str) -> Waypoints:
    """Reads waypoints from a file.

    Raises:
        InputError: the file cannot be read, or a line is not usable. The
            message names file, line and fault.
    """
    path = Path(path)
    rows, lines = [], []
    columns: dict[str, int] = {}
    unused: list[str] = []
    width = 0
    for line, cells in read_rows(path):
        where = f"{path}: line {line}"
        if not columns:
            columns, width = _columns(cells, where), len(cells)
            if not _is_number(cells[columns["x"]]):
                unused = [
                    cell
                    for k, cell in enumerate(cells)
                    if k not in columns.values()
                ]
                continue
        if any(cells[width:]):
            raise InputError(
                f"{where}: {len(cells)} columns are more than the {width} of"
                " the first line"
            )
        if max(columns.values()) >= len(cells):
            raise InputError(
                f"{where}: {len(cells)} column(s) are too few; give x and y, "
                "or x, y and z"
            )
        row = dict.fromkeys(("x", "y", "z"), math.nan) | {"velocity": math.inf}
        for name, column in columns.items():
            value = cells[column]
            if not _is_number(value):
                raise InputError(f"{where}: {value!r} is not a finite number")
            if name == "velocity" and float(value) < 0.0:
                raise InputError(f"{where}: velocity: {value} m/s is below 0")
            if abs(float(value)) > poses.FARTHEST:
                raise InputError(
                    f"{where}: {value} m are more than {poses.FARTHEST:.0f} m"
                )
            row[name] = float(value)
        rows.append([*row.values()])
        lines.append(line)
    if not rows:
        raise InputError(f"{path}: the file has no waypoints")
    table = np.array(rows)
    return Waypoints(table[:, :3], table[:, 3], lines, unused)


def _columns(cells: list[str], where: str) -> dict[str, int]:
    """Returns the indices of the columns x, y and, if present, z and velocity.

    `cells` is the first line of the file. If the line has no names, the columns
    are x, y and z. `where` begins the error messages.

    Raises:
        InputError: the first line has neither such names nor such numbers.
    """
    names = [cell.lower() for cell in cells]
    if {"x", "y"} <= set(names):
        wanted = [one for one in ("x", "y", "z", "velocity") if one in names]
        for name in repeated(names):
            if name in wanted:
                raise InputError(f"{where}: column '{name}' is there twice")
        return {name: names.index(name) for name in wanted}
    if not all(_is_number(cell) for cell in cells):
        raise InputError(
            f"{where}: neither numbers nor the names of columns x, y and z"
        )
    if len(cells) not in (2, 3):
        raise InputError(
            f"{where}: {len(cells)} column(s); it must be x, y or x, y, z"
        )
    return {name: k for k, name in enumerate("xyz"[: len(cells)])}


def _is_number(text: str) -> bool:
    return math.isfinite(to_number(text))
