"""Areas of OpenStreetMap as grounds: parks, squares, sand, water, the sea.

https://wiki.openstreetmap.org/wiki/Map_features
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, Point, box
from shapely.geometry.base import BaseGeometry

from cns_drake.imports.faces import flat_surface, parts_of, sound_parts
from cns_drake.imports.foreign_city import (
    LAWN,
    WATER,
    Imported,
    Rgb,
    make_imported,
)
from cns_drake.imports.openstreetmap.reading import (
    Local,
    OsmArea,
    OsmWay,
    Tags,
    has_tag,
)
from cns_drake.imports.openstreetmap.tags import TABLES, area_kind
from cns_drake.imports.options import ImportFaults

_SAND: Rgb = (0.76, 0.68, 0.51)
_GRAVEL: Rgb = (0.50, 0.47, 0.43)
_TARTAN: Rgb = (0.60, 0.34, 0.28)
_LEVEL = -0.05  # [m]


class _Look(NamedTuple):
    """Kind, class, colour and height [m] of a ground."""

    kind: str
    semantic_class: str
    rgb: Rgb | None
    z: float


def _look_of(entry: list) -> _Look:
    kind, semantic_class, (red, green, blue), z = entry
    return _Look(kind, semantic_class, (red, green, blue), z)


_LOOKS = [(_look_of(entry["look"]), entry) for entry in TABLES["grounds"]]
_WATER = _LOOKS[0][0]
_PITCH = _Look("Pitch", "other-ground", _TARTAN, -0.035)
_OF_GRASS = ("grass", "artificial_turf", "natural_grass")
_SPORTS_ON_GRASS = ("soccer", "rugby", "american_football", "cricket")
_SURFACES = {"sand": _SAND, "gravel": _GRAVEL, "fine_gravel": _GRAVEL}
# Cars there are below the ground, or in a building.
_NO_GROUND = ("underground", "multi-storey", "rooftop")
# Length by which a coast that ends within the city is extended [m], and
# distance of the probes beside it that find the sea's side.
_BEYOND, _BESIDE = 3000.0, 0.1


def ground_areas(
    areas: Iterable[OsmArea],
    local: Local,
    faults: ImportFaults,
    dressed: bool,
) -> Iterator[Imported]:
    """Yields the areas that are ground; dressed, by their material."""
    for name, tags, polygons in areas:
        look = _look(tags) if dressed else _plain_look(tags)
        if look is None or has_tag(tags, "building"):
            continue
        surface = [
            flat_surface(one, look.z, name, faults)
            for polygon in polygons
            for one in sound_parts(local.polygon(polygon), name, faults)
        ]
        if surface:
            yield make_imported(
                f"land_{name}",
                look.semantic_class,
                look.kind,
                {"surface": np.concatenate(surface)},
                {"surface": look.rgb},
            )


def _plain_look(tags: Tags) -> _Look | None:
    found = area_kind(tags)
    if found is None:
        return None
    kind, semantic_class = found
    colours = {"WaterBody": WATER, "LandUse": LAWN}
    return _Look(kind, semantic_class, colours.get(kind), _LEVEL)


def _look(tags: Tags) -> _Look | None:
    if tags.get("tunnel", "no") != "no" or tags.get("layer", "").startswith(
        "-"
    ):
        return None
    if tags.get("leisure") == "pitch":
        return _pitch(tags)
    if tags.get("amenity") == "parking":
        if tags.get("parking") in _NO_GROUND:
            return None
        return _Look("Parking", "parking", None, -0.03)
    for look, entry in _LOOKS:
        if any(
            tags.get(key) in values.split()
            for key, values in entry.items()
            if key != "look"
        ):
            return look
    return _plain_look(tags)


def _pitch(tags: Tags) -> _Look:
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
    """Returns the coastlines; the land is on their left."""
    return [way for way in ways if way.tags.get("natural") == "coastline"]


def sea(
    coasts: Sequence[OsmWay],
    local: Local,
    limits: np.ndarray,
    faults: ImportFaults,
) -> Iterator[Imported]:
    """Yields the sea on the right of coasts, if there is any.

    Limits (2, 2) are the least x and y, and greatest, of the city [m].
    """
    if not coasts:
        return
    lines = [LineString(local(way.line)) for way in coasts]
    lines = [line for line in lines if line.length > 0.0]
    merged = shapely.get_parts(shapely.line_merge(shapely.union_all(lines)))
    whole = box(*limits.ravel().tolist())
    cuts = [_prolonged(line, whole).intersection(whole) for line in merged]
    edges = shapely.union_all([whole.boundary, *cuts])
    areas = shapely.get_parts(shapely.polygonize([edges]))
    water = shapely.union_all([area for area in areas if _is_sea(area, lines)])
    surface = [
        flat_surface(one, _WATER.z, coasts[0].name, faults)
        for part in parts_of(water)
        for one in sound_parts(part, coasts[0].name, faults)
    ]
    if surface:
        yield make_imported(
            f"sea_{coasts[0].name}",
            _WATER.semantic_class,
            _WATER.kind,
            {"surface": np.concatenate(surface)},
            {"surface": WATER},
        )


def _prolonged(line: LineString, whole: BaseGeometry) -> LineString:
    """Returns a line with its ends within an area extended straight on."""
    points = np.array(line.coords)
    if line.is_closed:
        return line
    for end, before in ((0, 1), (-1, -2)):
        if whole.contains(Point(points[end])):
            way = points[end] - points[before]
            if not way.any():
                continue
            far = points[end] + _BEYOND * way / np.hypot(*way)
            points = (
                np.vstack([far, points])
                if end == 0
                else np.vstack([points, far])
            )
    return LineString(points)


def _is_sea(area: BaseGeometry, coasts: Sequence[LineString]) -> bool:
    """Returns whether an area is on the right of most of its coast."""
    shapely.prepare(area)
    right = 0.0
    for coast in coasts:
        points = np.array(coast.coords)
        steps = np.diff(points, axis=0)
        length = np.hypot(*steps.T)
        used = length > 0.0
        middles = (points[:-1] + steps / 2.0)[used]
        steps, length = steps[used], length[used]
        aside = _BESIDE * np.c_[steps[:, 1], -steps[:, 0]] / length[:, None]
        for side in (1.0, -1.0):
            places = shapely.points(middles + side * aside)
            right += side * float(length[shapely.contains(area, places)].sum())
    return right > 0.0
