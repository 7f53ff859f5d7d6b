"""Lanes, signal programs and the ego car's path, as arrays for fast loops."""

from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.base import arctan2, compiled
from cns_drake.traffic.conflicts import find_conflicts
from cns_drake.traffic.ego_car import EgoBox, find_ego
from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.signals import Signals, make_signals
from cns_drake.traffic.traffic_flow import way_shares

# Greatest lateral acceleration in bends [m/s^2].
_LATERAL = 2.2
# Greatest braking before bends [m/s^2].
_BEFORE_BENDS = 1.5
# Speed below which bends do not reduce it [m/s].
_SLOWEST = 2.5
# The curvature is that of chords over this many points to both sides.
_CHORD = 4
# When the ego car enters a lane, the lane must be empty. Drivers assume that
# they drive at this share of the speed limit.
_SLOW_PART = 0.6
# Drivers assume that they wait for this time at the lane's end [s].
WAIT = 20.0
# A piece of the lane graph as a record; see `Piece`.
PIECE = np.dtype(
    [
        ("first", int),  # Row of its first point.
        ("num_points", int),
        ("step", float),  # Distance between points [m].
        ("length", float),  # [m]
        ("is_way", bool),
        ("after_first", int),  # Row of its first successor.
        ("after_count", int),
        ("left", int),
        ("right", int),
        ("junction", int),
        ("phase", int),
    ],
    align=True,
)


class Streets(NamedTuple):
    """P pieces and C crossings of a lane graph, and the ego car at K times.

    Attributes:
        pieces: (P,) records of dtype `PIECE`.
        points: (M, 3) points of all pieces [m].
        speed: (M,) allowed speed at each point, reduced in bends [m/s].
        after: numbers of the pieces that follow a piece, for all pieces in
            turn; `pieces` says which rows belong to a piece.
        liked: for each entry of `after`, the cumulative share of drivers that
            take this piece or an earlier entry.
        signals: program of all signals.
        begin, clear, joint: (2, P + C, P + C), see
            `cns_drake.traffic.conflicts.find_conflicts`.
        over: (P, C) place on a crossing's line where a path through a junction
            leads over the crossing [m]; NaN if the path does not cross.
        until: (K, P + C) float32 time until the ego car reaches the piece or
            crossing [s]; 0 while the ego car is there, inf if the ego car never
            gets there.
        ego_rear, ego_front: (K, P) float32 distances of the ego car's rear and
            front along a piece while the car is on the piece [m].
        ego_speed: (K, P) float32 speed of the ego car along the piece [m/s];
            negative against its direction.
    """

    pieces: np.ndarray
    points: np.ndarray
    speed: np.ndarray
    after: np.ndarray
    liked: np.ndarray
    signals: Signals
    begin: np.ndarray
    clear: np.ndarray
    joint: np.ndarray
    over: np.ndarray
    until: np.ndarray
    ego_rear: np.ndarray
    ego_front: np.ndarray
    ego_speed: np.ndarray


def make_streets(
    graph: LaneGraph, box: EgoBox, xy: np.ndarray, yaw: np.ndarray
) -> Streets:
    """Converts a lane graph and the ego car's motion to arrays for numba.

    Args:
        graph: the lanes.
        box: the ego car's box.
        xy: (K, 2) positions of the ego car's frame, one for each time step [m].
        yaw: (K,) headings of the ego car [rad].
    """
    pieces = graph.pieces
    rows = np.zeros(len(pieces), PIECE)
    count = np.array([len(piece.points) for piece in pieces])
    after_count = np.array([len(piece.after) for piece in pieces])
    rows["num_points"] = count
    rows["first"] = np.cumsum(count) - count
    rows["after_count"] = after_count
    rows["after_first"] = np.cumsum(after_count) - after_count
    for name in ("length", "is_way", "left", "right", "junction", "phase"):
        rows[name] = [getattr(piece, name) for piece in pieces]
    rows["step"] = rows["length"] / (count - 1)
    conflicts = find_conflicts(graph)
    shares = [way_shares(graph, k) for k in range(len(pieces))]
    return Streets(
        rows,
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate([_allowed_speeds(piece) for piece in pieces]),
        np.array([a for piece in pieces for a in piece.after]),
        np.concatenate([np.cumsum(of_piece) for of_piece in shares]),
        make_signals(graph, conflicts[0][0]),
        *conflicts,
        _places_on_crossings(graph),
        *find_ego(graph, box, xy, yaw),
    )


def _places_on_crossings(graph: LaneGraph) -> np.ndarray:
    """Returns `Streets.over` of a graph."""
    ways = [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    lines = [
        shapely.LineString(crossing.line[:, :2]) for crossing in graph.crossings
    ]
    over = np.full((len(ways), len(lines)), np.nan)
    tree = shapely.STRtree(ways)
    for c, line in enumerate(lines):
        for way in tree.query(line, "intersects"):
            where = shapely.intersection(ways[way], line)
            over[way, c] = line.project(where.centroid)
    return over


def _allowed_speeds(piece: Piece) -> np.ndarray:
    """Returns the allowed speed at each point of a piece [m/s]."""
    xy = piece.points[:, :2]
    speed = np.full(len(xy), piece.limit)
    step = piece.length / (len(xy) - 1)
    reach = min(_CHORD, (len(xy) - 1) // 2)
    if reach > 0:
        a, b, c = xy[: -2 * reach], xy[reach:-reach], xy[2 * reach :]
        u, w = b - a, c - b
        turn = np.abs(
            arctan2(
                u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0], np.sum(u * w, axis=1)
            )
        )
        curvature = np.pad(turn / (reach * step), reach, mode="edge")
        bend = np.sqrt(_LATERAL / np.maximum(curvature, 1e-6))
        speed = np.minimum(speed, np.maximum(bend, _SLOWEST))
    for k in range(len(speed) - 2, -1, -1):
        ahead = np.sqrt(speed[k + 1] ** 2 + 2.0 * _BEFORE_BENDS * step)
        speed[k] = min(speed[k], ahead)
    return speed


def places_on(
    streets: Streets, pieces: np.ndarray, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns x, y and z of places, given by pieces and distances.

    Beyond its ends, a piece goes straight on.

    Args:
        streets: arrays of all pieces.
        pieces: (...) numbers of the pieces.
        s: (...) distances along the pieces [m].

    Returns:
        Three arrays (...) [m].
    """
    rows = streets.pieces[pieces]
    at = s / rows["step"]
    k = np.minimum(np.maximum(np.floor(at), 0.0), rows["num_points"] - 2.0)
    row = rows["first"] + k.astype(int)
    share = at - k
    here, there = streets.points[row], streets.points[row + 1]
    place = here + share[..., None] * (there - here)
    return place[..., 0], place[..., 1], place[..., 2]


@compiled
def speed_on(streets: Streets, piece: int, s: float) -> float:
    """Returns the allowed speed on a piece of a lane graph [m/s].

    Args:
        streets: arrays of all pieces.
        piece: number of the piece.
        s: distance along the piece [m].
    """
    row = streets.pieces[piece]
    k = min(max(int(s / row.step), 0), row.num_points - 1)
    return streets.speed[row.first + k]


@compiled
def is_ego_far(
    streets: Streets, k: int, lane: int, s: float, wait: float = WAIT
) -> bool:
    """Returns whether a vehicle can leave a lane before the ego car comes.

    Args:
        streets: arrays of all lanes, with the times of the ego car.
        k: number of the time step.
        lane: number of the lane.
        s: distance of the vehicle along the lane [m].
        wait: time that the vehicle may have to wait at the lane's end [s].
    """
    until = streets.until[k, lane]
    if until == 0.0:
        # A vehicle may follow the ego car.
        return streets.ego_speed[k, lane] >= 0.0 and (
            streets.ego_rear[k, lane] > s + 2.0
        )
    row = streets.pieces[lane]
    speed = _SLOW_PART * streets.speed[row.first]
    return until > (row.length - s) / speed + wait
