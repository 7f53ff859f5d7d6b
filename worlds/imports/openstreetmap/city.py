"""Imports a city from an OpenStreetMap file.

OpenStreetMap has no heights above sea level, so the ground is level.
https://wiki.openstreetmap.org/wiki/Simple_3D_Buildings
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
import math
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import InputError
from worlds.imports import faces
from worlds.imports.colours import WHITE_PAINT
from worlds.imports.faults import ImportFaults
from worlds.imports.foreign_city import ForeignCity, SmallObject
from worlds.imports.imported_objects import Base, ImportedObject, make_object
from worlds.imports.openstreetmap import reading, streets
from worlds.imports.openstreetmap.area_looks import AreaLook, raised_object
from worlds.imports.openstreetmap.bridges import (
    Bridges,
    bridges_of,
    decks,
    parapets,
)
from worlds.imports.openstreetmap.building_tags import heights
from worlds.imports.openstreetmap.buildings import (
    TWICE,
    is_gone,
    make_buildings,
    standing_buildings,
    works_at_points,
)
from worlds.imports.openstreetmap.element_kinds import is_building, was_building
from worlds.imports.openstreetmap.features import (
    OsmArea,
    OsmFeatures,
    OsmWay,
    Tags,
)
from worlds.imports.openstreetmap.grounds import coasts_of, ground_areas, sea
from worlds.imports.openstreetmap.passages import (
    HEADROOM,
    THROUGH,
    Passage,
    WayOpenings,
    passages_of,
)
from worlds.imports.openstreetmap.tags import (
    TABLES,
    has_tag,
    heading_deg,
    is_inside,
    length,
    tag_value,
)
from worlds.imports.openstreetmap.way_tags import (
    is_tunnel,
    path_width,
    street_width,
)
from worlds.imports.part_tables import PartTable
from worlds.imports.solids import extruded
from worlds.imports.streets import Street
from worlds.maps import LocalMetres
from worlds.shapes import Structure, tree

_PARTS = PartTable(Path(__file__).with_name("parts.yaml"))
# Greatest height of a barrier [m].
_TALLEST = 150.0
# A car can hit this part of a tree: radius and height of the trunk [m].
_TRUNK_RADIUS = 0.3
_TRUNK_HEIGHT = 2.0
_THICKEST = 60.0  # Greatest width of a barrier [m].


class _UsualBarrier(NamedTuple):
    """A kind of barrier.

    Attributes:
        width: width without a tag for it [m].
        height: height without a tag for it [m].
    """

    width: float
    height: float
    semantic_class: str


_WALL = _UsualBarrier(0.2, 1.6, "fence")
# Value of the tag `barrier` -> the barrier. All others are left out.
_BARRIERS = {
    "hedge": _UsualBarrier(0.8, 1.2, "vegetation"),
    **dict.fromkeys(("wall", "fence", "city_wall"), _WALL),
}
# How far the sea extends beyond the buildings [m].
_SEA_MARGIN = 60.0
# Wider areas, such as whole countries, are refused [m].
_WIDEST = 20_000.0
# Values of the tags `lamp_mount` and `support` for an object that stands on a
# post of its own. With other values, such as `wall_mounted`, another structure
# carries the object.
_POSTS = ("pole", "straight_mast", "bent_mast", "mast")
_TALLEST_TREE = 150.0  # [m]
# Distance between the trees of a tree row [m].
_TREE_SPACING = 8.0
# Width of the stripes of a zebra crossing, and of the gaps between them [m].
_STRIPE_WIDTH = 0.5
# Length of the stripes [m].
_STRIPE_LENGTH = 3.0
# Height of the stripes above the street [m].
_STRIPE_HEIGHT = 0.01


def import_openstreetmap(
    path: Path, year_attribute: str | None, dressed: bool = False
) -> ForeignCity:
    """Imports a city from an OpenStreetMap file.

    The origin of the map is the centre of its buildings. The ground is level.
    Bridges over other ways become decks that no street leads to; all other
    bridges are streets on the ground with parapets. Tunnels are left out.

    Args:
        path: the file.
        year_attribute: tag with the year of construction; None for the usual
            tags.
        dressed: whether to read the file for a city with details. The city then
            has the sea, areas of ground by their material, and buildings that
            were demolished at an unknown date.

    Raises:
        InputError: if the file cannot be read, has no building, or extends over
            more than 20 km.
    """
    features = reading.read_openstreetmap(path)
    faults = features.faults
    features.areas += works_at_points(features)
    buildings = _used_buildings(features, dressed)
    if not buildings:
        raise InputError(f"{path}: {_no_buildings(faults)}")
    low, high = _bounds(buildings)
    longitude, latitude = np.round((low + high) / 2.0, 6).tolist()
    local = LocalMetres(longitude, latitude)
    width = local.metres(high - low).max()
    if width > _WIDEST:
        raise InputError(
            f"{path}: {width / 1000:.0f} km across; cut out a piece of at most"
            f" {_WIDEST / 1000:.0f} km"
        )
    bridges = bridges_of(features.ways, local)
    coasts = coasts_of(features.ways) if dressed else []
    outwards = np.array([[-1.0], [1.0]])
    sea_limits = local(np.array([low, high])) + _SEA_MARGIN * outwards
    passages = passages_of(features.ways, local, faults)
    driven = streets.drivable_streets(features.ways, local, bridges)
    _count_walled_up(driven, buildings, local, passages, faults)
    objects = [
        *make_buildings(
            buildings,
            local,
            year_attribute,
            faults,
            once=dressed,
            passages=passages,
        ),
        *streets.street_surfaces(features, local, bridges),
        *_crossing_stripes(features, local, bridges),
        *ground_areas(features, local, dressed),
        *sea(coasts, local, sea_limits, faults),
        *decks(features.ways, bridges, local),
        *parapets(features.ways, bridges, local),
        *_barriers(features, local),
        *_trees(features, local),
    ]
    counted = bridges.left_out | {way.name for way in coasts}
    _count_unused(features, objects, counted, dressed)
    return ForeignCity(
        objects,
        (latitude, longitude),
        "WGS 84",
        faults,
        len(features.kinds),
        driven,
        any(way.tags.get("driving_side") == "left" for way in features.ways),
        small_objects=list(_make_small_objects(features, local)),
        level=0.0,
        sources={
            one.structure.name: name
            for one in objects
            for name in _ids_in(one.structure.name)
        },
    )


def _used_buildings(features: OsmFeatures, dressed: bool) -> list[OsmArea]:
    """Returns the buildings of a file from which structures are made.

    For a dressed city, the result includes buildings that were demolished at an
    unknown date.
    """
    areas = [
        area
        for area in features.areas
        if is_building(area.tags) or (dressed and was_building(area.tags))
    ]
    standing = standing_buildings(areas, features.faults, dressed)
    return list(_without_outers(standing, features))


def _count_walled_up(
    driven: Iterable[Street],
    buildings: Iterable[OsmArea],
    local: LocalMetres,
    passages: Sequence[Passage],
    faults: ImportFaults,
) -> None:
    """Counts streets that lead through buildings without a passage."""
    low = [
        local.polygon(polygon)
        for building in buildings
        if not is_gone(building.tags) and heights(building.tags).low < HEADROOM
        for polygon in building.polygons
    ]
    tree = STRtree(low)
    open_ways = {passage.name for passage in passages}
    for street in driven:
        line = LineString(street.line)
        if street.name not in open_ways and any(
            low[k].intersection(line).length > THROUGH
            for k in tree.query(line, "intersects")
        ):
            kind = "street into a building without a passage"
            faults.add(kind, street.name)


def _without_outers(
    buildings: Iterable[OsmArea], features: OsmFeatures
) -> Iterator[OsmArea]:
    """Yields the buildings, except ways that are outlines of multipolygons.

    If such a way has the same tags as its multipolygon, a building made from
    the way would fill the courtyards of the multipolygon.
    """
    buildings = list(buildings)
    names = {building.name for building in buildings}
    for building in buildings:
        is_outline = features.outers.get(building.name) in names
        if is_outline and not has_tag(building.tags, "building:part"):
            features.faults.add(TWICE, building.name)
        else:
            yield building


def _no_buildings(faults: ImportFaults) -> str:
    """Returns why a file has no buildings to use."""
    unfit = [
        f"{fault.kind}: {fault.number}, such as {fault.example}"
        for fault in faults.rows()
        if "building" in fault.kind
    ]
    if not unfit:
        return "the file has no buildings"
    return f"the file has no usable building; {'; '.join(unfit)}"


def _bounds(
    buildings: Iterable[OsmArea],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and the greatest longitude and latitude (2,) [deg].

    If the area crosses the 180th meridian, longitudes continue beyond 180.
    """
    places = shapely.get_coordinates(
        [polygon for building in buildings for polygon in building.polygons]
    )
    if np.ptp(places[:, 0]) > 180.0:
        places[:, 0] %= 360.0
    return places.min(axis=0), places.max(axis=0)


def _count_unused(
    features: OsmFeatures,
    objects: Iterable[ImportedObject],
    counted: AbstractSet[str],
    dressed: bool,
) -> None:
    """Counts, by kind, the tags and objects that the city does not use.

    Args:
        features: content of the file, whose faults are added to.
        objects: objects of the city. The names of their structures contain the
            ids of the file's objects from which they were made.
        counted: ids of objects that are counted elsewhere, as are the buildings
            that are left out.
    """
    used = {name for one in objects for name in _ids_in(one.structure.name)}
    used |= {area.name for area in features.areas if is_building(area.tags)}
    _account_for_tags(features, used, dressed)
    used |= counted
    for name, kind in features.kinds.items():
        is_relation_of_parts = kind == "relation of type building"
        if name not in used and not is_relation_of_parts:
            if kind.startswith(("building=", "building:part=")):
                continue
            features.faults.add(f"{kind}, left out", name)


def _ids_in(name: str) -> list[str]:
    """Returns the ids of the file's elements in the name of a structure."""
    return re.findall(r"_([nwr]-?\d+)", name)


def _account_for_tags(
    features: OsmFeatures, used: AbstractSet[str], dressed: bool
) -> None:
    """Accounts for each tag of the things that the city has.

    `used` contains the ids of things with a structure. The other arguments are
    as for `_count_unused`.
    """
    things = {area.name: area.tags for area in features.areas}
    things |= {way.name: way.tags for way in features.ways}
    things |= {tree.name: tree.tags for tree in features.trees}
    rows = {
        way.name
        for way in features.ways
        if dressed and way.tags.get("natural") == "tree_row"
    }
    for name, tags in things.items():
        elements = _elements_of(tags) if name in used else []
        if name in rows:
            elements.append("tree row")
        if elements:
            _PARTS.account(elements, tags, name, features.faults, "tag ")
    for number, tags in features.crossings:
        if f"n{number}" in used:
            _PARTS.account(
                ["crossing"], tags, f"n{number}", features.faults, "tag "
            )
    for name, tags, _ in features.nodes if dressed else ():
        if _object_kind(tags) is not None and not is_inside(tags):
            _PARTS.account(
                ["small object"], tags, name, features.faults, "tag "
            )


def _elements_of(tags: Tags) -> list[str]:
    """Returns what a thing with a structure is, in words of the table."""
    kinds = {
        "building": is_building(tags) or was_building(tags),
        "barrier": "barrier" in tags,
        "tree": tags.get("natural") == "tree",
        "street": street_width(tags) is not None,
        "path": path_width(tags) is not None,
        "coastline": tags.get("natural") == "coastline",
    }
    return [kind for kind, is_it in kinds.items() if is_it] or ["ground"]


def _barriers(
    features: OsmFeatures, local: LocalMetres
) -> Iterator[ImportedObject]:
    """Yields hedges, walls and fences, with openings where ways lead through.

    `local` converts longitudes and latitudes to coordinates in metres.
    """
    openings = WayOpenings(features.ways, local)
    faults = features.faults
    for way in features.ways:
        if way.tags.get("barrier") not in _BARRIERS or _is_filled(way):
            continue
        usual = _BARRIERS[way.tags["barrier"]]
        where = (way.name, faults)
        width = tag_value(way.tags, "width", length, _THICKEST, where)
        course = LineString(local(way.line))
        strip: BaseGeometry = course.buffer(
            (width or usual.width) / 2.0, cap_style="flat"
        )
        strip = strip.difference(openings.across(way, course, faults))
        yield from _barrier(way, [strip], faults)
    for area in features.areas:
        if area.tags.get("barrier") in _BARRIERS and _is_filled(area):
            yield from _barrier(area, map(local.polygon, area.polygons), faults)


def _is_filled(thing: OsmWay | OsmArea) -> bool:
    """Returns whether a barrier fills its outline."""
    is_relation = thing.name.startswith("r")
    return is_relation or thing.tags.get("area", "no") != "no"


def _barrier(
    thing: OsmWay | OsmArea, areas: Iterable[BaseGeometry], faults: ImportFaults
) -> Iterator[ImportedObject]:
    """Yields the solid of a barrier on areas in W [m]."""
    name, tags = thing.name, thing.tags
    where = (name, faults)
    usual = _BARRIERS[tags["barrier"]]
    high = tag_value(tags, "height", length, _TALLEST, where) or usual.height
    low = tag_value(tags, "min_height", length, _TALLEST, where, 0.0) or 0.0
    if low >= high:
        faults.add("barrier that begins above its top, lowered", name)
        low = 0.0
    look = AreaLook("Barrier", usual.semantic_class, None, high)
    base = Base.RAISED if low > 0.0 else Base.GROUND
    yield from raised_object(
        f"{tags['barrier']}_{name}", look, areas, where, low, base
    )


def _trees(
    features: OsmFeatures, local: LocalMetres
) -> Iterator[ImportedObject]:
    """Yields the trees of a file that are not inside a building.

    `local` converts longitudes and latitudes to coordinates in metres.
    """
    for name, tags, place in features.trees:
        if is_inside(tags):
            continue
        x, y = local(np.array([place]))[0].tolist()
        needles = tags.get("leaf_type") == "needleleaved"
        model = tree(
            # Editors give negative numbers to new objects.
            np.random.default_rng([abs(int(name[1:]))]),
            species="spruce" if needles else "lime_tree",
            height=_tree_height(name, tags, features.faults),
        )
        place_W = (round(x, 3), round(y, 3), 0.0)
        structure = Structure(f"tree_{name}", "vegetation", model, place_W)
        trunk = Point(x, y).buffer(_TRUNK_RADIUS, quad_segs=2)
        walls, _ = extruded(trunk, 0.0, _TRUNK_HEIGHT, name, ImportFaults())
        yield ImportedObject(structure, "Tree", None, walls)


def _object_kind(tags: Tags) -> str | None:
    """Returns the kind of small object that a node's tags describe.

    The kind is a key of `worlds.shapes.OBJECTS`, or None for
    a node without such an object.
    """
    kinds: list[str] = [
        kind
        for key, value, kind in TABLES["objects"]
        if has_tag(tags, key) and value in ("", tags[key])
    ]
    if not kinds:
        return None
    if tags.get("fire_hydrant:type", "pillar") != "pillar":
        return None
    if tags.get("lamp_mount", tags.get("support", "pole")) not in _POSTS:
        return None
    if kinds[0] == "bus_shelter" and tags.get("shelter") != "yes":
        return "sign_rectangular"
    return kinds[0]


def _make_small_objects(
    features: OsmFeatures, local: LocalMetres
) -> Iterator[SmallObject]:
    """Yields small objects: objects at nodes, and the trees of tree rows.

    `local` converts places of the file to metres in W.
    """
    elements = features.kinds
    for name, tags, place in features.nodes:
        kind = _object_kind(tags)
        if kind is not None and not is_inside(tags):
            x, y = local(np.array([place]))[0].tolist()
            degrees = heading_deg(tags.get("direction"))
            heading = None if degrees is None else math.radians(degrees)
            yield SmallObject(name, elements[name], kind, (x, y), heading)
    for name, tags, line, _ in features.ways:
        if tags.get("natural") == "tree_row":
            needles = tags.get("leaf_type") == "needleleaved"
            course = LineString(local(line))
            count = max(1, round(course.length / _TREE_SPACING))
            steps = (np.arange(count) + 0.5) / count
            points = shapely.line_interpolate_point(
                course, steps, normalized=True
            )
            kind = "spruce" if needles else "lime_tree"
            height = _tree_height(name, tags, features.faults)
            for xy in map(tuple, shapely.get_coordinates(points).tolist()):
                yield SmallObject(name, elements[name], kind, xy, None, height)


def _tree_height(name: str, tags: Tags, faults: ImportFaults) -> float | None:
    """Returns the height of a tree, or of a row's trees [m]; None if unknown.

    A height that cannot be is counted in `faults`.
    """
    where = (name, faults)
    return tag_value(tags, "height", length, _TALLEST_TREE, where) or None


def _crossing_stripes(
    features: OsmFeatures, local: LocalMetres, bridges: Bridges
) -> Iterator[ImportedObject]:
    """Yields the stripes of zebra crossings, slightly above their street."""
    marked = {number for number, tags in features.crossings if is_marked(tags)}
    for name, tags, line, nodes in features.ways:
        width = street_width(tags)
        if width is None or is_tunnel(tags) or name in bridges.left_out:
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
            yield make_object(
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


def is_marked(tags: Mapping[str, str]) -> bool:
    """Returns whether a crossing is marked by stripes."""
    markings = tags.get("crossing:markings")
    if markings is not None:
        return markings.startswith("zebra") or markings == "yes"
    return (
        tags.get("crossing") in ("zebra", "marked", "uncontrolled")
        or tags.get("crossing_ref") == "zebra"
    )
