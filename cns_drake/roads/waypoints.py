"""A drive along waypoints: for worlds that have no road network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from cns_drake.roads.centreline import Centreline
from cns_drake.roads.lane_path import (
    LanePath,
    check_length,
    sample_lane_path,
)
from evaluation.support.csv_files import read_rows
from evaluation.support.errors import InputError

# Corners are rounded by arcs of this radius, or what fits between the
# neighbouring waypoints [m].
_CORNER_RADIUS = 8.0
# A car does not turn on the spot.
_SHARPEST_TURN_DEG = 150.0
# Waypoints closer than this to the one before are taken for the same [m].
_SAME_PLACE = 1e-3
# Beyond this a coordinate is a slip, not a place [m].
_FARTHEST = 1_000_000.0
# Distance between the points from which the path is interpolated [m].
_DENSE_SPACING = 0.25


def load_waypoint_path(path: Path | str, spacing: float) -> LanePath:
    """Reads waypoints and makes a path of them.

    The file is CSV, one waypoint a line: x, y, z or x, y of the vehicle
    frame (on the ground, metres, in the world); without z it is 0. A first
    line of names may give the columns another order, and may name more.

    The path is the line from waypoint to waypoint, with corners rounded by
    arcs of 8 m, or of what fits into half of the shorter neighbouring
    segment; so it leaves a right-angled corner by up to 3.3 m. The height
    follows a monotone cubic over the distance travelled.

    Args:
        path: the file.
        spacing: distance of the points of the path [m].

    Raises:
        InputError: naming file, line and fault, or the file is too short
            for a drive.
    """
    path = Path(path)
    points, lines = _read(path)
    return make_waypoint_path(
        points, spacing, [f"{path}: line {line}" for line in lines], path
    )


def make_waypoint_path(
    waypoints: ArrayLike,
    spacing: float,
    names: Sequence[str] | None = None,
    source: object = "waypoints",
) -> LanePath:
    """Makes a path of waypoints, without speed limits.

    Args:
        waypoints: (N, 3) positions of the vehicle frame [m].
        spacing: distance of the points of the path [m].
        names: N texts by which errors name the waypoints.
        source: by which errors name all of them.

    Raises:
        InputError: fewer than two different waypoints, a turn by more than
            150 degrees, or too little or too much to drive.
    """
    waypoints = np.asarray(waypoints, dtype=float)
    if names is None:
        names = [f"{source}: {k}" for k in range(len(waypoints))]
    steps = np.linalg.norm(np.diff(waypoints[:, :2], axis=0), axis=1)
    kept = np.flatnonzero(np.concatenate([[True], steps > _SAME_PLACE]))
    waypoints = waypoints[kept]
    if len(waypoints) < 2:
        raise InputError(f"{source}: fewer than two different waypoints")
    edges = np.diff(waypoints[:, :2], axis=0)
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    headings = np.arctan2(edges[:, 1], edges[:, 0])
    turns = np.abs((np.diff(headings) + np.pi) % (2 * np.pi) - np.pi)
    for k in np.flatnonzero(turns > np.radians(_SHARPEST_TURN_DEG)):
        raise InputError(
            f"{names[kept[k + 1]]}: turns by {np.degrees(turns[k]):.0f} deg, "
            f"a car can turn by {_SHARPEST_TURN_DEG:.0f} deg at most"
        )
    room = np.minimum(lengths[:-1], lengths[1:]) / 2
    tangents = np.tan(turns / 2)
    radii = np.minimum(_CORNER_RADIUS, room / np.maximum(tangents, 1e-9))
    curve = Centreline(waypoints[:, :2], radii)
    check_length(curve.length, source)
    count = int(np.ceil(curve.length / _DENSE_SPACING)) + 1
    along = np.linspace(0.0, curve.length, count)
    # Where the curve passes each waypoint: the middle of its corner's arc.
    saved = 2 * radii * tangents - radii * turns
    shortened = np.concatenate([[0.0], np.cumsum(saved)])
    at_waypoints = np.concatenate([[0.0], np.cumsum(lengths)])
    at_waypoints[1:-1] -= (shortened[:-1] + shortened[1:]) / 2
    at_waypoints[-1] -= shortened[-1]
    z = PchipInterpolator(at_waypoints, waypoints[:, 2])(along)
    points = np.column_stack([curve.evaluate(along)[:, :2], z])
    return sample_lane_path(points, np.full(count, np.inf), spacing, source)


def _read(path: Path) -> tuple[np.ndarray, list[int]]:
    """Returns the (N, 3) waypoints of a file and the lines they are on."""
    points, lines = [], []
    columns = None
    for line, cells in read_rows(path):
        where = f"{path}: line {line}"
        if columns is None:
            columns = _columns(cells, where)
            if not _is_number(cells[columns[0]]):
                continue
        if max(columns) >= len(cells):
            raise InputError(f"{where}: {len(cells)} column(s), too few")
        values = [cells[column] for column in columns]
        for value in values:
            if not _is_number(value):
                raise InputError(f"{where}: {value!r} is not a finite number")
            if abs(float(value)) > _FARTHEST:
                raise InputError(
                    f"{where}: {value} m are more than {_FARTHEST:.0f} m"
                )
        x, y, *z = map(float, values)
        points.append((x, y, z[0] if z else 0.0))
        lines.append(line)
    if not points:
        raise InputError(f"{path}: no waypoint")
    return np.array(points), lines


def _columns(cells: list[str], where: str) -> list[int]:
    """Returns where x, y and perhaps z are, from the first line."""
    names = [cell.lower() for cell in cells]
    if {"x", "y"} <= set(names):
        wanted = ["x", "y", "z"] if "z" in names else ["x", "y"]
        return [names.index(name) for name in wanted]
    if not all(_is_number(cell) for cell in cells):
        raise InputError(
            f"{where}: neither numbers nor the names of columns x, y and z"
        )
    if len(cells) not in (2, 3):
        raise InputError(
            f"{where}: {len(cells)} column(s), not x, y or x, y, z"
        )
    return list(range(len(cells)))


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False
