"""OpenStreetMap: buildings, streets, trees and land as structures.

OpenStreetMap has no heights above sea level, so the ground is level.
https://wiki.openstreetmap.org/wiki/Simple_3D_Buildings
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from pathlib import Path
import re

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.strtree import STRtree

from cns_drake.base.errors import InputError
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.plants.trees import tree
from cns_drake.imports.building_years import construction_year, year_of_date
from cns_drake.imports.faces import extruded, parts_of, sound_parts
from cns_drake.imports.foreign_city import (
    RED_ROOF,
    ForeignCity,
    Imported,
    Thing,
    make_imported,
)
from cns_drake.imports.openstreetmap import reading, streets
from cns_drake.imports.openstreetmap.passages import (
    Passage,
    Passages,
    WayOpenings,
    note_walled_up,
    passages_of,
)
from cns_drake.imports.openstreetmap.reading import (
    Local,
    OsmArea,
    Tags,
    has_tag,
)
from cns_drake.imports.openstreetmap.tags import (
    TABLES,
    building_kind,
    heights,
    is_inside,
    length,
    tag_value,
    why_absent,
)
from cns_drake.imports.options import ImportFaults

# Names of directions, clockwise from north.
_COMPASS = (
    "N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE",
    "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW",
)  # fmt: skip
# Objects that carry a lamp which is an object of its own.
_POSTS = ("pole", "straight_mast", "bent_mast", "mast")
_TREE_DISTANCE = 8.0  # [m]
# Greatest height of a barrier or a tree [m].
_TALLEST = 150.0
# Width and usual height of a hedge [m].
_HEDGE = (0.8, 1.2)
# Width and usual height of a wall [m].
_WALL = (0.2, 1.6)
# How far the sea extends beyond the buildings [m].
_SEA = 60.0
# Larger areas, such as whole countries, are refused.
_LARGEST = 20_000.0  # [m]


def object_of(tags: reading.Tags) -> str | None:
    """Returns the kind of small object that a node's tags describe.

    The kind is a key of `cns_drake.city.placement.objects.OBJECTS`, or None for
    a node without such an object.
    """
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
    if tags.get("lamp_mount", tags.get("support", "pole")) not in _POSTS:
        return None
    if name == "bus_shelter" and tags.get("shelter") != "yes":
        return "sign_rectangular"
    return name


def make_things(features: reading.OsmFeatures, local: Local) -> Iterator[Thing]:
    """Yields small objects: those at nodes, and the trees of tree rows.

    `local` converts places of the file to metres in W.
    """
    kinds = features.kinds
    for name, tags, place in features.nodes:
        kind = object_of(tags)
        if kind is not None and not is_inside(tags):
            x, y = local(np.array([place]))[0].tolist()
            direction = _direction(tags)
            yield Thing(name, kinds[name], kind, (x, y), direction)
    for name, tags, line, _ in features.ways:
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
    """Returns the heading in a thing's tags [rad]; None if they have none."""
    text = tags.get("direction", "")
    if text.upper() in _COMPASS:
        text = str(22.5 * _COMPASS.index(text.upper()))
    if not re.fullmatch(r"\d{1,3}(\.\d+)?", text):
        return None
    return float(np.radians(90.0 - float(text)))


def import_openstreetmap(
    path: Path, year_attribute: str | None, dressed: bool = False
) -> ForeignCity:
    """Imports a city from an OpenStreetMap file.

    The origin of the map is the centre of its buildings. The ground is level.
    Bridges and tunnels become streets on the ground, unless `dressed` is set.

    Args:
        path: the file.
        year_attribute: tag with the year of construction; None for the usual
            tags.
        dressed: whether to read the file for a city with details. The city then
            has the sea, areas of ground by their material, and buildings that
            were demolished at an unknown date. Tunnels, and bridges over other
            ways, are left out; all other bridges are streets on the ground with
            parapets.

    Raises:
        InputError: if the file cannot be read, has no building, or is larger
            than 20 km.
    """
    features = reading.read_openstreetmap(path)
    faults = features.faults
    buildings = [
        one
        for one in features.areas
        if reading.is_building(one.tags)
        or (dressed and reading.was_building(one.tags))
    ]
    standing = standing_buildings(buildings, faults, dressed)
    buildings = list(_without_outers(standing, features))
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
    passages = passages_of(features.ways, local, faults)
    driven = streets.drivable_streets(features.ways, local, bridges)
    note_walled_up(
        [(one.name, LineString(one.line)) for one in driven],
        [
            (local.polygon(polygon), heights(one.tags)[0])
            for one in buildings
            if not _is_gone(one.tags)
            for polygon in one.polygons
        ],
        passages,
        faults,
    )
    found = [
        *make_buildings(
            buildings,
            local,
            year_attribute,
            faults,
            once=dressed,
            passages=passages,
        ),
        *streets.street_surfaces(features, local, bridges),
        *streets.crossing_stripes(features, local),
        *streets.ground_areas(features, local, dressed),
        *streets.sea(coasts, local, limits, faults),
        *streets.parapets(features.ways, bridges, local),
        *_barriers(features, local),
        *_trees(features, local),
    ]
    also = bridges.left_out | {way.name for way in coasts}
    _count_unused(features, found, also)
    return ForeignCity(
        found,
        (latitude, longitude),
        "WGS 84",
        faults,
        driven,
        streets.street_places(features, local),
        any(
            tags.get("driving_side") == "left"
            for _, tags, _, _ in features.ways
        ),
        things=list(make_things(features, local)),
    )


def _without_outers(
    buildings: Iterable[reading.OsmArea], features: reading.OsmFeatures
) -> Iterator[reading.OsmArea]:
    """Yields buildings without ways that are the outlines of multipolygons.

    If such a way has the same tags as its multipolygon, it would fill its
    courtyards.
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
    """Returns why a file has no buildings to use."""
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

    If the area crosses the 180th meridian, longitudes continue beyond 180.
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
    """Counts, by kind, what in the file has no place in the city.

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
    tagged = {one.name: one.tags for one in features.ways}
    tagged |= {one.name: one.tags for one in features.areas}
    tagged |= {name: tags for name, tags, _ in features.trees}
    for name, tags in tagged.items():
        for key, usual in TABLES["unread"].items():
            if tags.get(key, "") not in ("", *usual):
                features.faults.add(f"tag {key}, not read", name)
    for name, kind in features.kinds.items():
        is_relation_of_parts = kind == "relation of type building"
        if name not in used and not is_relation_of_parts:
            if kind.startswith(("building=", "building:part=")):
                continue
            features.faults.add(f"{kind}, left out", name)


def _barriers(
    features: reading.OsmFeatures, local: Local
) -> Iterator[Imported]:
    openings = WayOpenings(features.ways, local)
    for way in features.ways:
        name, tags, line, _ = way
        kind = tags.get("barrier")
        if kind == "hedge":
            width, usual = _HEDGE
            semantic_class = "vegetation"
        elif kind in ("wall", "fence", "city_wall"):
            width, usual = _WALL
            semantic_class = "fence"
        else:
            continue
        where = (name, features.faults)
        high = tag_value(tags, "height", length, _TALLEST, where) or usual
        course = LineString(local(line))
        strip: BaseGeometry = course.buffer(width / 2.0, cap_style="flat")
        strip = strip.difference(openings.across(way, course, features.faults))
        look = streets.Look("Barrier", semantic_class, None, high)
        yield from streets.raised_structure(
            f"{kind}_{name}", look, [strip], where
        )


def _trees(features: reading.OsmFeatures, local: Local) -> Iterator[Imported]:
    for name, tags, place in features.trees:
        if is_inside(tags):
            continue
        x, y = local(np.array([place]))[0].tolist()
        needles = tags.get("leaf_type") == "needleleaved"
        model = tree(
            # Editors give negative numbers to new objects.
            np.random.default_rng([abs(int(name[1:]))]),
            species="spruce" if needles else "lime_tree",
            height=tag_value(
                tags, "height", length, _TALLEST, (name, features.faults)
            )
            or None,
        )
        place_W = (round(x, 3), round(y, 3), 0.0)
        structure = Structure(f"tree_{name}", "vegetation", model, place_W)
        trunk = Point(x, y).buffer(0.3, 2)
        walls, _ = extruded(trunk, 0.0, 2.0, name, ImportFaults())
        yield Imported(structure, "Tree", None, walls)


# How the report counts buildings that are not made as in the file.
TWICE = "building drawn twice, taken once"
_NESTED = "building inside another one, taken as its part"
# An outline lies in another one if this share of its area does.
_INSIDE = 0.9
# Parts are the whole building if they cover at least this share of an outline.
_ALL_OF_IT = 0.9
# Remainders of an outline that are narrower than this are dropped [m].
_SLIVER = 0.25
# Least height of a passage [m].
_LEAST_CLEAR = 2.0
# Least height of the building above a passage [m].
_LINTEL = 0.4


@dataclass(frozen=True)
class _Block:
    """A solid of a building: footprint, lowest and highest point, roof [m]."""

    name: str
    tags: Tags
    polygon: Polygon
    low: float
    high: float
    roof: float

    def replaced(self, polygon: Polygon, low: float, high: float) -> _Block:
        """Returns this solid with a new footprint, new heights, a flat roof."""
        plain = {k: v for k, v in self.tags.items() if k != "roof:shape"}
        return _Block(self.name, plain, polygon, low, high, 0.0)


def standing_buildings(
    areas: Iterable[OsmArea], faults: ImportFaults, with_gone: bool = False
) -> Iterator[OsmArea]:
    """Yields buildings that stand, or that were demolished at a known date.

    All other buildings, such as buildings below the ground, are left out.

    Args:
        areas: buildings and building parts.
        faults: counts to which the omitted buildings are added.
        with_gone: whether to also yield buildings that were demolished at an
            unknown date.
    """
    for one in areas:
        absent = why_absent(one.tags)
        is_past = absent == "demolished" and (
            with_gone or year_of_date(one.tags.get("end_date", ""))
        )
        if absent is None or is_past:
            yield one
        else:
            faults.add(f"{absent} building, left out", one.name)


def make_buildings(
    areas: Iterable[OsmArea],
    local: Local,
    year_attribute: str | None,
    faults: ImportFaults,
    once: bool = False,
    passages: Sequence[Passage] = (),
) -> Iterator[Imported]:
    """Yields buildings, made from outlines and building parts.

    Where a building has parts, the parts replace the outline.

    Args:
        areas: outlines of buildings, and building parts.
        local: converts degrees to metres.
        year_attribute: tag with the year of construction; None for the usual
            tags.
        faults: counts parts that were repaired or left out.
        once: whether an outline inside the outline of another building is
            treated as a part of this building, and outlines that occur twice
            are made once.
        passages: ways for which buildings are opened.
    """
    through = Passages(passages)
    outlines: list[_Block] = []
    parts: list[_Block] = []
    for name, tags, polygons in areas:
        low, high, roof = heights(tags, (name, faults))
        group = parts if has_tag(tags, "building:part") else outlines
        for polygon in polygons:
            for one in sound_parts(local.polygon(polygon), name, faults):
                group.append(_Block(name, tags, one, low, high, roof))
    if once:
        outlines, nested = _taken_once(outlines, faults)
        parts += nested
    of_outline: dict[int, list[_Block]] = {}
    # Parts do not belong to what once stood in their place.
    outlines.sort(key=lambda one: _is_gone(one.tags))
    tree_of_outlines = STRtree(
        [one.polygon for one in outlines if not _is_gone(one.tags)]
    )
    alone = []
    for part in parts:
        inside = tree_of_outlines.query(
            part.polygon.representative_point(), predicate="within"
        )
        if len(inside):
            of_outline.setdefault(int(inside.min()), []).append(part)
        else:
            alone.append([part])
    groups = [
        (one, _with_parts(one, of_outline.get(k, [])))
        for k, one in enumerate(outlines)
    ]
    groups += [(some[0], some) for some in alone]
    taken: dict[str, int] = {}
    for whole, blocks in groups:
        walls, roofs = [], []
        for block in _solids_with_openings(blocks, through, faults):
            wall, top = extruded(
                block.polygon,
                block.low,
                block.high,
                whole.name,
                faults,
                block.tags.get("roof:shape", "flat"),
                block.roof,
            )
            walls.append(wall)
            roofs.append(top)
        taken[whole.name] = taken.get(whole.name, 0) + 1
        copy = taken[whole.name]
        number = f"_{copy}" if copy > 1 else ""
        made = make_imported(
            f"building_{whole.name}{number}",
            "building",
            "Building",
            {"body": np.concatenate(walls), "roof": np.concatenate(roofs)},
            {"roof": RED_ROOF},
            construction_year(whole.tags, year_attribute, whole.name, faults),
            year_of_date(whole.tags.get("end_date", "")),
            # If parts look different, the look of the first one counts.
            tags={**blocks[0].tags, **whole.tags},
            lod=1.0,
            narrower=building_kind(whole.tags),
        )
        yield replace(made, is_gone=True) if _is_gone(whole.tags) else made


def _solids_with_openings(
    blocks: Iterable[_Block], passages: Passages, faults: ImportFaults
) -> Iterator[_Block]:
    """Yields the solids of a building, with an opening for each passage.

    Above an opening, a solid stays whole, with its roof.
    """
    for one in blocks:
        found = passages.through(one.polygon, one.low)
        if found is None:
            yield one
            continue
        area, clear = found
        below_roof = one.high - one.roof - _LINTEL
        if below_roof < _LEAST_CLEAR:
            below_roof = one.high - _LINTEL
        clear = min(clear, below_roof)
        if clear < max(_LEAST_CLEAR, one.low):
            faults.add("building too low for its passage, not opened", one.name)
            yield one
            continue
        for piece in parts_of(one.polygon.difference(area)):
            if not piece.buffer(-_SLIVER).is_empty:
                yield one.replaced(piece, one.low, clear)
        roof = min(one.roof, one.high - clear - 0.1)
        yield replace(one, low=clear, roof=roof)


def _taken_once(
    outlines: Sequence[_Block], faults: ImportFaults
) -> tuple[list[_Block], list[_Block]]:
    """Returns the outlines of buildings, each once, and those inside others.

    Otherwise walls of both would stand in the same place, and hide each other's
    windows.
    """
    tree = STRtree([one.polygon for one in outlines])
    whole: dict[int, _Block] = {}
    nested = []
    by_area = sorted(
        range(len(outlines)), key=lambda k: -outlines[k].polygon.area
    )
    for number in by_area:
        one = outlines[number]
        around = [
            k
            for k in tree.query(one.polygon, "intersects").tolist()
            if k in whole and _lies_in(one, whole[k])
        ]
        twins = [k for k in around if _lies_in(whole[k], one)]
        dates = [_dates(whole[k].tags) for k in around]
        if twins:
            faults.add(TWICE, one.name)
            twin = whole[twins[0]]
            tags = {**one.tags, **twin.tags}
            if twin.tags.get("building") == "yes":
                tags |= {k: v for k, v in one.tags.items() if k == "building"}
            whole[twins[0]] = replace(twin, tags=tags)
        elif dates and _dates(one.tags) in ({}, *dates):
            faults.add(_NESTED, one.name)
            nested.append(one)
        else:
            whole[number] = one
    return [whole[k] for k in sorted(whole)], nested


def _lies_in(one: _Block, other: _Block) -> bool:
    """Returns whether an outline lies in another one of the same time."""
    if _is_gone(one.tags) or _is_gone(other.tags):
        return False
    dates, others = _dates(one.tags), _dates(other.tags)
    # One that has ended may have made room for the other.
    if dates.get("end_date") != others.get("end_date"):
        return False
    starts = {
        tags["start_date"] for tags in (dates, others) if "start_date" in tags
    }
    if len(starts) > 1:
        return False
    shared = one.polygon.intersection(other.polygon).area
    return bool(shared >= _INSIDE * one.polygon.area)


def _dates(tags: Tags) -> dict[str, str]:
    return {key: tags[key] for key in ("start_date", "end_date") if key in tags}


def _is_gone(tags: Tags) -> bool:
    """Returns whether a building was demolished, at an unknown date."""
    return (
        year_of_date(tags.get("end_date", "")) is None
        and why_absent(tags) == "demolished"
    )


def _with_parts(outline: _Block, parts: list[_Block]) -> list[_Block]:
    """Returns the blocks of a building.

    If the parts cover the outline, they are the building. Otherwise the
    outline's own solid fills the rest, also below parts that begin above the
    ground, and the parts are additions to it.
    """
    if not parts:
        return [outline]
    covered = shapely.union_all([part.polygon for part in parts])
    rest = outline.polygon.difference(covered.buffer(0.01))
    blocks = list(parts)
    if rest.area > (1.0 - _ALL_OF_IT) * outline.polygon.area:
        by_bottom = sorted(parts, key=lambda part: part.low)
        below = rest
        for part in by_bottom:
            # The area that no lower part covers.
            shadow = part.polygon.difference(below)
            top = min(part.low, outline.high)
            if top > outline.low:
                blocks += [
                    outline.replaced(piece, outline.low, top)
                    for piece in parts_of(shadow)
                ]
            below = shapely.union(below, part.polygon)
    blocks += [
        outline.replaced(piece, outline.low, outline.high)
        for piece in parts_of(rest)
        if not piece.buffer(-_SLIVER).is_empty
    ]
    return blocks
