"""The ego car's box, and when it is on each lane and crossing."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.base.elementary import cos, sin
from cns_drake.roads.car_outline import outlines
from cns_drake.traffic.lane_graph import LaneGraph

# Time step of the plan [s].
STEP = 0.1
# Half the width of the strip of a lane that vehicles need, including their
# distance from the ego car [m].
_HALF_LANE = 1.45
# The ego car's motion: times (K,) -> places (K, 2) [m] and headings (K,) [rad].
EgoPath = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class EgoBox(NamedTuple):
    """The rectangle on the ground that the ego car covers, in the car's frame.

    Attributes:
        rear: x of the rear end [m], negative.
        front: x of the front end [m].
        half_width: half of the width [m].
    """

    rear: float
    front: float
    half_width: float

    @property
    def half_size(self) -> tuple[float, float]:
        """Half the length and half the width of the box [m]."""
        return (self.front - self.rear) / 2, self.half_width

    def middles(self, xy: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns x, y [m] and yaw [rad] of the box's centre, (N, 3).

        Args:
            xy: (N, 2) positions of the car's frame [m].
            yaw: (N,) headings of the car [rad].
        """
        ahead = np.column_stack([cos(yaw), sin(yaw)])
        middle = (self.rear + self.front) / 2
        return np.column_stack([xy + middle * ahead, yaw])

    def corners(self, xy: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns the corners of the car's box at N poses, (N, 4, 2) [m].

        Args:
            xy: (N, 2) positions of the car's frame [m].
            yaw: (N,) headings of the car [rad].
        """
        ahead = np.column_stack([cos(yaw), sin(yaw)])
        return outlines(xy, ahead, -self.rear, self.front, self.half_width)


def find_ego(
    graph: LaneGraph, box: EgoBox, xy: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Returns the fields of `Streets` from `until` on; see `make_streets`."""
    # A car that stands is processed only once.
    poses = np.column_stack([xy, yaw])
    is_new = np.append(True, (np.diff(poses, axis=0) != 0.0).any(axis=1))
    corners = box.corners(xy[is_new], yaw[is_new])
    boxes = shapely.polygons(corners)
    lines = np.array(
        [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    )
    areas = [
        line.buffer(_HALF_LANE, cap_style="flat", join_style="mitre")
        for line in lines
    ] + [crossing.area for crossing in graph.crossings]
    until = np.full((len(corners), len(areas)), np.inf, np.float32)
    rear, front, x, y = np.zeros((4, len(corners), len(lines)))
    which, places = shapely.STRtree(areas).query(boxes, predicate="intersects")
    until[which, places] = 0.0
    on_piece = places < len(lines)
    which, places = which[on_piece], places[on_piece]
    along = shapely.line_locate_point(
        lines[places][:, None], shapely.points(corners[which])
    )
    behind, ahead = along.min(axis=1), along.max(axis=1)
    rear[which, places], front[which, places] = behind, ahead
    tangent = np.subtract(
        *(
            shapely.get_coordinates(
                shapely.line_interpolate_point(lines[places], end)
            )
            for end in (ahead, behind)
        )
    )
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-6)[:, None]
    x[which, places], y[which, places] = tangent.T
    velocity = np.gradient(xy, STEP, axis=0)
    pose = np.cumsum(is_new) - 1
    speed = velocity[:, :1] * x[pose] + velocity[:, 1:] * y[pose]
    until = until[pose]
    for k in range(len(xy) - 2, -1, -1):
        np.minimum(until[k], until[k + 1] + STEP, out=until[k])
    return until, *(
        each.astype(np.float32) for each in (rear[pose], front[pose], speed)
    )
