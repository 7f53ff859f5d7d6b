"""A lane graph as arrays, for compiled loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.junction_conflicts import find_conflicts
from cns_drake.traffic.lane_graph import LaneGraph, Piece

# Greatest acceleration in bends, and braking before them [m/s^2].
_LATERAL = 2.2
_BEFORE_BENDS = 1.5
# Least speed in a bend [m/s].
_SLOWEST = 2.5
# Number of points to both sides whose chords give the curvature.
_CHORD = 4


class LaneArrays(NamedTuple):
    """Pieces p and crossings c of a lane graph.

    Attributes:
        first, num_points: (P,) rows of a piece in `points`, and their number.
        step: (P,) distance of its points [m].
        length: (P,) [m].
        points: (M, 3) [m].
        speed: (M,) allowed speed there, with regard to bends [m/s].
        is_way: (P,) bool.
        after_first, after_count: (P,) rows in `after`, and their number.
        after: numbers of pieces.
        left, right: (P,) lanes beside it, -1 for none.
        junction, phase: (P,) of ways; -1 without a signal.
        phases: (J,) number of phases of a junction's signals.
        small, large: (P + C, P + C) exclusions, see `find_conflicts`.
    """

    first: np.ndarray
    num_points: np.ndarray
    step: np.ndarray
    length: np.ndarray
    points: np.ndarray
    speed: np.ndarray
    is_way: np.ndarray
    after_first: np.ndarray
    after_count: np.ndarray
    after: np.ndarray
    left: np.ndarray
    right: np.ndarray
    junction: np.ndarray
    phase: np.ndarray
    phases: np.ndarray
    small: np.ndarray
    large: np.ndarray


def make_lane_arrays(graph: LaneGraph) -> LaneArrays:
    """Returns the arrays of a graph."""
    pieces = graph.pieces
    count = np.array([len(piece.points) for piece in pieces])
    length = np.array([piece.length for piece in pieces])
    after_count = np.array([len(piece.after) for piece in pieces])
    small, large = find_conflicts(graph)
    return LaneArrays(
        first=np.concatenate([[0], np.cumsum(count)[:-1]]),
        num_points=count,
        step=length / (count - 1),
        length=length,
        points=np.concatenate([piece.points for piece in pieces]),
        speed=np.concatenate([_speeds(piece) for piece in pieces]),
        is_way=np.array([piece.is_way for piece in pieces]),
        after_first=np.concatenate([[0], np.cumsum(after_count)[:-1]]),
        after_count=after_count,
        after=np.array([a for piece in pieces for a in piece.after]),
        left=np.array([piece.left for piece in pieces]),
        right=np.array([piece.right for piece in pieces]),
        junction=np.array([piece.junction for piece in pieces]),
        phase=np.array([piece.phase for piece in pieces]),
        phases=np.array(graph.phases or (1,)),
        small=small,
        large=large,
    )


def _speeds(piece: Piece) -> np.ndarray:
    """Returns the allowed speed at each point of a piece [m/s]."""
    xy = piece.points[:, :2]
    speed = np.full(len(xy), piece.limit)
    step = piece.length / (len(xy) - 1)
    reach = min(_CHORD, (len(xy) - 1) // 2)
    if reach > 0:
        a, b, c = xy[: -2 * reach], xy[reach:-reach], xy[2 * reach :]
        u, w = b - a, c - b
        turn = np.abs(
            np.arctan2(
                u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0], np.sum(u * w, axis=1)
            )
        )
        curvature = np.full(len(xy), 0.0)
        curvature[reach:-reach] = turn / (reach * step)
        curvature[:reach] = curvature[reach]
        curvature[-reach:] = curvature[-reach - 1]
        bend = np.sqrt(_LATERAL / np.maximum(curvature, 1e-6))
        speed = np.minimum(speed, np.maximum(bend, _SLOWEST))
    for k in range(len(speed) - 2, -1, -1):
        ahead = np.sqrt(speed[k + 1] ** 2 + 2.0 * _BEFORE_BENDS * step)
        speed[k] = min(speed[k], ahead)
    return speed


@compiled
def place_on(
    lanes: LaneArrays, piece: int, s: float
) -> tuple[float, float, float]:
    """Returns the place at a distance along a piece [m].

    Before its beginning and after its end it goes straight on.
    """
    at = s / lanes.step[piece]
    k = int(min(max(np.floor(at), 0.0), lanes.num_points[piece] - 2.0))
    row = lanes.first[piece] + k
    share = at - k
    x, y, z = lanes.points[row, 0], lanes.points[row, 1], lanes.points[row, 2]
    return (
        x + share * (lanes.points[row + 1, 0] - x),
        y + share * (lanes.points[row + 1, 1] - y),
        z + share * (lanes.points[row + 1, 2] - z),
    )


@compiled
def speed_on(lanes: LaneArrays, piece: int, s: float) -> float:
    """Returns the allowed speed at a distance along a piece [m/s]."""
    k = int(s / lanes.step[piece])
    k = min(max(k, 0), lanes.num_points[piece] - 1)
    return lanes.speed[lanes.first[piece] + k]
