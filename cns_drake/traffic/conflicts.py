"""Where paths of vehicles overlap with each other, or with crossings."""

import math

import numpy as np
import shapely

from cns_drake.base import distances_along
from cns_drake.roads import outlines
from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.vehicle_kinds import LARGEST, SMALL_SIZE

# Distance between the places at which a vehicle's outline is tested [m].
_STEP = 1.0
# Free space around this outline [m].
_CLEARANCE = 0.25
# Axles of a small vehicle: x from its middle [m].
_SMALL_AXLES = (-1.6, 1.75)
# Two ways share the lane before them.
SPLIT = 1
# Two ways share the lane behind them.
MERGE = 2


def find_conflicts(
    graph: LaneGraph,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns where vehicles are in conflict with each other or with crossings.

    A path through a junction is called a way. Two different ways are in
    conflict if the areas that vehicles sweep on them overlap. A way and a
    crossing are in conflict if the area swept on the way overlaps the crossing.
    A lane is in conflict only with crossings whose attribute `marked` is False.

    Args:
        graph: lane graph with P pieces (ways and parts of lanes) and C
            crossings.

    Returns:
        Three arrays (2, P + C, P + C) with indices `k, a, b`. `k` is 0 for two
        small vehicles, and 1 if at least one is large. `a` and `b` are numbers
        of pieces or, from P on, of crossings.

        - How far the front of a vehicle has gone along `a` when the vehicle
          reaches the area of `b` [m]; inf without a conflict, or if `a` is a
          crossing.
        - How far the rear of a vehicle has gone along `a` when the vehicle has
          left the area of `b` [m]; 0 without a conflict, or if `a` is a
          crossing.
        - `SPLIT` for two ways that overlap only at their beginning, because
          they come from the same lane; `MERGE` for two ways that overlap only
          at their end, because they lead to the same lane; otherwise 0.
    """
    num_pieces = len(graph.pieces)
    number = num_pieces + len(graph.crossings)
    begin = np.full((2, number, number), np.inf)
    clear = np.zeros(begin.shape)
    joint = np.zeros(begin.shape, np.int8)
    origin = {way: k for k in graph.lanes for way in graph.pieces[k].after}
    for k, (size, axles) in enumerate(
        ((SMALL_SIZE, _SMALL_AXLES), (LARGEST.size[:2], LARGEST.axles))
    ):
        swept = [
            swept_hulls(piece, size, axles) if piece.is_way else None
            for piece in graph.pieces
        ]
        areas = [
            shapely.Polygon() if entry is None else shapely.union_all(entry[1])
            for entry in swept
        ]
        areas += [crossing.area for crossing in graph.crossings]
        tree = shapely.STRtree(areas)
        pairs = tree.query(areas, predicate="intersects").T.tolist()
        shapely.prepare(areas)
        for one, other in pairs:
            if one < num_pieces and one != other:
                front, hulls = swept[one]
                meets = np.flatnonzero(shapely.intersects(areas[other], hulls))
                first, last = meets[0], meets[-1]
                begin[k, one, other] = front[first]
                clear[k, one, other] = max(front[last + 1] - size[0], _STEP)
                if other >= num_pieces or last - first >= len(meets):
                    continue
                if first == 0 and origin.get(one, -1) == origin.get(other, -2):
                    joint[k, one, other] = SPLIT
                elif (
                    last == len(hulls) - 1
                    and graph.pieces[one].after == graph.pieces[other].after
                ):
                    joint[k, one, other] = MERGE
    for c, crossing in enumerate(graph.crossings, num_pieces):
        for k in [] if crossing.marked else graph.lanes:
            line = shapely.LineString(graph.pieces[k].points[:, :2])
            if line.intersects(crossing.area):
                ends = shapely.get_coordinates(line & crossing.area)[[0, -1]]
                begin[:, k, c], clear[:, k, c] = sorted(
                    line.project(shapely.Point(end)) for end in ends
                )
    return begin, clear, np.minimum(joint, joint.transpose(0, 2, 1))


def swept_hulls(
    piece: Piece, size: tuple[float, float], axles: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the areas that a vehicle sweeps on a piece, step by step.

    The areas include a lateral clearance of 0.25 m on either side.

    Args:
        piece: the piece of the lane graph along which the vehicle drives.
        size: length and width of the vehicle [m].
        axles: x of the rear and the front axle from the vehicle's middle [m].

    Returns:
        N + 1 distances of the front bumper along the piece [m]; the N areas
        swept from each distance to the next, as seen from above [m].
    """
    line = piece.points[:, :2]
    along = distances_along(line)
    length = along[-1]

    def at(s: np.ndarray) -> np.ndarray:
        """Returns the places (M, 2) at distances (M,) along the way [m].

        Beyond its ends, the way goes on straight.
        """
        inside = np.clip(s, 0.0, length)
        xy = np.column_stack([np.interp(inside, along, x) for x in line.T])
        first = (line[1] - line[0]) / math.dist(line[1], line[0])
        last = (line[-1] - line[-2]) / math.dist(line[-1], line[-2])
        xy += np.minimum(s, 0.0)[:, None] * first
        return xy + np.maximum(s - length, 0.0)[:, None] * last

    count = int(np.ceil((length + size[0]) / _STEP)) + 1
    front = np.linspace(0.0, length + size[0], count)
    middle = front - size[0] / 2
    rear_axle, front_axle = at(middle + axles[0]), at(middle + axles[1])
    ahead = front_axle - rear_axle
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    centre = rear_axle - axles[0] * ahead
    reach = size[0] / 2
    half = size[1] / 2 + _CLEARANCE
    corners = outlines(centre, ahead, reach, reach, half)
    points = np.concatenate([corners[:-1], corners[1:]], axis=1)
    return front, np.array(shapely.convex_hull(shapely.multipoints(points)))
