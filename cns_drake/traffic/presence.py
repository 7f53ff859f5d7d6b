"""Times at which the ego car is on each lane, way and crossing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.traffic.lane_graph import LaneGraph

# Half the width of a vehicle's strip of its lane, with its distance from the
# ego car [m].
_HALF_LANE = 1.45


class EgoBox(NamedTuple):
    """The ego car's box on the ground.

    Attributes:
        rear, front: x of its ends in the vehicle frame [m].
        half_width: [m].
    """

    rear: float
    front: float
    half_width: float

    def corners(self, xy: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns (N, 4, 2) corners at (N, 2) places and (N,) headings."""
        c, s = np.cos(yaw), np.sin(yaw)
        outline = (
            (self.rear, -self.half_width),
            (self.front, -self.half_width),
            (self.front, self.half_width),
            (self.rear, self.half_width),
        )
        return np.stack(
            [
                np.stack(
                    [xy[:, 0] + x * c - y * s, xy[:, 1] + x * s + y * c], 1
                )
                for x, y in outline
            ],
            axis=1,
        )


class Presence(NamedTuple):
    """The ego car's presence at K times on P pieces and C crossings.

    Attributes:
        until: (K, P + C) float32 time until it is there, 0 while it is, inf if
            it never will be [s].
        rear, front: (K, P) float32 distance of its ends along a piece while it
            is there [m].
        speed: (K, P) float32 along the piece, negative against it [m/s].
    """

    until: np.ndarray
    rear: np.ndarray
    front: np.ndarray
    speed: np.ndarray


def find_presence(
    graph: LaneGraph,
    box: EgoBox,
    xy: np.ndarray,
    yaw: np.ndarray,
    dt: float,
) -> Presence:
    """Returns the presence of the ego car.

    Args:
        graph: lanes and ways.
        box: of the car.
        xy: (K, 2) places of its frame [m].
        yaw: (K,) headings [rad].
        dt: between them [s].
    """
    corners = box.corners(xy, yaw)
    boxes = shapely.polygons(corners)
    lines = [shapely.LineString(p.points[:, :2]) for p in graph.pieces]
    areas = [
        line.buffer(_HALF_LANE, cap_style="flat", join_style="mitre")
        for line in lines
    ] + [crossing.area for crossing in graph.crossings]
    shape = (len(xy), len(graph.pieces))
    until = np.full((len(xy), len(areas)), np.inf, np.float32)
    rear = np.zeros(shape, np.float32)
    front = np.zeros(shape, np.float32)
    speed = np.zeros(shape, np.float32)
    times, places = shapely.STRtree(areas).query(boxes, predicate="intersects")
    until[times, places] = 0.0
    on_piece = places < len(graph.pieces)
    times, places = times[on_piece], places[on_piece]
    along = np.stack(
        [
            shapely.line_locate_point(
                np.array(lines)[places], shapely.points(corners[times, k])
            )
            for k in range(4)
        ]
    )
    rear[times, places] = along.min(axis=0)
    front[times, places] = along.max(axis=0)
    velocity = np.gradient(xy, dt, axis=0)
    ahead = shapely.line_interpolate_point(
        np.array(lines)[places], along.max(axis=0)
    )
    behind = shapely.line_interpolate_point(
        np.array(lines)[places], along.min(axis=0)
    )
    tangent = shapely.get_coordinates(ahead) - shapely.get_coordinates(behind)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-6)[:, None]
    speed[times, places] = np.sum(velocity[times] * tangent, axis=1)
    for k in range(len(xy) - 2, -1, -1):
        np.minimum(until[k], until[k + 1] + dt, out=until[k])
    return Presence(until, rear, front, speed)
