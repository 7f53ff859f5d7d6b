"""Ways in OpenStreetMap that lead through buildings, walls and fences.

https://wiki.openstreetmap.org/wiki/Tag:tunnel%3Dbuilding_passage
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
import math
import re
from typing import NamedTuple

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from worlds.imports.faults import ImportFaults
from worlds.imports.openstreetmap.features import OsmWay, Tags
from worlds.imports.openstreetmap.tags import (
    has_tag,
    is_inside,
    length,
    tag_value,
)
from worlds.imports.openstreetmap.way_tags import (
    is_railway,
    is_tunnel,
    street_width,
    way_width,
)
from worlds.maps import LocalMetres

# Usual clear height of a passage for a street [m].
_STREET_HEIGHT = 4.5
# Usual clear height of a passage for a path [m].
_PATH_HEIGHT = 2.8
# Usual clear height of a passage for a railway [m].
_RAIL_HEIGHT = 5.5
# Greatest plausible clear height of a passage [m].
_HIGHEST_CLEARANCE = 30.0
# A passage reaches this far beyond the walls, because ways and outlines meet
# only nearly [m].
_BEYOND_WALLS = 0.3
# A step of a way that is shorter than this has no direction [m].
_LEAST_LENGTH = 1e-9
# On each side, a passage is this much wider than its way [m].
_BESIDE_WAY = 0.25
# A way leads through a building if more than this is inside [m].
THROUGH = 0.5
# Values of `maxheight` that are no heights, but usual.
_NO_HEIGHTS = ("default", "none", "below_default", "no_sign", "no_indications")
# Walls do not block a way if they begin above this height [m].
HEADROOM = 2.0


class Passage(NamedTuple):
    """A way that leads through a building or under a roof.

    Attributes:
        name: id of the way.
        course: the way's line in W [m].
        area: the area that the passage needs in W [m].
        height: clear height above the ground [m].
    """

    name: str
    course: LineString
    area: BaseGeometry
    height: float


def _is_on_the_ground(tags: Tags) -> bool:
    """Returns whether a way is outdoors, at or near the level of the ground."""
    is_above = not re.fullmatch(r"-?0*|.*;.*", tags.get("level", "0"))
    return not (is_tunnel(tags) or is_inside(tags) or is_above)


def passages_of(
    ways: Iterable[OsmWay], local: LocalMetres, faults: ImportFaults
) -> list[Passage]:
    """Returns the ways that lead through buildings or under roofs.

    These ways have the tag `tunnel=building_passage` or `covered`, and are
    lines or areas on the ground. `local` converts longitudes and latitudes to
    coordinates in metres, and `faults` counts tags that cannot be read.
    """
    passages = []
    for name, tags, line, _ in ways:
        is_passage = has_tag(tags, "tunnel") or has_tag(tags, "covered")
        width = way_width(tags)
        if not (is_passage and width and _is_on_the_ground(tags)):
            continue
        usual = _STREET_HEIGHT if street_width(tags) else _PATH_HEIGHT
        if is_railway(tags):
            usual = _RAIL_HEIGHT
        clear = None
        if tags.get("maxheight") not in _NO_HEIGHTS:
            where = (name, faults)
            clear = tag_value(
                tags, "maxheight", length, _HIGHEST_CLEARANCE, where, HEADROOM
            )
        course = LineString(local(line))
        area: BaseGeometry
        if has_tag(tags, "area") and course.is_closed and len(line) > 3:
            area = shapely.make_valid(Polygon(course))
            area = area.buffer(_BEYOND_WALLS, join_style="mitre")
        else:
            half = width / 2.0 + _BESIDE_WAY
            area = _extended_line(course).buffer(half, cap_style="flat")
        passages.append(Passage(name, course, area, clear or usual))
    return passages


def _extended_line(course: LineString) -> LineString:
    """Returns a line that is extended a little beyond both ends."""
    places = shapely.get_coordinates(course)
    ends = []
    for end, before in ((0, 1), (-1, -2)):
        out = places[end] - places[before]
        # Two places of a way may be the same.
        out /= max(float(np.hypot(*out)), _LEAST_LENGTH)
        ends.append(places[end] + _BEYOND_WALLS * out)
    return LineString([ends[0], *places, ends[1]])


class Passages:
    """Finds the passages through a building."""

    def __init__(self, passages: Sequence[Passage]):
        self._passages = passages
        self._tree = STRtree([passage.course for passage in passages])

    def through(
        self, polygon: Polygon, low: float
    ) -> tuple[BaseGeometry, float] | None:
        """Returns the area and the clear height of passages through a solid.

        Args:
            polygon: footprint of the solid in W [m].
            low: height of the solid's lowest point [m].

        Returns:
            The area in W [m] and the height above the ground [m]; None if no
            way leads through the solid.
        """
        passages = [
            passage
            for k in self._tree.query(polygon, "intersects")
            if (passage := self._passages[k]).height > low
            and passage.course.intersection(polygon).length > THROUGH
        ]
        if not passages:
            return None
        area = shapely.union_all([passage.area for passage in passages])
        return area, max(passage.height for passage in passages)


class WayOpenings:
    """Finds where ways lead through walls, fences and hedges."""

    def __init__(self, ways: Iterable[OsmWay], local: LocalMetres):
        used = [
            way
            for way in ways
            if way_width(way.tags)
            and _is_on_the_ground(way.tags)
            and not (has_tag(way.tags, "bridge") or has_tag(way.tags, "area"))
        ]
        self._ways = used
        self._lines = [LineString(local(way.line)) for way in used]
        self._tree = STRtree(self._lines)
        # Node -> the places to which ways lead from there.
        self._arms: dict[int, list[np.ndarray]] = {}
        for way, line in zip(used, self._lines, strict=True):
            places = shapely.get_coordinates(line)
            for (node, place), (other, beyond) in pairwise(
                zip(way.nodes, places, strict=True)
            ):
                self._arms.setdefault(node, []).append(beyond)
                self._arms.setdefault(other, []).append(place)

    def across(
        self, barrier: OsmWay, course: LineString, faults: ImportFaults
    ) -> BaseGeometry:
        """Returns the areas of the ways that lead through a barrier, in W.

        A way leads through the barrier if way and barrier have a common node.
        `faults` counts the openings, and also the ways that cross the barrier
        without a common node. `course` is the line of the barrier in W [m].
        """
        crossed = self._crossed_nodes(barrier, shapely.get_coordinates(course))
        edges = {frozenset(pair) for pair in pairwise(barrier.nodes)}
        areas = []
        for k in self._tree.query(course, "intersects"):
            way, line = self._ways[k], self._lines[k]
            if edges & {frozenset(pair) for pair in pairwise(way.nodes)}:
                continue  # It leads along the barrier.
            if crossed & {*way.nodes}:
                half = (way_width(way.tags) or 0.0) / 2.0 + _BESIDE_WAY
                areas.append(line.buffer(half, cap_style="square"))
            elif line.crosses(course):
                faults.add("way across a barrier, without an opening", way.name)
        if areas:
            faults.add("barrier across a way, opened", barrier.name)
        return shapely.union_all(areas)

    def _crossed_nodes(self, barrier: OsmWay, places: np.ndarray) -> set[int]:
        """Returns the nodes of a barrier at which ways lead to both sides.

        At an end of the barrier, where another barrier may begin, any two ways
        are enough. `places` (N, 2) are the places of the nodes in W [m].
        """
        crossed = set()
        last = len(places) - 1
        is_closed = barrier.nodes[0] == barrier.nodes[-1]
        for k, node in enumerate(barrier.nodes):
            arms = self._arms.get(node, [])
            if len(arms) < 2:
                continue
            if k in (0, last) and not is_closed:
                crossed.add(node)
                continue
            before = places[k - 1 if k else last - 1]
            after = places[k + 1 if k < last else 1]
            to_before = _angle_between(places[k], after, before)
            sides = {
                _angle_between(places[k], after, arm) < to_before
                for arm in arms
            }
            if len(sides) > 1:
                crossed.add(node)
        return crossed


def _angle_between(
    place: np.ndarray, start: np.ndarray, end: np.ndarray
) -> float:
    """Returns the angle at a place, from a start to an end, counter-clockwise.

    The three places are (2,) [m]. The angle is from 0 to 2 pi.
    """
    first, second = start - place, end - place
    angle = math.atan2(second[1], second[0]) - math.atan2(first[1], first[0])
    return angle % (2.0 * math.pi)
