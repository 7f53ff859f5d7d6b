"""Dashed lines in the middle of imported streets."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString

from cns_drake.city.ground.markings import DASH, DASH_GAP
from cns_drake.imports.colours import WHITE_PAINT
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.imported_objects import ImportedObject, make_object
from cns_drake.imports.streets import Street, ends_at_nodes

# Streets get marks if they are this close to drives [m].
_MARKS_WITHIN = 80.0
# Streets get marks if they are at least this wide [m].
_LEAST_MARKED = 6.0
# Streets of these kinds get marks, as do streets with two lanes.
_MARKED_KINDS = ("primary", "secondary", "tertiary")
# Width of a dash [m].
_DASH_WIDTH = 0.12
# Height of a dash above the street [m].
_DASH_HEIGHT = 0.01
# Length before a junction that stays free, in addition to half the street's
# width [m].
_BEFORE_JUNCTION = 4.0


def lane_marks(
    streets: Sequence[Street], drives: Sequence[WaypointRoute]
) -> Iterator[ImportedObject]:
    """Yields dashed lines in the middle of the larger streets near drives.

    There must be at least one drive, and the ground must be level.
    """
    paths = MultiLineString([drive.path for drive in drives])
    junctions = _junctions(streets)
    for street in streets:
        line = LineString(street.line)
        lanes = street.tags.get("lanes", "1")
        if (
            street.forward
            and street.backward
            and street.width >= _LEAST_MARKED
            and (street.tags.get("highway") in _MARKED_KINDS or lanes == "2")
            and line.distance(paths) < _MARKS_WITHIN
        ):
            middles = np.arange(DASH_GAP, line.length - DASH, DASH + DASH_GAP)
            places = shapely.line_interpolate_point(line, middles)
            free = street.width / 2.0 + _BEFORE_JUNCTION
            # Without any junction, the distance is NaN.
            kept = ~(shapely.distance(places, junctions) <= free)
            dashes = [_dash(line, s) for s in middles[kept].tolist()]
            if dashes:
                yield make_object(
                    f"marks_{street.name}",
                    "road",
                    "Lane mark",
                    {"paint": np.concatenate(dashes)},
                    {"paint": WHITE_PAINT},
                )


def _junctions(streets: Sequence[Street]) -> shapely.MultiPoint:
    """Returns the places where more than two street ends meet."""
    ends = ends_at_nodes(streets)
    places = {
        node: place
        for street in streets
        for node, place in zip(street.nodes, street.line, strict=True)
    }
    return shapely.MultiPoint([places[n] for n in ends if ends[n] > 2])


def _dash(line: LineString, s: float) -> np.ndarray:
    """Returns a dash at arc length `s` of a line: triangles (2, 3, 3) [m]."""
    ends = [line.interpolate(s + k * DASH / 2.0) for k in (-1.0, 1.0)]
    a, b = (np.array([end.x, end.y]) for end in ends)
    along = (b - a) / np.hypot(*(b - a))
    left = np.array([-along[1], along[0]]) * _DASH_WIDTH / 2.0
    ring = np.array([a - left, b - left, b + left, a + left])
    corners = np.column_stack([ring, np.full(4, _DASH_HEIGHT)])
    return corners[[[0, 1, 2], [0, 2, 3]]]
