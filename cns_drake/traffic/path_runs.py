"""Lanes and junction paths that the ego car's path follows."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.traffic.lane_graph import LaneGraph

# Distance between the places at which the ego car's lane is determined [m].
POINT_SPACING = 1.0
# The car's lane is at most this far away [m].
_LANE_REACH = 3.0
# The car and its lane have the same direction within 45 deg (cosine).
_ALIGNED = 0.7
# Cost of a metre of the path on no lane; a metre on a lane costs the square of
# the lane's distance [m^2].
_COST_OF_NO_LANE = 4.0
# Cost of a change of lanes [m^2].
_COST_OF_CHANGE = 8.0
# Cost of leaving all lanes, and of coming back [m^2].
_COST_OF_LEAVING = 20.0
# Before a change of lanes, the car is in its new lane this early, so that it
# can request its way from there [m].
_LANE_LEAD = 25.0
# Before and after a change of lanes, the car counts in both lanes for this
# distance [m].
IN_BOTH_LANES = 12.0


class PathRun(NamedTuple):
    """A part of the ego car's path that lies on one piece.

    Attributes:
        piece: number of the piece; -1 on no lane.
        first, last: where on the path the front bumper enters and leaves the
            piece [m].
        s: place on the piece where the front bumper enters [m].
        beside: the lane from which the car changes to this piece; -1 for none.
        parts: where on the path the car has left that lane [m].
    """

    piece: int
    first: float
    last: float
    s: float
    beside: int = -1
    parts: float = 0.0


def find_runs(graph: LaneGraph, points: np.ndarray) -> list[PathRun]:
    """Divides a car's path into the lanes and junction paths it follows.

    Args:
        graph: the lane graph.
        points: (N, 2) points of the car's path, 1 m apart.

    Returns:
        The parts of the path in driving order, each with the number of the lane
        or junction path in `graph.pieces`, or -1 where the car follows no lane
        or junction path.
    """
    near, misfit, place = _misfits(graph, points)
    best = _least_cost_sequence(misfit, _change_costs(graph, near))
    starts = np.flatnonzero(np.diff(best, prepend=-1))
    pieces = np.append(near, -1)[best[starts]].tolist()
    firsts = POINT_SPACING * starts
    s = place[starts, best[starts]]
    for k, (before_it, piece) in enumerate(pairwise(pieces), 1):
        if before_it >= 0 and piece in graph.pieces[before_it].after:
            # The boundary is between two points.
            firsts[k], s[k] = firsts[k] - s[k], 0.0
    firsts = np.append(firsts, POINT_SPACING * len(points))
    runs: list[PathRun] = []
    for k, piece in enumerate(pieces):
        enters, leaves = firsts[k : k + 2].tolist()
        run = PathRun(piece, enters, leaves, float(s[k]))
        last = runs[-1] if runs else run
        lane = graph.pieces[last.piece]
        if min(last.piece, piece) >= 0 and piece in (lane.left, lane.right):
            earlier = min(run.first - run.last + _LANE_LEAD, run.s)
            earlier = max(
                0.0, min(earlier, run.first - last.first - POINT_SPACING)
            )
            first = run.first - earlier
            runs[-1] = last._replace(last=first)
            run = run._replace(
                first=first,
                s=run.s - earlier,
                beside=last.piece,
                parts=run.first + IN_BOTH_LANES,
            )
        runs.append(run)
    return runs


def _misfits(
    graph: LaneGraph, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the pieces near a path, and how well they fit its points.

    Args:
        graph: the lane graph.
        points: (N, 2) points of the path [m].

    Returns:
        (P,) numbers of the pieces; (N, P + 1) cost of each piece, and of no
        lane, at each point [m^2]; and (N, P + 1) places of the points along
        the pieces [m].
    """
    lines = [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    tree = shapely.STRtree(lines)
    rows, found = tree.query(shapely.points(points), "dwithin", _LANE_REACH)
    near, columns = np.unique(found, return_inverse=True)
    here, on = shapely.points(points[rows]), np.array(lines)[found]
    places = shapely.line_locate_point(on, here)
    along = np.subtract(
        *(
            shapely.get_coordinates(
                shapely.line_interpolate_point(on, np.maximum(places + d, 0.0))
            )
            for d in (0.5, -0.5)
        )
    )
    ahead = np.gradient(points, axis=0)[rows]
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(ahead, axis=1)
    fits = np.sum(along * ahead, axis=1) > _ALIGNED * size
    off = len(near)
    misfit = np.full((len(points), off + 1), np.inf)
    misfit[:, off] = _COST_OF_NO_LANE
    distance = shapely.distance(on, here)
    misfit[rows[fits], columns[fits]] = distance[fits] ** 2
    place = np.zeros(misfit.shape)
    place[rows, columns] = places
    return near, misfit, place


def _change_costs(graph: LaneGraph, near: np.ndarray) -> np.ndarray:
    """Returns the cost of going from one piece to another [m^2].

    Args:
        graph: the lane graph.
        near: (P,) numbers of the pieces.

    Returns:
        (P + 1, P + 1) costs, from the piece of the row to the piece of the
        column; the last row and column are for no lane.
    """
    off = len(near)
    change = np.full((off + 1, off + 1), np.inf)
    change[off], change[:, off] = _COST_OF_LEAVING, _COST_OF_LEAVING
    for row, number in enumerate(near):
        piece = graph.pieces[number]
        for others, cost in (
            (piece.after, 0.0),
            ((piece.left, piece.right), _COST_OF_CHANGE),
        ):
            change[row, :off][np.isin(near, others)] = cost
    np.fill_diagonal(change, 0.0)
    return change


def _least_cost_sequence(misfit: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Returns the sequence of pieces with the least cost, (N,).

    The sequence is found by dynamic programming.

    Args:
        misfit: (N, P) cost of each piece at each point.
        change: (P, P) cost of going from one piece, the row, to another.
    """
    cost = misfit[0]
    before = np.zeros(misfit.shape, int)
    for row in range(1, len(misfit)):
        costs = cost[:, None] + change
        before[row] = costs.argmin(axis=0)
        cost = costs.min(axis=0) + misfit[row]
    best = np.zeros(len(misfit), int)
    best[-1] = cost.argmin()
    for row in range(len(misfit) - 1, 0, -1):
        best[row - 1] = before[row, best[row]]
    return best
