"""Streets of OpenStreetMap, their bridges and tunnels: surfaces and lanes."""

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.imports.faces import (
    extruded,
    flat_surface,
    parts_of,
    sound_parts,
)
from cns_drake.imports.foreign_city import (
    Imported,
    Street,
    StreetPlaces,
    make_imported,
)
from cns_drake.imports.openstreetmap.reading import (
    Local,
    OsmFeatures,
    OsmWay,
    Tags,
    has_tag,
)
from cns_drake.imports.openstreetmap.tags import (
    driven_ways,
    is_marked,
    lanes_beside,
    path_width,
    sidewalk_sides,
    street_width,
)
from cns_drake.imports.options import ImportFaults

# Parapets: distance from the edge of the street, thickness, height [m].
_FROM_EDGE, _THICK, _HIGH = 0.2, 0.25, 1.0
_BESIDE_BRIDGE = 2.0
_SIDEWALK = 2.0
_KERB = 0.12
_WHITE = (0.86, 0.86, 0.84)
# Width of the stripes of a zebra crossing, and of the gaps [m].
_STRIPE, _STRIPE_LENGTH, _STRIPE_HEIGHT = 0.5, 3.0, 0.01


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
            aside = width / 2.0 + _FROM_EDGE + (_BESIDE_BRIDGE if walk else 0.0)
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


def street_surfaces(
    ways: Iterable[OsmWay],
    local: Local,
    faults: ImportFaults,
    bridges: Bridges,
) -> Iterator[Imported]:
    """Yields carriageways, and the sidewalks and paths beside them."""
    for kind, ids in (
        ("bridge over a street or railway, left out", bridges.over_streets),
        ("tunnel, left out", bridges.tunnels),
    ):
        for name in sorted(ids):
            faults.add(kind, name)
    roads: list[tuple[str, BaseGeometry]] = []
    walks: list[tuple[str, BaseGeometry]] = []
    for name, tags, line, _ in ways:
        if has_tag(tags, "tunnel") or has_tag(tags, "area"):
            continue
        if name in bridges.over_streets:
            continue
        width = street_width(tags, (name, faults))
        narrow = path_width(tags)
        if width is None and narrow is None:
            continue
        course = LineString(local(line))
        if width is None:
            walks.append((name, course.buffer((narrow or 0.0) / 2.0, 4)))
            continue
        if has_tag(tags, "bridge") and name not in bridges.level:
            faults.add("bridge, laid on the ground", name)
        roads.append((name, course.buffer(width / 2.0, 4)))
        for side, has in zip((1.0, -1.0), sidewalk_sides(tags), strict=True):
            if has:
                reach = side * (width / 2.0 + _SIDEWALK)
                strip = course.buffer(reach, single_sided=True)
                walks.append((f"{name}_{'lr'[side < 0]}", strip))
    paved = shapely.union_all([area for _, area in roads])
    for names, areas, semantic_class, z in (
        ("road", roads, "road", 0.0),
        ("walk", walks, "sidewalk", _KERB),
    ):
        for name, area in areas:
            is_road = semantic_class == "road"
            surface = [
                flat_surface(polygon, z, name, faults)
                for part in parts_of(
                    area if is_road else area.difference(paved)
                )
                for polygon in sound_parts(part, name, faults)
            ]
            if surface:
                yield make_imported(
                    f"{names}_{name}",
                    semantic_class,
                    "Road" if is_road else "Sidewalk",
                    {"surface": np.concatenate(surface)},
                    {},
                )


def drivable_streets(
    ways: Iterable[OsmWay], local: Local, bridges: Bridges
) -> list[Street]:
    """Returns the streets for cars, with the nodes where they meet."""
    streets = []
    for name, tags, line, nodes in ways:
        width = street_width(tags)
        if width is None or has_tag(tags, "tunnel") or has_tag(tags, "area"):
            continue
        if name in bridges.over_streets:
            continue
        forward, backward = driven_ways(tags)
        if forward or backward:
            beside = lanes_beside(tags, width)
            streets.append(
                Street(
                    local(line),
                    nodes,
                    forward,
                    backward,
                    beside,
                    width,
                    name,
                    tags,
                )
            )
    return streets


def street_places(features: OsmFeatures, local: Local) -> StreetPlaces:
    """Returns where people cross and signals stand, and ways for people."""
    signals = [
        place
        for _, tags, place in features.nodes
        if tags.get("highway") == "traffic_signals"
    ]
    paths = [
        local(line)
        for _, tags, line, _ in features.ways
        if path_width(tags) is not None
        and tags.get("highway") not in ("steps", "cycleway")
        and tags.get("footway") != "crossing"
        and not has_tag(tags, "tunnel")
        and not has_tag(tags, "area")
    ]
    return StreetPlaces(
        frozenset(
            number
            for number, tags in features.crossings
            if tags.get("crossing") != "no"
        ),
        local(np.array(signals).reshape(-1, 2)),
        paths,
    )


def crossing_stripes(
    crossings: Iterable[tuple[int, Tags]],
    ways: Iterable[OsmWay],
    local: Local,
    faults: ImportFaults,
) -> Iterator[Imported]:
    """Yields the stripes of zebra crossings, a little above their street."""
    marked = {number for number, tags in crossings if is_marked(tags)}
    for _, tags, line, nodes in ways:
        width = street_width(tags)
        if width is None or has_tag(tags, "tunnel"):
            continue
        for k, number in enumerate(nodes):
            if number not in marked:
                continue
            marked.remove(number)
            places = local(line)
            along = places[min(k + 1, len(nodes) - 1)] - places[max(k - 1, 0)]
            if not along.any():
                continue
            stripes = _stripes(places[k], along / np.hypot(*along), width)
            name = f"n{number}"
            surface = [
                flat_surface(s, _STRIPE_HEIGHT, name, faults) for s in stripes
            ]
            yield make_imported(
                f"crossing_{name}",
                "road",
                "Crossing",
                {"stripes": np.concatenate(surface)},
                {"stripes": _WHITE},
            )


def _stripes(
    place: np.ndarray, along: np.ndarray, width: float
) -> list[Polygon]:
    """Returns the stripes across a street about a place."""
    left = np.array([-along[1], along[0]])
    count = max(1, int((width - _STRIPE) / (2 * _STRIPE)))
    middles = (np.arange(count) - (count - 1) / 2) * 2 * _STRIPE
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    return [
        Polygon(
            place
            + np.outer(corners[:, 0] * _STRIPE_LENGTH, along)
            + np.outer(corners[:, 1] * _STRIPE + middle, left)
        )
        for middle in middles
    ]
