"""Conflicts: ways and crossings that cannot be used at the same time."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.vehicle_kinds import LARGEST, SMALL_SIZE

# Distance of the places at which a vehicle's outline is drawn, and free space
# around it [m].
_STEP = 1.0
_CLEARANCE = 0.25


def find_conflicts(graph: LaneGraph) -> tuple[np.ndarray, np.ndarray]:
    """Returns which pieces and crossings exclude each other.

    Two different ways exclude each other if their swept areas meet; lanes
    exclude nothing.

    Returns:
        Two symmetric boolean (P + C, P + C) matrices over pieces and then
        crossings: while all vehicles are small, and while one is large.
    """
    small_axles = (-1.6, 1.75)
    results = []
    for size, axles in (
        (SMALL_SIZE, small_axles),
        (LARGEST.size[:2], LARGEST.axles),
    ):
        areas = [
            swept_area(piece, size, axles)
            if piece.is_way
            else shapely.Polygon()
            for piece in graph.pieces
        ]
        areas += [crossing.area for crossing in graph.crossings]
        tree = shapely.STRtree(areas)
        rows, columns = tree.query(areas, predicate="intersects")
        matrix = np.zeros((len(areas), len(areas)), bool)
        matrix[rows, columns] = True
        matrix[len(graph.pieces) :, len(graph.pieces) :] = False
        np.fill_diagonal(matrix, False)
        results.append(matrix)
    return results[0], results[1]


def swept_area(
    piece: Piece, size: tuple[float, float], axles: tuple[float, float]
) -> BaseGeometry:
    """Returns the area that a vehicle sweeps on a way.

    Args:
        piece: the way.
        size: length and width of the vehicle [m].
        axles: x of its rear and front axle from its middle [m].
    """
    line = piece.points[:, :2]
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    length = along[-1]

    def at(s: np.ndarray) -> np.ndarray:
        """Returns places on the way, continued straight beyond its ends."""
        inside = np.clip(s, 0.0, length)
        xy = np.column_stack([np.interp(inside, along, x) for x in line.T])
        first = (line[1] - line[0]) / steps[0]
        last = (line[-1] - line[-2]) / steps[-1]
        xy += np.minimum(s, 0.0)[:, None] * first
        return xy + np.maximum(s - length, 0.0)[:, None] * last

    count = int(np.ceil((length + size[0]) / _STEP)) + 1
    front = np.linspace(0.0, length + size[0], count)
    middle = front - size[0] / 2
    rear_axle, front_axle = at(middle + axles[0]), at(middle + axles[1])
    ahead = front_axle - rear_axle
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    left = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    centre = rear_axle - axles[0] * ahead
    reach, half = size[0] / 2, size[1] / 2 + _CLEARANCE
    corners = np.stack(
        [
            centre + x * ahead + y * left
            for x, y in (
                (reach, half),
                (reach, -half),
                (-reach, -half),
                (-reach, half),
            )
        ],
        axis=1,
    )
    hulls = shapely.convex_hull(
        shapely.multipoints(np.concatenate([corners[:-1], corners[1:]], axis=1))
    )
    return shapely.union_all(hulls)
