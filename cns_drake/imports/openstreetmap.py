"""OpenStreetMap: buildings, streets, trees and land as structures.

Heights above the sea are not in it: the ground is level.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import math
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.strtree import STRtree
from shapely.validation import make_valid

from cns_drake.city.geometry.structures import Structure
from cns_drake.city.plants.vegetation import tree
from cns_drake.imports.building_years import construction_year
from cns_drake.imports.extrusions import extruded, flat_surface
from cns_drake.imports.foreign_city import (
    LAWN,
    RED_ROOF,
    WATER,
    ForeignCity,
    Imported,
    make_imported,
)
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.osm_reading import (
    Tags,
    is_building,
    is_told,
    read_openstreetmap,
)
from cns_drake.imports.osm_tags import (
    area_kind,
    heights,
    length,
    path_width,
    sidewalk_sides,
    street_width,
)
from evaluation.support.errors import InputError

# Of the Earth, WGS 84 [m].
_SEMI_MAJOR = 6378137.0
_FLATTENING = 1.0 / 298.257223563
_SIDEWALK = 2.0
_KERB = 0.12
_LEAST_AREA = 0.01  # [m^2]
_HEDGE = (0.8, 1.2)
_WALL = (0.2, 1.6)
# A file of a whole country would not end.
_LARGEST = 20_000.0  # [m]


def import_openstreetmap(path: Path, year_attribute: str | None) -> ForeignCity:
    """Reads a file; its origin is the middle of its buildings.

    Raises:
        InputError: if it cannot be read, has no building, or is larger than
            20 km.
    """
    features = read_openstreetmap(path)
    faults = features.faults
    buildings = [one for one in features.areas if is_building(one[1])]
    if not buildings:
        raise InputError(f"{path}: no building in it")
    bounds = np.array([p.bounds for _, _, ps in buildings for p in ps])
    low, high = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    longitude, latitude = np.round((low + high) / 2.0, 6).tolist()
    local = _Local(longitude, latitude)
    size = local(np.array([high]))[0] - local(np.array([low]))[0]
    if size.max() > _LARGEST:
        raise InputError(
            f"{path}: {size.max() / 1000:.0f} km across; cut out a piece of at"
            f" most {_LARGEST / 1000:.0f} km"
        )
    found = [
        *_buildings(buildings, local, year_attribute, faults),
        *_streets(features.ways, local, faults),
        *_lands(features.areas, local, faults),
        *_barriers(features.ways, local, faults),
        *_trees(features.trees, local),
    ]
    return ForeignCity(found, (latitude, longitude), "WGS 84", faults)


class _Local:
    """Places in metres east and north of an origin.

    By the Earth's radii of curvature there: right to 1 in 10,000 within
    10 km.
    """

    def __init__(self, longitude: float, latitude: float):
        e2 = _FLATTENING * (2.0 - _FLATTENING)
        s = math.sin(math.radians(latitude))
        w2 = 1.0 - e2 * s * s
        north = _SEMI_MAJOR * (1.0 - e2) / w2**1.5
        east = _SEMI_MAJOR / math.sqrt(w2) * math.cos(math.radians(latitude))
        self._origin = np.array([longitude, latitude])
        self._metres = np.radians(1.0) * np.array([east, north])

    def __call__(self, places: np.ndarray) -> np.ndarray:
        return (places - self._origin) * self._metres

    def polygon(self, polygon: Polygon) -> Polygon:
        return shapely.transform(polygon, self)


def _parts(geometry: BaseGeometry) -> Iterator[Polygon]:
    """Yields the polygons of a geometry that has any."""
    if isinstance(geometry, Polygon):
        if geometry.area > _LEAST_AREA:
            yield geometry
        return
    for one in getattr(geometry, "geoms", ()):
        yield from _parts(one)


def _sound(polygon: Polygon, name: str, faults: ImportFaults) -> list[Polygon]:
    """Returns what a polygon is made of, in whole millimetres."""
    geometry: BaseGeometry = polygon
    if not polygon.is_valid:
        faults.add("outline that crosses itself, repaired", name)
        geometry = make_valid(polygon)
    return list(_parts(shapely.set_precision(geometry, 0.001)))


def _buildings(
    told: Iterable[tuple[str, Tags, list[Polygon]]],
    local: _Local,
    year_attribute: str | None,
    faults: ImportFaults,
) -> Iterator[Imported]:
    """Yields buildings; one that has parts is what these are."""
    outlines: list[tuple[str, Tags, Polygon]] = []
    parts: list[tuple[str, Tags, Polygon]] = []
    for name, tags, polygons in told:
        for polygon in polygons:
            for one in _sound(local.polygon(polygon), name, faults):
                group = parts if is_told(tags, "building:part") else outlines
                group.append((name, tags, one))
    of_outline: dict[int, list[tuple[str, Tags, Polygon]]] = {}
    tree_of_outlines = STRtree([one for _, _, one in outlines])
    alone = []
    for part in parts:
        inside = tree_of_outlines.query(
            part[2].representative_point(), predicate="within"
        )
        if len(inside):
            of_outline.setdefault(int(inside.min()), []).append(part)
        else:
            alone.append([part])
    groups = [
        ((name, tags), of_outline.get(k, [(name, tags, one)]))
        for k, (name, tags, one) in enumerate(outlines)
    ]
    groups += [((some[0][0], some[0][1]), some) for some in alone]
    taken: dict[str, int] = {}
    for (name, tags), members in groups:
        walls, roofs = [], []
        for _, own, polygon in members:
            low, high, roof = heights(own)
            wall, top = extruded(
                polygon,
                low,
                high,
                name,
                faults,
                own.get("roof:shape", "flat"),
                roof,
            )
            walls.append(wall)
            roofs.append(top)
        taken[name] = taken.get(name, 0) + 1
        number = f"_{taken[name]}" if taken[name] > 1 else ""
        yield make_imported(
            f"building_{name}{number}",
            "building",
            "Building",
            {"body": np.concatenate(walls), "roof": np.concatenate(roofs)},
            {"roof": RED_ROOF},
            construction_year(tags, year_attribute),
        )


def _streets(
    ways: Iterable[tuple[str, Tags, np.ndarray]],
    local: _Local,
    faults: ImportFaults,
) -> Iterator[Imported]:
    roads: list[tuple[str, BaseGeometry]] = []
    walks: list[tuple[str, BaseGeometry]] = []
    for name, tags, line in ways:
        if is_told(tags, "tunnel") or is_told(tags, "area"):
            continue
        width, narrow = street_width(tags), path_width(tags)
        if width is None and narrow is None:
            continue
        course = LineString(local(line))
        if width is None:
            walks.append((name, course.buffer((narrow or 0.0) / 2.0, 4)))
            continue
        if is_told(tags, "bridge"):
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
                for part in _parts(area if is_road else area.difference(paved))
                for polygon in _sound(part, name, faults)
            ]
            if surface:
                yield make_imported(
                    f"{names}_{name}",
                    semantic_class,
                    "Road" if is_road else "Sidewalk",
                    {"surface": np.concatenate(surface)},
                    {},
                )


def _lands(
    areas: Iterable[tuple[str, Tags, list[Polygon]]],
    local: _Local,
    faults: ImportFaults,
) -> Iterator[Imported]:
    for name, tags, polygons in areas:
        found = area_kind(tags)
        if found is None or is_told(tags, "building"):
            continue
        kind, semantic_class = found
        surface = [
            flat_surface(one, -0.05, name, faults)
            for polygon in polygons
            for one in _sound(local.polygon(polygon), name, faults)
        ]
        if surface:
            colours = {"WaterBody": WATER, "LandUse": LAWN}
            yield make_imported(
                f"land_{name}",
                semantic_class,
                kind,
                {"surface": np.concatenate(surface)},
                {"surface": colours.get(kind)},
            )


def _barriers(
    ways: Iterable[tuple[str, Tags, np.ndarray]],
    local: _Local,
    faults: ImportFaults,
) -> Iterator[Imported]:
    for name, tags, line in ways:
        kind = tags.get("barrier")
        if kind == "hedge":
            (width, usual), semantic_class = _HEDGE, "vegetation"
        elif kind in ("wall", "fence", "city_wall"):
            (width, usual), semantic_class = _WALL, "fence"
        else:
            continue
        high = length(tags.get("height")) or usual
        strip = LineString(local(line)).buffer(width / 2.0, cap_style="flat")
        solids = [
            np.concatenate(extruded(polygon, 0.0, high, name, faults))
            for part in _parts(strip)
            for polygon in _sound(part, name, faults)
        ]
        if solids:
            yield make_imported(
                f"{kind}_{name}",
                semantic_class,
                "Barrier",
                {"body": np.concatenate(solids)},
                {},
            )


def _trees(
    told: Iterable[tuple[str, Tags, tuple[float, float]]], local: _Local
) -> Iterator[Imported]:
    for name, tags, place in told:
        x, y = local(np.array([place]))[0].tolist()
        needles = tags.get("leaf_type") == "needleleaved"
        model = tree(
            # Editors give negative numbers to what is new.
            np.random.default_rng([abs(int(name[1:]))]),
            species="spruce" if needles else "lime_tree",
            height=length(tags.get("height")) or None,
        )
        structure = Structure(
            f"tree_{name}",
            "vegetation",
            model,
            (round(x, 3), round(y, 3), 0.0),
        )
        trunk = Point(x, y).buffer(0.3, 2)
        walls, _ = extruded(trunk, 0.0, 2.0, name, ImportFaults())
        yield Imported(structure, "Tree", None, walls)
