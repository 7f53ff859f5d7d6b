"""Places beside the carriageways of streets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from cns_drake.city.placement.frontage import station_at
from cns_drake.imports.foreign_city import Street

# A thing on a carriageway is moved beside it, to this distance from its edge
# [m].
FROM_EDGE = 0.6


def beside_street(
    xy: np.ndarray, streets: Sequence[Street], courses: Sequence[LineString]
) -> tuple[np.ndarray, float]:
    """Returns a place off the carriageway, and the heading to the street."""
    point = Point(xy)
    distances = shapely.distance(courses, point)
    nearest = int(np.argmin(distances))
    line, half = courses[nearest], streets[nearest].width / 2.0
    station = station_at(line, line.project(point))
    foot = np.array([station.x, station.y])
    offset = xy - foot
    distance = float(np.hypot(*offset))
    if distance < 0.05:
        # On the right of the street, as signs are.
        offset = np.array([np.sin(station.yaw), -np.cos(station.yaw)])
        distance = 1.0
    outwards = offset / distance
    if distances[nearest] < half + FROM_EDGE:
        xy = foot + outwards * (half + FROM_EDGE)
    return xy, float(np.arctan2(-outwards[1], -outwards[0]))


def place_along(
    line: LineString, s: float, side: float, offset: float
) -> tuple[tuple[float, float], float]:
    """Returns a place beside a line, right for side 1, and its heading."""
    at = station_at(line, s)
    x = at.x + side * offset * float(np.sin(at.yaw))
    y = at.y - side * offset * float(np.cos(at.yaw))
    return (x, y), at.yaw
