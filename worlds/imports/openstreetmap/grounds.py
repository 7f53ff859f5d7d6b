"""Areas of ground of OpenStreetMap: lawns, water, squares, the sea.

https://wiki.openstreetmap.org/wiki/Map_features,
https://wiki.openstreetmap.org/wiki/Tag:natural%3Dcoastline
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Point, box
from shapely.geometry.base import BaseGeometry

from worlds.imports import faces
from worlds.imports.colours import LAWN, WATER, Rgb
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import Base, ImportedObject
from worlds.imports.openstreetmap.area_looks import AreaLook, flat_object
from worlds.imports.openstreetmap.features import OsmFeatures, OsmWay, Tags
from worlds.imports.openstreetmap.tags import TABLES, has_tag, is_inside
from worlds.imports.openstreetmap.way_tags import is_tunnel, path_width
from worlds.maps import LocalMetres

_SAND: Rgb = (0.76, 0.68, 0.51)
_GRAVEL: Rgb = (0.50, 0.47, 0.43)
_TARTAN: Rgb = (0.60, 0.34, 0.28)
# Heights of areas [m]. Where areas overlap, the higher one is seen: car parks
# on pitches, pitches on lawns, and streets, at height 0, on all of them.
_GROUND_LEVEL = -0.05
_PITCH_LEVEL = -0.035
_PARKING_LEVEL = -0.03
_PITCH = AreaLook("Pitch", "other-ground", _TARTAN, _PITCH_LEVEL)
_GRASS_SURFACES = ("grass", "artificial_turf", "natural_grass")
_SPORTS_ON_GRASS = ("soccer", "rugby", "american_football", "cricket")
_SURFACE_COLOURS = {"sand": _SAND, "gravel": _GRAVEL, "fine_gravel": _GRAVEL}
# Values of `parking` and of `location` -> where an area is.
_BASES = {
    "underground": Base.UNDERGROUND,
    "underwater": Base.UNDERGROUND,
    "multi-storey": Base.RAISED,
    "rooftop": Base.RAISED,
    "roof": Base.RAISED,
}
# A coastline that ends within the city is extended by this length [m].
_COAST_EXTENSION = 3000.0
# Probes at this distance from a coastline find the side of the sea [m].
_COAST_PROBE = 0.1


def _look_of(entry: list) -> AreaLook:
    """Returns the look in an entry of the table: type, class, colour, z."""
    object_type, semantic_class, (red, green, blue), z = entry
    return AreaLook(object_type, semantic_class, (red, green, blue), z)


_LOOKS = [(_look_of(entry["look"]), entry) for entry in TABLES["grounds"]]
# The first entry of the table is water.
_WATER_LOOK = _LOOKS[0][0]


def ground_areas(
    features: OsmFeatures, local: LocalMetres, dressed: bool
) -> Iterator[ImportedObject]:
    """Yields areas on the ground, such as lawns and water.

    If `dressed`, there are additional kinds of areas, such as sports grounds,
    and areas have the colours of their materials. A closed way for people, such
    as the path around a square, is a line unless it has the tag `area=yes`.
    """
    for name, tags, polygons in features.areas:
        is_path = name.startswith("w") and path_width(tags) is not None
        if is_path and tags.get("area") != "yes":
            tags = {k: v for k, v in tags.items() if k != "highway"}
        look = _detailed_look(tags) if dressed else _plain_look(tags)
        is_elsewhere = base_of_area(tags) is not Base.GROUND
        if look is None or is_elsewhere or has_tag(tags, "building"):
            continue
        outlines = map(local.polygon, polygons)
        yield from flat_object(f"land_{name}", look, outlines, features.faults)


def base_of_area(tags: Tags) -> Base:
    """Returns where an area is, such as below the ground; no base of a bridge.

    A layer above 0 is the order of things that cross, and no height.
    """
    if is_tunnel(tags) or is_inside(tags):
        return Base.UNDERGROUND
    for key in ("parking", "location"):
        if (base := _BASES.get(tags.get(key, ""))) is not None:
            return base
    return Base.GROUND


def _plain_look(tags: Tags) -> AreaLook | None:
    """Returns the look of ground in a plain city; None for other areas."""
    type_and_class = _area_kind(tags)
    if type_and_class is None:
        return None
    object_type, semantic_class = type_and_class
    colours = {"WaterBody": WATER, "LandUse": LAWN}
    kind = _green_kind(tags) if object_type == "LandUse" else ""
    return AreaLook(
        object_type,
        semantic_class,
        colours.get(object_type),
        _GROUND_LEVEL,
        kind,
    )


def _detailed_look(tags: Tags) -> AreaLook | None:
    """Returns the look of ground in a dressed city; None for other areas."""
    if tags.get("leisure") == "pitch":
        return _pitch_look(tags)
    if tags.get("amenity") == "parking":
        return AreaLook("Parking", "parking", None, _PARKING_LEVEL)
    for look, entry in _LOOKS:
        if any(
            tags.get(key) in values.split()
            for key, values in entry.items()
            if key != "look"
        ):
            return look
    return _plain_look(tags)


def _pitch_look(tags: Tags) -> AreaLook:
    """Returns the look of a sports pitch: grass, or another surface."""
    surface = tags.get("surface")
    sports = tags.get("sport", "").split(";")
    is_grass = surface in _GRASS_SURFACES or (
        surface is None and any(sport in _SPORTS_ON_GRASS for sport in sports)
    )
    rgb = LAWN if is_grass else _SURFACE_COLOURS.get(surface or "", _TARTAN)
    return _PITCH._replace(
        rgb=rgb, semantic_class="terrain" if is_grass else "other-ground"
    )


def _area_kind(tags: Mapping[str, str]) -> tuple[str, str] | None:
    """Returns the kind and the semantic class of an area on the ground.

    The result is None for tags of anything else.
    """
    if tags.get("natural") == "water" or tags.get("waterway") in (
        "riverbank",
        "dock",
    ):
        return "WaterBody", "other-ground"
    if tags.get("amenity") == "parking":
        return "Parking", "parking"
    if tags.get("highway") == "pedestrian" or tags.get("place") == "square":
        return "Square", "other-ground"
    if _green_kind(tags):
        return "LandUse", "terrain"
    return None


def _green_kind(tags: Mapping[str, str]) -> str:
    """Returns the kind of green land, such as `park`; "" if there is none."""
    return next(
        (
            tags[key]
            for key, values in TABLES["green"].items()
            if tags.get(key) in values.split()
        ),
        "",
    )


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
        f"sea_{coasts[0].name}", _WATER_LOOK, faces.parts_of(water), faults
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
