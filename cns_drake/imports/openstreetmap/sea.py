"""The sea beside the coastlines of OpenStreetMap.

https://wiki.openstreetmap.org/wiki/Tag:natural%3Dcoastline
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Point, box
from shapely.geometry.base import BaseGeometry

from cns_drake.imports import faces
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.openstreetmap.area_looks import flat_object
from cns_drake.imports.openstreetmap.features import OsmWay
from cns_drake.imports.openstreetmap.grounds import WATER_LOOK
from cns_drake.scene import LocalMetres

# A coastline that ends within the city is extended by this length [m].
_COAST_EXTENSION = 3000.0
# Probes at this distance from a coastline find the side of the sea [m].
_COAST_PROBE = 0.1


def coasts_of(ways: Iterable[OsmWay]) -> list[OsmWay]:
    """Returns the coastlines among ways; land is on their left."""
    return [way for way in ways if way.tags.get("natural") == "coastline"]


def sea(
    coasts: Sequence[OsmWay],
    local: LocalMetres,
    limits: np.ndarray,
    faults: ImportFaults,
) -> Iterator[ImportedObject]:
    """Yields the sea, to the right of the coastlines, if there are any.

    Args:
        coasts: the coastlines.
        local: converts places of the file to metres.
        limits: (2, 2) the least and the greatest x and y of the sea [m].
        faults: counts parts that were repaired or left out.
    """
    if not coasts:
        return
    lines = [LineString(local(way.line)) for way in coasts]
    lines = [line for line in lines if line.length > 0.0]
    merged = shapely.get_parts(shapely.line_merge(shapely.union_all(lines)))
    whole = box(*limits.ravel().tolist())
    cuts = [
        _extended_within(line, whole).intersection(whole) for line in merged
    ]
    edges = shapely.union_all([whole.boundary, *cuts])
    areas = shapely.get_parts(shapely.polygonize([edges]))
    water = shapely.union_all([area for area in areas if _is_sea(area, lines)])
    yield from flat_object(
        f"sea_{coasts[0].name}", WATER_LOOK, faces.parts_of(water), faults
    )


def _extended_within(line: LineString, whole: BaseGeometry) -> LineString:
    """Extends a line straight on at each end that lies within an area."""
    points = np.array(line.coords)
    if line.is_closed:
        return line
    for end, before in ((0, 1), (-1, -2)):
        if whole.contains(Point(points[end])):
            ahead = points[end] - points[before]
            if not ahead.any():
                continue
            far = points[end] + _COAST_EXTENSION * ahead / np.hypot(*ahead)
            points = (
                np.vstack([far, points])
                if end == 0
                else np.vstack([points, far])
            )
    return LineString(points)


def _is_sea(area: BaseGeometry, coasts: Sequence[LineString]) -> bool:
    """Returns whether an area is on the right of most of its coastline."""
    shapely.prepare(area)
    # Length of coast that has the area on its right, minus the length that has
    # it on its left [m].
    balance = 0.0
    for coast in coasts:
        points = np.array(coast.coords)
        steps = np.diff(points, axis=0)
        length = np.hypot(*steps.T)
        used = length > 0.0
        middles = (points[:-1] + steps / 2.0)[used]
        steps, length = steps[used], length[used]
        aside = (
            _COAST_PROBE * np.c_[steps[:, 1], -steps[:, 0]] / length[:, None]
        )
        for side in (1.0, -1.0):
            places = shapely.points(middles + side * aside)
            beside = length[shapely.contains(area, places)]
            balance += side * float(beside.sum())
    return balance > 0.0
