"""Broken lines between the lanes of imported streets."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString

from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.foreign_city import Imported, Rgb, Street, make_imported

# Streets get marks if they are this near to drives, and at least this wide [m].
_WITHIN, _LEAST_WIDTH = 80.0, 6.0
_CLASSES = ("primary", "secondary", "tertiary")
# Length of a dash, of its gap, its width, its height above the street, and the
# free length before a junction besides half the street's width [m].
_DASH, _GAP, _WIDTH, _HEIGHT, _BEFORE = 3.0, 6.0, 0.12, 0.01, 4.0
_WHITE: Rgb = (0.86, 0.86, 0.84)


def lane_marks(
    streets: Sequence[Street], drives: Sequence[WaypointDrive]
) -> Iterator[Imported]:
    """Yields the middle lines of the larger streets near drives.

    Args:
        streets: of the file, on level ground.
        drives: through the city, at least one.
    """
    paths = MultiLineString([drive.path for drive in drives])
    junctions = _junctions(streets)
    for street in streets:
        line = LineString(street.line)
        lanes = street.tags.get("lanes", "1")
        if (
            street.forward
            and street.backward
            and street.width >= _LEAST_WIDTH
            and (street.tags.get("highway") in _CLASSES or lanes == "2")
            and line.distance(paths) < _WITHIN
        ):
            middles = np.arange(_GAP, line.length - _DASH, _DASH + _GAP)
            places = shapely.line_interpolate_point(line, middles)
            free = street.width / 2.0 + _BEFORE
            # Without junctions the distance is NaN.
            kept = ~(shapely.distance(places, junctions) <= free)
            dashes = [_dash(line, s) for s in middles[kept].tolist()]
            if dashes:
                yield make_imported(
                    f"marks_{street.name}",
                    "road",
                    "Lane mark",
                    {"paint": np.concatenate(dashes)},
                    {"paint": _WHITE},
                )


def _junctions(streets: Sequence[Street]) -> shapely.MultiPoint:
    """Returns the places where more than two ends of streets meet."""
    ends: Counter[int] = Counter()
    places = {}
    for street in streets:
        last = len(street.nodes) - 1
        for k, node in enumerate(street.nodes):
            ends[node] += 1 if k in (0, last) else 2
            places[node] = street.line[k]
    return shapely.MultiPoint([places[n] for n in ends if ends[n] > 2])


def _dash(line: LineString, s: float) -> np.ndarray:
    """Returns a dash about a place of a line, (2, 3, 3) triangles [m]."""
    ends = [line.interpolate(s + k * _DASH / 2.0) for k in (-1.0, 1.0)]
    a, b = (np.array([end.x, end.y]) for end in ends)
    along = (b - a) / np.hypot(*(b - a))
    left = np.array([-along[1], along[0]]) * _WIDTH / 2.0
    ring = np.array([a - left, b - left, b + left, a + left])
    corners = np.column_stack([ring, np.full(4, _HEIGHT)])
    return corners[[[0, 1, 2], [0, 2, 3]]]
