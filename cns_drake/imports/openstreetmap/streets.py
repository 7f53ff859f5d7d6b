"""The ground in OpenStreetMap: streets, parks, water and the sea.

https://wiki.openstreetmap.org/wiki/Map_features
"""

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
import math
import re
from typing import NamedTuple

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry import Finish
from cns_drake.imports import faces
from cns_drake.imports.foreign_city import (
    LAWN,
    WATER,
    WHITE_PAINT,
    Imported,
    Rgb,
    Street,
    StreetPlaces,
    make_imported,
)
from cns_drake.imports.openstreetmap import reading
from cns_drake.imports.openstreetmap.reading import Local, OsmWay
from cns_drake.imports.openstreetmap.tags import (
    TABLES,
    area_kind,
    driven_directions,
    green_kind,
    has_tag,
    is_marked,
    is_tunnel,
    lanes_beside,
    path_width,
    sidewalk_sides,
    speed_limit,
    street_width,
)
from cns_drake.imports.options import ImportFaults

# Distance of a parapet from the edge of the street [m].
_PARAPET_FROM_EDGE = 0.2
_PARAPET_THICKNESS = 0.25
_PARAPET_HEIGHT = 1.0
_BESIDE_BRIDGE = 2.0
_SIDEWALK = 2.0
# Height of sidewalks above the street [m].
KERB_HEIGHT = 0.12
# Width of the stripes of a zebra crossing, and of the gaps between them [m].
_STRIPE_WIDTH = 0.5
# Length of the stripes [m].
_STRIPE_LENGTH = 3.0
# Height of the stripes above the street [m].
_STRIPE_HEIGHT = 0.01


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
        return self.over_streets | self.tunnels


def bridges_of(ways: Iterable[OsmWay], local: Local) -> Bridges:
    """Returns the bridges and the tunnels among the ways of a file.

    Of two bridges that cross, the upper bridge counts as a bridge over another
    way. `local` converts longitudes and latitudes to coordinates in metres.
    """
    used = [
        way
        for way in ways
        if way.tags.get("railway") in ("rail", "light_rail", "tram")
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
        (over if crossed else level).add(way.name)
    return Bridges(over, level, tunnels)


def _height_rank(way: OsmWay) -> tuple[float, str]:
    """Returns what is greater for the upper one of two ways that cross.

    One of two bridges in the same layer is above the other; the file does not
    say which, and so the name decides.
    """
    if not has_tag(way.tags, "bridge"):
        return -math.inf, ""
    layer = re.fullmatch(r"[+-]?\d+(\.\d+)?", way.tags.get("layer", ""))
    return float(layer[0]) if layer else 1.0, way.name


class Look(NamedTuple):
    """How an area on the ground is built and looks.

    Attributes:
        kind: kind of the area, such as Sidewalk.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        rgb: colour; None for the colour of the class.
        z: height of the upper side [m].
        narrower: what the area is, if its tags say more than `kind`, such as
            `park`.
    """

    kind: str
    semantic_class: str
    rgb: Rgb | None
    z: float
    narrower: str = ""


_ROAD = Look("Road", "road", None, 0.0)
_WALK = Look("Sidewalk", "sidewalk", None, KERB_HEIGHT)
_PARAPET = Look("Parapet", "fence", (0.62, 0.60, 0.57), _PARAPET_HEIGHT)


def flat_structure(
    name: str, look: Look, areas: Iterable[Polygon], faults: ImportFaults
) -> Iterator[Imported]:
    """Yields one level surface that fills areas; nothing for empty areas.

    Args:
        name: name of the surface: a word, an underscore, and the id of the
            element in the file.
        look: kind, class, colour and height of the surface.
        areas: the areas in W [m].
        faults: counts parts that were repaired or left out.
    """
    source = name.partition("_")[2]
    surface = [
        faces.flat_surface(polygon, look.z, source, faults)
        for area in areas
        for polygon in faces.sound_parts(area, source, faults)
    ]
    if surface:
        yield _made(name, look, "surface", surface)


def raised_structure(
    name: str,
    look: Look,
    areas: Iterable[BaseGeometry],
    source: tuple[str, ImportFaults],
) -> Iterator[Imported]:
    """Yields one solid on the ground that fills areas, if there are any.

    Args:
        name: name of the solid.
        look: kind, class, colour and height of the solid.
        areas: the areas in W [m].
        source: pair of the element's id in the file, for messages, and the
            fault counter that counts invalid areas.
    """
    solids = [
        np.concatenate(faces.extruded(polygon, 0.0, look.z, *source))
        for area in areas
        for part in faces.parts_of(area)
        for polygon in faces.sound_parts(part, *source)
    ]
    if solids:
        yield _made(name, look, "body", solids)


def _made(
    name: str, look: Look, part: str, triangles: Sequence[np.ndarray]
) -> Imported:
    surfaces = {part: np.concatenate(triangles)}
    material = "water" if look.kind == "WaterBody" else None
    finish = look.rgb and Finish(look.rgb, material)
    return make_imported(
        name,
        look.semantic_class,
        look.kind,
        surfaces,
        {part: finish},
        narrower=look.narrower,
    )


def parapets(
    ways: Iterable[OsmWay], bridges: Bridges, local: Local
) -> Iterator[Imported]:
    """Yields parapets along both sides of road bridges.

    Only bridges at the height of the surrounding ground get parapets.
    """
    for name, tags, line, _ in ways:
        width = street_width(tags)
        if width is None or name not in bridges.level:
            continue
        course = LineString(local(line))
        strips = []
        for side, walk in zip((1.0, -1.0), sidewalk_sides(tags), strict=True):
            aside = (
                width / 2.0
                + _PARAPET_FROM_EDGE
                + (_BESIDE_BRIDGE if walk else 0.0)
            )
            edge = course.offset_curve(side * aside)
            strips.append(
                edge.buffer(_PARAPET_THICKNESS / 2.0, cap_style="flat")
            )
        source = (name, ImportFaults())
        yield from raised_structure(f"parapet_{name}", _PARAPET, strips, source)


def street_surfaces(
    features: reading.OsmFeatures, local: Local, bridges: Bridges
) -> Iterator[Imported]:
    """Yields the carriageways, their sidewalks, and paths for people.

    Tunnels, and bridges over streets or railways, are left out and counted as
    faults.
    """
    faults = features.faults
    for kind, ids in (
        ("bridge over a street or railway, left out", bridges.over_streets),
        ("tunnel, left out", bridges.tunnels),
    ):
        for name in sorted(ids):
            faults.add(kind, name)
    roads: list[tuple[str, BaseGeometry]] = []
    walks: list[tuple[str, BaseGeometry]] = []
    for name, tags, line, _ in features.ways:
        if _is_elsewhere(name, tags, bridges):
            continue
        width = street_width(tags, (name, faults))
        narrow = path_width(tags)
        if width is None and narrow is None:
            continue
        course = LineString(local(line))
        if width is None:
            walks.append((name, course.buffer((narrow or 0.0) / 2.0, 4)))
            continue
        for is_forward in {True, "maxspeed:backward" not in tags}:
            speed_limit(tags, is_forward, (name, faults))
        if has_tag(tags, "bridge") and name not in bridges.level:
            faults.add("bridge, laid on the ground", name)
        roads.append((name, course.buffer(width / 2.0, 4)))
        for side, has in zip((1.0, -1.0), sidewalk_sides(tags), strict=True):
            if has:
                reach = side * (width / 2.0 + _SIDEWALK)
                strip = course.buffer(reach, single_sided=True)
                walks.append((f"{name}_{'lr'[side < 0]}", strip))
    paved = shapely.union_all([area for _, area in roads])
    for name, area in roads:
        yield from flat_structure(
            f"road_{name}", _ROAD, faces.parts_of(area), faults
        )
    for name, area in walks:
        areas = faces.parts_of(area.difference(paved))
        yield from flat_structure(f"walk_{name}", _WALK, areas, faults)


def _is_elsewhere(name: str, tags: reading.Tags, bridges: Bridges) -> bool:
    """Returns whether a way is not a line on the ground."""
    is_line = not (is_tunnel(tags) or has_tag(tags, "area"))
    return not is_line or name in bridges.over_streets


def drivable_streets(
    ways: Iterable[OsmWay], local: Local, bridges: Bridges
) -> list[Street]:
    """Returns the streets on which cars may drive.

    Args:
        ways: ways of the file.
        local: converts places of the file to metres.
        bridges: the bridges and tunnels. Streets over other ways and in tunnels
            are left out.
    """
    streets = []
    for name, tags, line, nodes in ways:
        width = street_width(tags)
        if width is None or _is_elsewhere(name, tags, bridges):
            continue
        directions = driven_directions(tags)
        if any(directions):
            aside = lanes_beside(tags, width)
            place = (local(line), nodes)
            streets.append(
                Street(*place, *directions, aside, width, name, tags)
            )
    return streets


def street_places(features: reading.OsmFeatures, local: Local) -> StreetPlaces:
    """Returns the crossings, traffic signals and footpaths of a file.

    `local` converts longitudes and latitudes to coordinates in metres.
    """
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
        and not is_tunnel(tags)
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
    features: reading.OsmFeatures, local: Local
) -> Iterator[Imported]:
    """Yields the stripes of zebra crossings, slightly above their street."""
    marked = {number for number, tags in features.crossings if is_marked(tags)}
    for _, tags, line, nodes in features.ways:
        width = street_width(tags)
        if width is None or is_tunnel(tags):
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
                faces.flat_surface(s, _STRIPE_HEIGHT, name, features.faults)
                for s in stripes
            ]
            yield make_imported(
                f"crossing_{name}",
                "road",
                "Crossing",
                {"stripes": np.concatenate(surface)},
                {"stripes": WHITE_PAINT},
            )


def _stripes(
    place: np.ndarray, along: np.ndarray, width: float
) -> list[Polygon]:
    """Returns the stripes across a street, around a place."""
    left = np.array([-along[1], along[0]])
    count = max(1, int((width - _STRIPE_WIDTH) / (2 * _STRIPE_WIDTH)))
    middles = (np.arange(count) - (count - 1) / 2) * 2 * _STRIPE_WIDTH
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    return [
        Polygon(
            place
            + np.outer(corners[:, 0] * _STRIPE_LENGTH, along)
            + np.outer(corners[:, 1] * _STRIPE_WIDTH + middle, left)
        )
        for middle in middles
    ]


_SAND: Rgb = (0.76, 0.68, 0.51)
_GRAVEL: Rgb = (0.50, 0.47, 0.43)
_TARTAN: Rgb = (0.60, 0.34, 0.28)
_LEVEL = -0.05  # [m]


def _look_of(entry: list) -> Look:
    kind, semantic_class, (red, green, blue), z = entry
    return Look(kind, semantic_class, (red, green, blue), z)


_LOOKS = [(_look_of(entry["look"]), entry) for entry in TABLES["grounds"]]
_WATER = _LOOKS[0][0]
_PITCH = Look("Pitch", "other-ground", _TARTAN, -0.035)
_OF_GRASS = ("grass", "artificial_turf", "natural_grass")
_SPORTS_ON_GRASS = ("soccer", "rugby", "american_football", "cricket")
_SURFACES = {"sand": _SAND, "gravel": _GRAVEL, "fine_gravel": _GRAVEL}
# Car parks of these kinds are below the ground or in a building.
_NO_GROUND = ("underground", "multi-storey", "rooftop")
# A coastline that ends within the city is extended by this length [m].
_COAST_EXTENSION = 3000.0
# Probes at this distance from a coastline find the side of the sea [m].
_COAST_PROBE = 0.1


def ground_areas(
    features: reading.OsmFeatures, local: Local, dressed: bool
) -> Iterator[Imported]:
    """Yields areas on the ground, such as lawns and water.

    If `dressed`, there are additional kinds of areas, such as sports grounds,
    and areas have the colours of their materials. A path that is a closed way
    is a line, such as the path around a square, unless it has `area=yes`.
    """
    for name, tags, polygons in features.areas:
        is_path = name.startswith("w") and path_width(tags) is not None
        if is_path and tags.get("area") != "yes":
            tags = {k: v for k, v in tags.items() if k != "highway"}
        look = _look(tags) if dressed else _plain_look(tags)
        if look is None or has_tag(tags, "building"):
            continue
        outlines = map(local.polygon, polygons)
        yield from flat_structure(
            f"land_{name}", look, outlines, features.faults
        )


def _plain_look(tags: reading.Tags) -> Look | None:
    found = area_kind(tags)
    if found is None:
        return None
    kind, semantic_class = found
    colours = {"WaterBody": WATER, "LandUse": LAWN}
    narrower = green_kind(tags) if kind == "LandUse" else ""
    return Look(kind, semantic_class, colours.get(kind), _LEVEL, narrower)


def _look(tags: reading.Tags) -> Look | None:
    if is_tunnel(tags) or tags.get("layer", "").startswith("-"):
        return None
    if tags.get("leisure") == "pitch":
        return _pitch(tags)
    if tags.get("amenity") == "parking":
        if tags.get("parking") in _NO_GROUND:
            return None
        return Look("Parking", "parking", None, -0.03)
    for look, entry in _LOOKS:
        if any(
            tags.get(key) in values.split()
            for key, values in entry.items()
            if key != "look"
        ):
            return look
    return _plain_look(tags)


def _pitch(tags: reading.Tags) -> Look:
    surface = tags.get("surface")
    sports = tags.get("sport", "").split(";")
    is_grass = surface in _OF_GRASS or (
        surface is None and any(one in _SPORTS_ON_GRASS for one in sports)
    )
    rgb = LAWN if is_grass else _SURFACES.get(surface or "", _TARTAN)
    return _PITCH._replace(
        rgb=rgb, semantic_class="terrain" if is_grass else "other-ground"
    )


def coasts_of(ways: Iterable[OsmWay]) -> list[OsmWay]:
    """Returns the coastlines among ways; land is on their left."""
    return [way for way in ways if way.tags.get("natural") == "coastline"]


def sea(
    coasts: Sequence[OsmWay],
    local: Local,
    limits: np.ndarray,
    faults: ImportFaults,
) -> Iterator[Imported]:
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
    yield from flat_structure(
        f"sea_{coasts[0].name}", _WATER, faces.parts_of(water), faults
    )


def _extended_within(line: LineString, whole: BaseGeometry) -> LineString:
    """Returns a line whose ends within an area are extended straight on."""
    points = np.array(line.coords)
    if line.is_closed:
        return line
    for end, before in ((0, 1), (-1, -2)):
        if whole.contains(Point(points[end])):
            way = points[end] - points[before]
            if not way.any():
                continue
            far = points[end] + _COAST_EXTENSION * way / np.hypot(*way)
            points = (
                np.vstack([far, points])
                if end == 0
                else np.vstack([points, far])
            )
    return LineString(points)


def _is_sea(area: BaseGeometry, coasts: Sequence[LineString]) -> bool:
    """Returns whether an area is on the right of most of its coastline."""
    shapely.prepare(area)
    right = 0.0
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
            right += side * float(length[shapely.contains(area, places)].sum())
    return right > 0.0
