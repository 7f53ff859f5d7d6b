"""Bridges and tunnels of OpenStreetMap, on ground without heights."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from shapely import STRtree
from shapely.geometry import LineString

from cns_drake.imports.extrusions import extruded
from cns_drake.imports.foreign_city import Imported, make_imported
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.osm_places import Local, parts_of, sound_parts
from cns_drake.imports.osm_reading import OsmWay, has_tag
from cns_drake.imports.osm_tags import (
    path_width,
    sidewalk_sides,
    street_width,
)

# Parapets: distance from the edge of the street, thickness, height [m].
_FROM_EDGE, _THICK, _HIGH = 0.2, 0.25, 1.0
_SIDEWALK = 2.0


@dataclass(frozen=True)
class Bridges:
    """Ids of ways for cars and people above or below the ground.

    Attributes:
        over_streets: bridges over another street, or a railway.
        level: all other bridges, at the height of the ground beside them.
        tunnels: below it.
    """

    over_streets: AbstractSet[str] = frozenset()
    level: AbstractSet[str] = frozenset()
    tunnels: AbstractSet[str] = frozenset()

    @property
    def left_out(self) -> AbstractSet[str]:
        return self.over_streets | self.tunnels


def bridges_of(ways: Iterable[OsmWay], local: Local) -> Bridges:
    """Returns the ways that are bridges and tunnels."""
    used = [
        way
        for way in ways
        if way.tags.get("railway") in ("rail", "light_rail", "tram")
        or street_width(way.tags) is not None
        or path_width(way.tags) is not None
    ]
    tunnels = {way.name for way in used if has_tag(way.tags, "tunnel")}
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
            and not has_tag(open_ways[k].tags, "bridge")
        ]
        (over if crossed else level).add(way.name)
    return Bridges(over, level, tunnels)


def parapets(
    ways: Iterable[OsmWay], bridges: Bridges, local: Local
) -> Iterator[Imported]:
    """Yields low walls on both sides of level bridges for cars."""
    for name, tags, line, _ in ways:
        width = street_width(tags)
        if width is None or name not in bridges.level:
            continue
        course = LineString(local(line))
        solids = []
        for side, walk in zip((1.0, -1.0), sidewalk_sides(tags), strict=True):
            aside = width / 2.0 + _FROM_EDGE + (_SIDEWALK if walk else 0.0)
            strip = course.offset_curve(side * aside).buffer(
                _THICK / 2.0, cap_style="flat"
            )
            solids += [
                np.concatenate(extruded(one, 0.0, _HIGH, name, ImportFaults()))
                for part in parts_of(strip)
                for one in sound_parts(part, name, ImportFaults())
            ]
        if solids:
            yield make_imported(
                f"parapet_{name}",
                "fence",
                "Parapet",
                {"body": np.concatenate(solids)},
                {"body": (0.62, 0.60, 0.57)},
            )
