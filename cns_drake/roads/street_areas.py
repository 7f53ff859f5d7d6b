"""What a city needs of its streets, whoever drew them."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry import MultiPolygon


class StreetAreas(Protocol):
    """The areas of streets in the world [m]."""

    def carriageway(self) -> MultiPolygon:
        """Returns what vehicles drive or park on."""
        ...

    def lane_area(self) -> MultiPolygon:
        """Returns the carriageway without what vehicles park on."""
        ...

    def sidewalks(self) -> MultiPolygon:
        """Returns what lies beside the carriageway, a kerb higher."""
        ...

    def medians(self) -> MultiPolygon:
        """Returns what lies between the directions, a kerb higher."""
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
