"""Bridges and tunnels of OpenStreetMap: decks and parapets."""

from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
import math
import re

import shapely
from shapely import STRtree
from shapely.geometry import LineString

from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import Base, ImportedObject
from worlds.imports.openstreetmap.area_looks import AreaLook, raised_object
from worlds.imports.openstreetmap.features import OsmWay
from worlds.imports.openstreetmap.tags import has_tag
from worlds.imports.openstreetmap.way_tags import (
    is_railway,
    is_tunnel,
    path_width,
    sidewalk_sides,
    street_width,
    way_width,
)
from worlds.imports.streets import SIDEWALK_WIDTH
from worlds.maps import LocalMetres

# Distance of a parapet from the edge of the street [m].
_PARAPET_FROM_EDGE = 0.2
_PARAPET_THICKNESS = 0.25
_PARAPET_HEIGHT = 1.0
# Layer of a bridge whose tags name none.
_USUAL_LAYER = 1.0
_CONCRETE = (0.62, 0.60, 0.57)
# Height of a deck above the way below it, and thickness of the deck [m].
_DECK_HEIGHT = 6.0
_DECK_THICKNESS = 1.0


@dataclass(frozen=True)
class Bridges:
    """Bridges and tunnels among the ways for cars, people and trains.

    Attributes:
        over_streets: id -> height of the deck [m], of the bridges that cross
            another way.
        level: ids of all other bridges, which are assumed to be at the height
            of the surrounding ground.
        tunnels: ids of the tunnels.
    """

    over_streets: Mapping[str, float]
    level: AbstractSet[str]
    tunnels: AbstractSet[str]

    @property
    def left_out(self) -> AbstractSet[str]:
        """Ids of the bridges and tunnels over or in which no street leads."""
        return self.over_streets.keys() | self.tunnels


def bridges_of(ways: Iterable[OsmWay], local: LocalMetres) -> Bridges:
    """Returns the bridges and the tunnels among the ways of a file.

    Of two bridges that cross, the upper bridge counts as a bridge over another
    way. `local` converts longitudes and latitudes to coordinates in metres.
    """
    used = [
        way
        for way in ways
        if is_railway(way.tags)
        or street_width(way.tags) is not None
        or path_width(way.tags) is not None
    ]
    tunnels = {way.name for way in used if is_tunnel(way.tags)}
    open_ways = [way for way in used if way.name not in tunnels]
    lines = [LineString(local(way.line)) for way in open_ways]
    tree = STRtree(lines)
    over: dict[str, float] = {}
    level: set[str] = set()
    # The lower one of two bridges that cross comes first.
    for way, line in sorted(
        zip(open_ways, lines, strict=True), key=lambda one: _height_rank(one[0])
    ):
        if not has_tag(way.tags, "bridge"):
            continue
        crossed = [
            open_ways[k]
            for k in tree.query(line, "intersects")
            if not set(open_ways[k].nodes) & set(way.nodes)
            and _height_rank(open_ways[k]) < _height_rank(way)
        ]
        if crossed:
            highest = max(over.get(one.name, 0.0) for one in crossed)
            over[way.name] = highest + _DECK_HEIGHT
        else:
            level.add(way.name)
    return Bridges(over, level, tunnels)


def _height_rank(way: OsmWay) -> tuple[float, str]:
    """Returns a rank that is greater for the upper one of two ways that cross.

    The file does not say which of two bridges in the same layer is above the
    other, so the name decides.
    """
    if not has_tag(way.tags, "bridge"):
        return -math.inf, ""
    layer = re.fullmatch(r"[+-]?\d+(\.\d+)?", way.tags.get("layer", ""))
    return float(layer[0]) if layer else _USUAL_LAYER, way.name


def decks(
    ways: Iterable[OsmWay], bridges: Bridges, local: LocalMetres
) -> Iterator[ImportedObject]:
    """Yields the decks of bridges over other ways, without their ramps."""
    for name, tags, line, _ in ways:
        if name not in bridges.over_streets:
            continue
        top = bridges.over_streets[name]
        left, right = _reaches(tags)
        course = LineString(local(line))
        area = shapely.union_all(
            [
                course.buffer(left, single_sided=True),
                course.buffer(-right, single_sided=True),
            ]
        )
        look = AreaLook("Bridge", "other-structure", _CONCRETE, top)
        source = (name, ImportFaults())
        low = top - _DECK_THICKNESS
        yield from raised_object(
            f"bridge_{name}", look, [area], source, low, Base.DECK
        )


def parapets(
    ways: Iterable[OsmWay], bridges: Bridges, local: LocalMetres
) -> Iterator[ImportedObject]:
    """Yields parapets along both sides of bridges.

    Bridges at the height of the surrounding ground have some if they carry a
    street.
    """
    for name, tags, line, _ in ways:
        is_level = name in bridges.level and street_width(tags) is not None
        if not is_level and name not in bridges.over_streets:
            continue
        course = LineString(local(line))
        strips = [
            course.offset_curve(side * (reach + _PARAPET_FROM_EDGE)).buffer(
                _PARAPET_THICKNESS / 2.0, cap_style="flat"
            )
            for side, reach in zip((1.0, -1.0), _reaches(tags), strict=True)
        ]
        low = bridges.over_streets.get(name, 0.0)
        top = low + _PARAPET_HEIGHT
        kind = "Parapet" if is_level else "BridgeParapet"
        look = AreaLook(kind, "fence", _CONCRETE, top)
        source = (name, ImportFaults())
        base = Base.GROUND if is_level else Base.RAISED
        yield from raised_object(
            f"parapet_{name}", look, strips, source, low, base
        )


def _reaches(tags: Mapping[str, str]) -> tuple[float, float]:
    """Returns how far a way with its sidewalks reaches to both sides [m]."""
    half = (way_width(tags) or 0.0) / 2.0
    left, right = sidewalk_sides(tags)
    return half + SIDEWALK_WIDTH * left, half + SIDEWALK_WIDTH * right
