"""Bridges and tunnels of OpenStreetMap, and the parapets of bridges."""

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
import math
import re

from shapely import STRtree
from shapely.geometry import LineString

from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.openstreetmap.area_looks import AreaLook, raised_object
from cns_drake.imports.openstreetmap.features import OsmWay
from cns_drake.imports.openstreetmap.tags import has_tag
from cns_drake.imports.openstreetmap.way_tags import (
    is_railway,
    is_tunnel,
    path_width,
    sidewalk_sides,
    street_width,
)
from cns_drake.imports.streets import SIDEWALK_WIDTH
from cns_drake.scene import LocalMetres

# Distance of a parapet from the edge of the street [m].
_PARAPET_FROM_EDGE = 0.2
_PARAPET_THICKNESS = 0.25
_PARAPET_HEIGHT = 1.0
# Layer of a bridge whose tags name none.
_USUAL_LAYER = 1.0
_PARAPET = AreaLook("Parapet", "fence", (0.62, 0.60, 0.57), _PARAPET_HEIGHT)


@dataclass(frozen=True)
class Bridges:
    """Bridges and tunnels among the ways for cars, people and trains.

    Attributes:
        over_streets: ids of the bridges that cross another way.
        level: ids of all other bridges, which are assumed to be at the height
            of the surrounding ground.
        tunnels: ids of the tunnels.
    """

    over_streets: AbstractSet[str] = frozenset()
    level: AbstractSet[str] = frozenset()
    tunnels: AbstractSet[str] = frozenset()

    @property
    def left_out(self) -> AbstractSet[str]:
        """Ids of the bridges and tunnels that a dressed city does not have."""
        return self.over_streets | self.tunnels


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
    over: set[str] = set()
    level: set[str] = set()
    for way, line in zip(open_ways, lines, strict=True):
        if not has_tag(way.tags, "bridge"):
            continue
        crossed = [
            open_ways[k]
            for k in tree.query(line, "intersects")
            if not set(open_ways[k].nodes) & set(way.nodes)
            and _height_rank(open_ways[k]) < _height_rank(way)
        ]
        if crossed:
            over.add(way.name)
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


def parapets(
    ways: Iterable[OsmWay], bridges: Bridges, local: LocalMetres
) -> Iterator[ImportedObject]:
    """Yields parapets along both sides of road bridges.

    Only bridges at the height of the surrounding ground get parapets.
    """
    for name, tags, line, _ in ways:
        width = street_width(tags)
        if width is None or name not in bridges.level:
            continue
        course = LineString(local(line))
        strips = []
        for side, has_sidewalk in zip(
            (1.0, -1.0), sidewalk_sides(tags), strict=True
        ):
            aside = (
                width / 2.0
                + _PARAPET_FROM_EDGE
                + (SIDEWALK_WIDTH if has_sidewalk else 0.0)
            )
            edge = course.offset_curve(side * aside)
            strips.append(
                edge.buffer(_PARAPET_THICKNESS / 2.0, cap_style="flat")
            )
        source = (name, ImportFaults())
        yield from raised_object(f"parapet_{name}", _PARAPET, strips, source)
