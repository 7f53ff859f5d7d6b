"""Places for small objects beside streets."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from cns_drake.city.placement.frontage import station_at
from cns_drake.imports.streets import Street

# Objects on a carriageway are moved to this distance beside its edge [m].
FROM_EDGE = 0.6
# Objects closer to the middle of a street are on neither side of it [m].
_IN_THE_MIDDLE = 0.05


def beside_street(
    xy: np.ndarray, streets: Sequence[Street], courses: Sequence[LineString]
) -> tuple[np.ndarray, float]:
    """Returns a place beside the nearest street, and the heading to the street.

    A place on or close to the carriageway is moved to 0.6 m from the edge of
    the carriageway. Any other place stays. The heading is from the place to the
    middle of the street [rad].

    Args:
        xy: (2,) the place in W [m].
        streets: the streets.
        courses: middle line of each street [m].
    """
    point = Point(xy)
    distances = shapely.distance(courses, point)
    nearest = int(np.argmin(distances))
    line = courses[nearest]
    half = streets[nearest].width / 2.0
    station = station_at(line, line.project(point))
    middle = np.array([station.x, station.y])
    offset = xy - middle
    distance = float(np.hypot(*offset))
    if distance < _IN_THE_MIDDLE:
        # On the right of the street, where signs stand.
        offset = np.array([np.sin(station.yaw), -np.cos(station.yaw)])
        distance = 1.0
    outwards = offset / distance
    if distances[nearest] < half + FROM_EDGE:
        xy = middle + outwards * (half + FROM_EDGE)
    return xy, float(np.arctan2(-outwards[1], -outwards[0]))


def place_along(
    line: LineString, s: float, side: float, offset: float
) -> tuple[tuple[float, float], float]:
    """Returns a place beside a line, and the heading of the line [rad].

    Args:
        line: the line in W [m].
        s: distance along the line [m].
        side: 1 for the right side, -1 for the left.
        offset: distance from the line [m].
    """
    at = station_at(line, s)
    x = at.x + side * offset * float(np.sin(at.yaw))
    y = at.y - side * offset * float(np.cos(at.yaw))
    return (x, y), at.yaw
