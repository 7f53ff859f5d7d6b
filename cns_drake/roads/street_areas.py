"""The interface of streets to a city, for any source of streets."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry import MultiPolygon


class StreetAreas(Protocol):
    """The areas of streets in the world [m]."""

    def carriageway(self) -> MultiPolygon:
        """Returns the carriageway: the area where vehicles drive or park."""
        ...

    def lane_area(self) -> MultiPolygon:
        """Returns the carriageway without parking bays."""
        ...

    def sidewalks(self) -> MultiPolygon:
        """Returns the sidewalks: areas beside the road, a kerb higher."""
        ...

    def medians(self) -> MultiPolygon:
        """Returns the medians: areas between the directions, a kerb higher."""
        ...


class SurfaceHeights(Protocol):
    """The height of carriageways."""

    @property
    def is_level(self) -> bool:
        """Whether they lie at z = 0 throughout."""
        ...

    def heights(self, xy: ArrayLike) -> np.ndarray:
        """Returns the (N,) heights at (N, 2) places [m]."""
        ...
