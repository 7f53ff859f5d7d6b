"""OpenStreetMap: buildings, streets, trees and land as structures.

OpenStreetMap has no heights above sea level: the ground is level."""

from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from pathlib import Path
import re

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from cns_drake.base.errors import InputError
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.plants.vegetation import tree
from cns_drake.imports.faces import extruded
from cns_drake.imports.foreign_city import (
    ForeignCity,
    Imported,
    Thing,
)
from cns_drake.imports.openstreetmap import reading, streets
from cns_drake.imports.openstreetmap.buildings import (
    TWICE,
    make_buildings,
    standing_buildings,
)
from cns_drake.imports.openstreetmap.reading import has_tag
from cns_drake.imports.openstreetmap.tags import TABLES, length, tag_value
from cns_drake.imports.options import ImportFaults

_TREE_DISTANCE = 8.0  # [m]
# Sizes of barriers and trees [m].
_TALLEST = 150.0
_HEDGE = (0.8, 1.2)
_WALL = (0.2, 1.6)
# How far the sea reaches beyond the buildings [m].
_SEA = 60.0
# Larger areas, such as whole countries, are refused.
_LARGEST = 20_000.0  # [m]


def object_of(tags: reading.Tags) -> str | None:
    """Returns the object of a node; None without one."""
    found = [
        name
        for key, value, name in TABLES["objects"]
        if has_tag(tags, key) and value in ("", tags[key])
    ]
    if not found:
        return None
    name: str = found[0]
    if tags.get("fire_hydrant:type", "pillar") != "pillar":
        return None
    if tags.get("lamp_mount", tags.get("support", "pole")) not in (
        "pole",
        "straight_mast",
        "bent_mast",
        "mast",
    ):
        return None
    if name == "bus_shelter" and tags.get("shelter") != "yes":
        return "sign_rectangular"
    return name


def make_things(
    nodes: Iterable[tuple[str, reading.Tags, tuple[float, float]]],
    ways: Iterable[reading.OsmWay],
    kinds: Mapping[str, str],
    local: reading.Local,
) -> Iterator[Thing]:
    """Yields things at their nodes, and the trees of rows."""
    for name, tags, place in nodes:
        kind = object_of(tags)
        if kind is not None:
            x, y = local(np.array([place]))[0].tolist()
            direction = _direction(tags)
            yield Thing(name, kinds[name], kind, (x, y), direction)
    for name, tags, line, _ in ways:
        if tags.get("natural") == "tree_row":
            needles = tags.get("leaf_type") == "needleleaved"
            course = LineString(local(line))
            count = max(1, round(course.length / _TREE_DISTANCE))
            steps = (np.arange(count) + 0.5) / count
            points = shapely.line_interpolate_point(
                course, steps, normalized=True
            )
            kind = "spruce" if needles else "lime_tree"
            for x, y in shapely.get_coordinates(points).tolist():
                yield Thing(name, kinds[name], kind, (x, y), None)


def _direction(tags: reading.Tags) -> float | None:
    """Returns the heading of a thing, if its tags have one [rad]."""
    text = tags.get("direction", "")
    if not re.fullmatch(r"\d{1,3}(\.\d+)?", text):
        return None
    return float(np.radians(90.0 - float(text)))


def import_openstreetmap(
    path: Path, year_attribute: str | None, dressed: bool = False
) -> ForeignCity:
    """Reads a file; its origin is the middle of its buildings.

    Only for a dressed city, the sea, and grounds by what they are made of, are
    made, bridges have parapets or are left out, and demolished buildings
    without a date are made.

    Raises:
        InputError: if it cannot be read, has no building, or is larger than
            20 km.
    """
    features = reading.read_openstreetmap(path)
    faults = features.faults
    buildings = [
        one
        for one in features.areas
        if reading.is_building(one.tags)
        or (dressed and reading.was_building(one.tags))
    ]
    buildings = list(standing_buildings(buildings, faults, dressed))
    if dressed:
        buildings = list(_without_outers(buildings, features))
    if not buildings:
        raise InputError(f"{path}: {_no_buildings(faults)}")
    low, high = _bounds(buildings)
    longitude, latitude = np.round((low + high) / 2.0, 6).tolist()
    local = reading.Local(longitude, latitude)
    size = local.metres(high - low)
    if size.max() > _LARGEST:
        raise InputError(
            f"{path}: {size.max() / 1000:.0f} km across; cut out a piece of at"
            f" most {_LARGEST / 1000:.0f} km"
        )
    bridges = (
        streets.bridges_of(features.ways, local)
        if dressed
        else streets.Bridges()
    )
    coasts = streets.coasts_of(features.ways) if dressed else []
    limits = local(np.array([low, high])) + _SEA * np.array([[-1.0], [1.0]])
    found = [
        *make_buildings(buildings, local, year_attribute, faults, once=dressed),
        *streets.street_surfaces(features.ways, local, faults, bridges),
        *streets.crossing_stripes(
            features.crossings, features.ways, local, faults
        ),
        *streets.ground_areas(features.areas, local, faults, dressed),
        *streets.sea(coasts, local, limits, faults),
        *streets.parapets(features.ways, bridges, local),
        *_barriers(features.ways, local, faults),
        *_trees(features.trees, local, faults),
    ]
    also = bridges.left_out | {way.name for way in coasts}
    _count_unused(features, found, also)
    return ForeignCity(
        found,
        (latitude, longitude),
        "WGS 84",
        faults,
        streets.drivable_streets(features.ways, local, bridges),
        streets.street_places(features, local),
        any(
            tags.get("driving_side") == "left"
            for _, tags, _, _ in features.ways
        ),
        things=list(
            make_things(features.nodes, features.ways, features.kinds, local)
        ),
    )


def _without_outers(
    buildings: Iterable[reading.OsmArea], features: reading.OsmFeatures
) -> Iterator[reading.OsmArea]:
    """Yields buildings without the outlines of multipolygons.

    A way that is tagged like the multipolygon whose outline it is would fill
    its courts.
    """
    buildings = list(buildings)
    names = {one.name for one in buildings}
    for one in buildings:
        is_outline = features.outers.get(one.name) in names
        if is_outline and not has_tag(one.tags, "building:part"):
            features.faults.add(TWICE, one.name)
        else:
            yield one


def _no_buildings(faults: ImportFaults) -> str:
    """Returns why a file gives no buildings."""
    unfit = [
        f"{kind}: {number}, such as {example}"
        for kind, number, example in faults.rows()
        if "building" in kind
    ]
    if not unfit:
        return "the file has no buildings"
    return f"the file has no usable building; {'; '.join(unfit)}"


def _bounds(
    buildings: Iterable[reading.OsmArea],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and the greatest longitude and latitude (2,) [deg].

    Across the 180th meridian longitudes go on beyond 180.
    """
    places = shapely.get_coordinates(
        [polygon for one in buildings for polygon in one.polygons]
    )
    if np.ptp(places[:, 0]) > 180.0:
        places[:, 0] %= 360.0
    return places.min(axis=0), places.max(axis=0)


def _count_unused(
    features: reading.OsmFeatures,
    found: Iterable[Imported],
    also: AbstractSet[str],
) -> None:
    """Counts things in the file without a place in the city, by kind.

    Buildings that are left out, and the ids in `also`, are counted elsewhere.
    """
    used = {
        name
        for one in found
        for name in re.findall(r"_([nwr]-?\d+)", one.structure.name)
    }
    used |= {
        one.name for one in features.areas if reading.is_building(one.tags)
    }
    used |= also
    for name, kind in features.kinds.items():
        is_relation_of_parts = kind == "relation of type building"
        if name not in used and not is_relation_of_parts:
            if kind.startswith(("building=", "building:part=")):
                continue
            features.faults.add(f"{kind}, left out", name)


def _barriers(
    ways: Iterable[reading.OsmWay], local: reading.Local, faults: ImportFaults
) -> Iterator[Imported]:
    for name, tags, line, _ in ways:
        kind = tags.get("barrier")
        if kind == "hedge":
            (width, usual), semantic_class = _HEDGE, "vegetation"
        elif kind in ("wall", "fence", "city_wall"):
            (width, usual), semantic_class = _WALL, "fence"
        else:
            continue
        where = (name, faults)
        high = tag_value(tags, "height", length, _TALLEST, where) or usual
        strip = LineString(local(line)).buffer(width / 2.0, cap_style="flat")
        yield from streets.raised(
            f"{kind}_{name}", semantic_class, "Barrier", [strip], high, where
        )


def _trees(
    trees: Iterable[tuple[str, reading.Tags, tuple[float, float]]],
    local: reading.Local,
    faults: ImportFaults,
) -> Iterator[Imported]:
    for name, tags, place in trees:
        x, y = local(np.array([place]))[0].tolist()
        needles = tags.get("leaf_type") == "needleleaved"
        model = tree(
            # Editors give negative numbers to new things.
            np.random.default_rng([abs(int(name[1:]))]),
            species="spruce" if needles else "lime_tree",
            height=tag_value(tags, "height", length, _TALLEST, (name, faults))
            or None,
        )
        place_W = (round(x, 3), round(y, 3), 0.0)
        structure = Structure(f"tree_{name}", "vegetation", model, place_W)
        trunk = Point(x, y).buffer(0.3, 2)
        walls, _ = extruded(trunk, 0.0, 2.0, name, ImportFaults())
        yield Imported(structure, "Tree", None, walls)
