"""Lines along streets, and lots along these lines."""

import itertools
import math
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import linemerge

from evaluation.base import arctan2, dot, wrapped
from worlds.shapes import placed

# A vertex at which a line turns by more than this is a corner [rad].
_CORNER = math.radians(25)
# Number of segments per quarter turn at round corners of parallel lines.
_QUAD_SEGMENTS = 16
# At either end of a lot's straight front, the street may bend away by at most
# this angle [rad]. Houses around a tighter curve, or in a corner, would look
# askew.
_BEND = math.radians(17)
# The heading at a place is the heading of a chord twice as long as this [m].
_SHORT = 0.25
# Shorter lines along streets are left out [m].
_LEAST_LINE = 1.0
# Least length of the chord of a lot's front, as a share of the front's length.
_LEAST_CHORD = 0.9
# Shares of a front at which its distance from its chord is measured.
_CHORD_SHARES = np.linspace(0.1, 0.9, 9)
# Where the side of a line with the street is determined, as a share of its
# length: a place that is unlikely to be a corner.
_SIDE_AT = 0.37
# Distance from the line at which the two sides are compared [m].
_SIDE_DISTANCE = 0.3


class Lot(NamedTuple):
    """A rectangle of ground for one building; its front faces the street.

    (x, y) is the centre of the lot in W [m] and the origin of its frame S. The
    x axis of S runs along the front, and the y axis points away from the
    street; `yaw` is the heading of S in W [rad]. `width` is along x, and
    `depth` along y [m].
    """

    x: float
    y: float
    yaw: float
    width: float
    depth: float

    @property
    def footprint(self) -> Polygon:
        """Rectangle of the lot in S [m]."""
        w, d = self.width / 2, self.depth / 2
        return box(-w, -d, w, d)

    @property
    def footprint_W(self) -> Polygon:
        """Rectangle of the lot in W [m]."""
        return placed(self.footprint, (self.x, self.y), self.yaw)


class Station(NamedTuple):
    """A place on a line in W [m], and the heading of the line there [rad]."""

    x: float
    y: float
    yaw: float


def lines_along(
    streets: BaseGeometry, within: BaseGeometry, distance: float
) -> list[LineString]:
    """Returns lines parallel to streets, as far as they lie in an area.

    Lines are split at corners. The street is on the right of each line. The
    order of the lines is always the same.

    Args:
        streets: area of the streets in W [m].
        within: the area in W [m].
        distance: distance of the lines from the streets [m].
    """
    edge = streets.buffer(distance, quad_segs=_QUAD_SEGMENTS).boundary
    cut = shapely.set_precision(edge.intersection(within), 0.001)
    if cut.is_empty:
        return []
    lines = [cut] if isinstance(cut, LineString) else shapely.get_parts(cut)
    merged = linemerge([x for x in lines if isinstance(x, LineString)])
    pieces = [
        piece
        for line in shapely.get_parts(merged)
        for piece in _split_at_corners(_street_on_right(line, streets))
        if piece.length > _LEAST_LINE
    ]
    return sorted(
        pieces, key=lambda p: np.round([*p.coords[0], p.length], 6).tolist()
    )


def station_at(line: LineString, s: float) -> Station:
    """Returns the place and heading at the distance `s` along a line [m]."""
    before = line.interpolate(max(s - _SHORT, 0.0))
    after = line.interpolate(min(s + _SHORT, line.length))
    at = line.interpolate(s)
    yaw = math.atan2(after.y - before.y, after.x - before.x)
    return Station(at.x, at.y, yaw)


def lot_at(
    line: LineString, start: float, width: float, depth: float
) -> Lot | None:
    """Returns the lot whose front begins at a distance along a line.

    The result is None if the line ends before the lot does, or bends too much.

    Args:
        line: line along a street [m]. The street is to the right of the line,
            the lot to the left.
        start: distance along the line at which the front begins [m].
        width: length of the front [m].
        depth: depth of the lot, away from the street [m].
    """
    end = start + width
    if end > line.length + 1e-6:
        return None
    a = np.array(line.interpolate(start).coords[0])
    b = np.array(line.interpolate(end).coords[0])
    chord = float(np.hypot(*(b - a)))
    if chord < _LEAST_CHORD * width:
        return None
    along = (b - a) / chord
    away = np.array([-along[1], along[0]])
    yaw = math.atan2(along[1], along[0])
    ends = (station_at(line, s) for s in (start + _SHORT, end - _SHORT))
    if any(abs(wrapped(at.yaw - yaw)) > _BEND for at in ends):
        return None
    # Where the line bends around the street, its chord comes closer to the
    # street. The front moves back by the difference.
    between = [
        np.array(line.interpolate(start + width * u).coords[0]) - a
        for u in _CHORD_SHARES
    ]
    step_back = max(0.0, *(float(dot(p, away)) for p in between))
    centre = (a + b) / 2 + away * (depth / 2 + step_back)
    return Lot(float(centre[0]), float(centre[1]), yaw, chord, depth)


def _street_on_right(line: LineString, streets: BaseGeometry) -> LineString:
    """Returns the line, reversed if the street is on its left."""
    at = station_at(line, line.length * _SIDE_AT)
    x_step = math.sin(at.yaw) * _SIDE_DISTANCE
    y_step = math.cos(at.yaw) * _SIDE_DISTANCE
    left = Point(at.x - x_step, at.y + y_step)
    right = Point(at.x + x_step, at.y - y_step)
    if streets.distance(left) < streets.distance(right):
        return LineString(line.coords[::-1])
    return line


def _split_at_corners(line: LineString) -> list[LineString]:
    """Returns the pieces of a line between its corners, in order."""
    coordinates = np.array(line.coords)[:, :2]
    edges = np.diff(coordinates, axis=0)
    heading = arctan2(edges[:, 1], edges[:, 0])
    turns = wrapped(np.diff(heading))
    corners = np.flatnonzero(np.abs(turns) > _CORNER) + 1
    closed = bool(np.allclose(coordinates[0], coordinates[-1]))
    if closed and len(corners):
        # A closed line starts at a corner, so that no piece is cut in two.
        shift = int(corners[0])
        coordinates = np.concatenate(
            [coordinates[shift:-1], coordinates[: shift + 1]]
        )
        corners = corners[1:] - shift
        if abs(wrapped(float(heading[0] - heading[-1]))) > _CORNER:
            corners = np.sort([*corners, len(edges) - shift])
    bounds = [0, *(int(c) for c in corners), len(coordinates) - 1]
    return [
        LineString(coordinates[a : b + 1])
        for a, b in itertools.pairwise(bounds)
        if b > a
    ]
