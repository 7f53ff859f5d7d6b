"""The height of the street surface at any place."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from evaluation.base import cos, sin
from worlds.roads.network import RoadNetwork

# Returns the heights (N,) of sidewalks above the road at places (N, 2) [m].
KerbMap = Callable[[np.ndarray], np.ndarray]


class SurfaceHeights(Protocol):
    """The interface of an object that returns heights of carriageways."""

    @property
    def is_level(self) -> bool:
        """Whether the surface is at z = 0 everywhere."""

    def heights(self, xy: ArrayLike) -> np.ndarray:
        """Returns the heights (N,) of the surface at places (N, 2) in W [m]."""


# Distance between the places on centrelines that are searched first [m].
_SPACING = 0.5


class RoadSurface:
    """The height of carriageways, continued beyond their edges.

    Roads are level across. The height at a place is therefore the height of the
    nearest point on a centreline. Away from the roads, the height has a step
    where the nearest road changes.
    """

    def __init__(self, network: RoadNetwork):
        """Samples the centrelines of a network."""
        self._roads = list(network.roads.values())
        places, owners, stations = [], [], []
        for k, road in enumerate(self._roads):
            count = int(np.ceil(road.full_length / _SPACING)) + 1
            along = np.linspace(0.0, road.full_length, count)
            places.append(road.evaluate(along))
            owners.append(np.full(count, k))
            stations.append(along)
        self._places = np.concatenate(places)
        self._owners = np.concatenate(owners)
        self._stations = np.concatenate(stations)
        self._tree = cKDTree(self._places[:, :2])

    @property
    def is_level(self) -> bool:
        """Whether all roads are at z = 0."""
        return not self._places[:, 2].any()

    def heights(self, xy: ArrayLike) -> np.ndarray:
        """Returns the heights (N,) at places (N, 2) [m]."""
        xy = np.asarray(xy, dtype=float).reshape(-1, 2)
        _, index = self._tree.query(xy)
        x, y, _, heading = self._places[index].T
        ahead = (xy[:, 0] - x) * cos(heading) + (xy[:, 1] - y) * sin(heading)
        # On the inside of a bend, the tangent would lead beyond the
        # neighbouring place.
        ahead = np.clip(ahead, -_SPACING, _SPACING)
        stations = self._stations[index] + ahead
        z = np.empty(len(xy))
        owners = self._owners[index]
        for k in np.unique(owners):
            chosen = owners == k
            road = self._roads[k]
            inside = np.clip(stations[chosen], 0.0, road.full_length)
            z[chosen] = road.height(inside)
        return z
