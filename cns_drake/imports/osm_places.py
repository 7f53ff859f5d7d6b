"""Places of OpenStreetMap in metres, and valid areas."""

from __future__ import annotations

from collections.abc import Iterator
import math

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.validation import make_valid

from cns_drake.imports.import_faults import ImportFaults

# The Earth's axes, WGS 84 [m].
_SEMI_MAJOR = 6378137.0
_FLATTENING = 1.0 / 298.257223563
_LEAST_AREA = 0.01  # [m^2]


class Local:
    """Places in metres east and north of an origin.

    By the Earth's radii of curvature there: right to 1 in 10,000 within
    10 km.
    """

    def __init__(self, longitude: float, latitude: float):
        e2 = _FLATTENING * (2.0 - _FLATTENING)
        s = math.sin(math.radians(latitude))
        w2 = 1.0 - e2 * s * s
        north = _SEMI_MAJOR * (1.0 - e2) / w2**1.5
        east = _SEMI_MAJOR / math.sqrt(w2) * math.cos(math.radians(latitude))
        self._origin = np.array([longitude, latitude])
        self._metres = np.radians(1.0) * np.array([east, north])

    def __call__(self, places: np.ndarray) -> np.ndarray:
        offset = places - self._origin
        # The shorter way round, also across the 180th meridian.
        offset[..., 0] -= 360.0 * np.rint(offset[..., 0] / 360.0)
        return self.metres(offset)

    def metres(self, offset: np.ndarray) -> np.ndarray:
        """Returns a distance (..., 2) in degrees as one in metres."""
        return np.asarray(offset * self._metres)

    def polygon(self, polygon: Polygon) -> Polygon:
        return shapely.transform(polygon, self)


def parts_of(geometry: BaseGeometry) -> Iterator[Polygon]:
    """Yields the polygons of a geometry that has any."""
    if isinstance(geometry, Polygon):
        if geometry.area > _LEAST_AREA:
            yield geometry
        return
    for one in getattr(geometry, "geoms", ()):
        yield from parts_of(one)


def sound_parts(
    polygon: Polygon, name: str, faults: ImportFaults
) -> list[Polygon]:
    """Returns a polygon's valid parts, in whole millimetres."""
    geometry: BaseGeometry = polygon
    if not polygon.is_valid:
        faults.add("outline that crosses itself, repaired", name)
        geometry = make_valid(polygon)
    return list(parts_of(shapely.set_precision(geometry, 0.001)))
