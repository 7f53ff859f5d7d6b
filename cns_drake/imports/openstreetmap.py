"""OpenStreetMap: buildings, streets, trees and land as structures.

Heights above the sea are not in it: the ground is level.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from shapely.geometry import LineString, Point, Polygon
from shapely.strtree import STRtree

from cns_drake.base.errors import InputError
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
from cns_drake.imports.osm_places import Local, parts_of, sound_parts
from cns_drake.imports.osm_reading import (
    OsmWay,
    Tags,
    is_building,
    is_told,
    read_openstreetmap,
)
from cns_drake.imports.osm_streets import (
    crossing_stripes,
    drivable_streets,
    street_surfaces,
)
from cns_drake.imports.osm_tags import (
    area_kind,
    heights,
    length,
)

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
    local = Local(longitude, latitude)
    size = local(np.array([high]))[0] - local(np.array([low]))[0]
    if size.max() > _LARGEST:
        raise InputError(
            f"{path}: {size.max() / 1000:.0f} km across; cut out a piece of at"
            f" most {_LARGEST / 1000:.0f} km"
        )
    found = [
        *_buildings(buildings, local, year_attribute, faults),
        *street_surfaces(features.ways, local, faults),
        *crossing_stripes(features.crossings, features.ways, local, faults),
        *_lands(features.areas, local, faults),
        *_barriers(features.ways, local, faults),
        *_trees(features.trees, local),
    ]
    return ForeignCity(
        found,
        (latitude, longitude),
        "WGS 84",
        faults,
        drivable_streets(features.ways, local),
        any(
            tags.get("driving_side") == "left"
            for _, tags, _, _ in features.ways
        ),
    )


def _buildings(
    told: Iterable[tuple[str, Tags, list[Polygon]]],
    local: Local,
    year_attribute: str | None,
    faults: ImportFaults,
) -> Iterator[Imported]:
    """Yields buildings; one that has parts is what these are."""
    outlines: list[tuple[str, Tags, Polygon]] = []
    parts: list[tuple[str, Tags, Polygon]] = []
    for name, tags, polygons in told:
        for polygon in polygons:
            for one in sound_parts(local.polygon(polygon), name, faults):
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


def _lands(
    areas: Iterable[tuple[str, Tags, list[Polygon]]],
    local: Local,
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
            for one in sound_parts(local.polygon(polygon), name, faults)
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
    ways: Iterable[OsmWay],
    local: Local,
    faults: ImportFaults,
) -> Iterator[Imported]:
    for name, tags, line, _ in ways:
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
            for part in parts_of(strip)
            for polygon in sound_parts(part, name, faults)
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
    told: Iterable[tuple[str, Tags, tuple[float, float]]], local: Local
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
