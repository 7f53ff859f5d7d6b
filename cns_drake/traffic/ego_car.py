"""The ego car's box, and which road users it would meet."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.traffic.traffic_plan import Tracks
from evaluation.base import cos, sin
from worlds.shapes import car_outlines, overlap

# Greatest time between two comparisons of road users with the ego car [s]: they
# notice everything that crosses its path.
STEP = 0.1
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
        return car_outlines(xy, ahead, -self.rear, self.front, self.half_width)


# Number of times that are compared at once.
_AT_ONCE = 200


def meetings_with_ego(
    tracks: Tracks,
    sizes: Sequence[tuple[float, ...]],
    times: np.ndarray,
    ego: EgoPath,
    box: EgoBox,
) -> np.ndarray:
    """Returns (K, N) which bodies overlap the ego car at each of the times.

    Args:
        tracks: tracks of the N bodies, with the coordinates of `TrafficPlan`.
        sizes: length and width of each body's box [m]; a height is ignored.
        times: (K,) the times [s].
        ego: motion of the ego car.
        box: size of the ego car.
    """
    half = np.array([size[:2] for size in sizes]).reshape(-1, 2) / 2
    reach = np.hypot(*half.T) + np.hypot(*box.half_size)
    met = np.zeros((len(times), len(half)), bool)
    for first in range(0, len(times), _AT_ONCE):
        some = times[first : first + _AT_ONCE]
        xy, yaw = ego(some)
        values, _ = tracks.at(some)
        x, y = np.moveaxis(values[:, :, :2], -1, 0)
        middle = box.middles(xy, yaw)
        near = np.hypot(x - middle[:, :1], y - middle[:, 1:2]) < reach
        time, body = np.nonzero(near & tracks.is_present(some))
        own = values[time, body]
        ahead = np.column_stack([cos(own[:, 3]), sin(own[:, 3])])
        long, wide = half[body, :1], half[body, 1:]
        bodies = car_outlines(own[:, :2], ahead, long, long, wide)
        own_car = box.corners(xy[time], yaw[time])
        do_meet = overlap(own_car, bodies)
        met[first + time[do_meet], body[do_meet]] = True
    return met
