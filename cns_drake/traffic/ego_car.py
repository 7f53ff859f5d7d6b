"""The ego car's box, and when it is on each lane and crossing."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.base import cos, sin
from cns_drake.roads import outlines
from cns_drake.traffic.lane_graph import LaneGraph

# Time step of the plan [s].
STEP = 0.1
# Half the width of the strip of a lane that vehicles need, including their
# distance from the ego car [m].
_HALF_LANE = 1.45
# Least distance of two places whose direction is computed [m].
_LEAST_LENGTH = 1e-6
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


class EgoPlaces(NamedTuple):
    """Where the ego car is at K times, by P pieces and C crossings.

    Attributes:
        until: (K, P + C) float32, see `Streets.until`.
        rear, front: (K, P) float32, see `Streets.ego_rear`.
        speed: (K, P) float32, see `Streets.ego_speed`.
    """

    until: np.ndarray
    rear: np.ndarray
    front: np.ndarray
    speed: np.ndarray


def find_ego(
    graph: LaneGraph, box: EgoBox, xy: np.ndarray, yaw: np.ndarray
) -> EgoPlaces:
    """Returns on which pieces and crossings the ego car is, and when.

    For the arguments, see `cns_drake.traffic.streets.make_streets`.
    """
    # A car that stands is processed only once.
    poses = np.column_stack([xy, yaw])
    is_new = np.append(True, (np.diff(poses, axis=0) != 0.0).any(axis=1))
    corners = box.corners(xy[is_new], yaw[is_new])
    lines = np.array(
        [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    )
    areas = [
        line.buffer(_HALF_LANE, cap_style="flat", join_style="mitre")
        for line in lines
    ] + [crossing.area for crossing in graph.crossings]
    which, places = shapely.STRtree(areas).query(
        shapely.polygons(corners), predicate="intersects"
    )
    until = np.full((len(corners), len(areas)), np.inf, np.float32)
    until[which, places] = 0.0
    on_piece = places < len(lines)
    which, places = which[on_piece], places[on_piece]
    along = shapely.line_locate_point(
        lines[places][:, None], shapely.points(corners[which])
    )
    behind, ahead = along.min(axis=1), along.max(axis=1)
    rear, front, x, y = np.zeros((4, len(corners), len(lines)))
    rear[which, places], front[which, places] = behind, ahead
    x[which, places], y[which, places] = _tangents(
        lines[places], behind, ahead
    ).T
    velocity = np.gradient(xy, STEP, axis=0)
    pose = np.cumsum(is_new) - 1
    speed = velocity[:, :1] * x[pose] + velocity[:, 1:] * y[pose]
    return EgoPlaces(
        _times_until(until[pose]),
        *(each.astype(np.float32) for each in (rear[pose], front[pose], speed)),
    )


def _tangents(
    lines: np.ndarray, behind: np.ndarray, ahead: np.ndarray
) -> np.ndarray:
    """Returns unit vectors (N, 2) from one place of each line to another.

    Args:
        lines: (N,) the lines.
        behind, ahead: (N,) places along the lines [m].
    """
    tangent = np.subtract(
        *(
            shapely.get_coordinates(shapely.line_interpolate_point(lines, end))
            for end in (ahead, behind)
        )
    )
    length = np.linalg.norm(tangent, axis=1)
    return tangent / np.maximum(length, _LEAST_LENGTH)[:, None]


def _times_until(until: np.ndarray) -> np.ndarray:
    """Returns the times until the ego car is at places, at each time step [s].

    Args:
        until: (K, N) 0 where the ego car is at the place, otherwise infinite;
            changed in place.
    """
    for k in range(len(until) - 2, -1, -1):
        np.minimum(until[k], until[k + 1] + STEP, out=until[k])
    return until
