"""Buildings of OpenStreetMap, made from outlines and building parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.strtree import STRtree

from worlds.imports.building_years import (
    construction_year,
    demolition_year,
    understood_year,
    year_of_date,
)
from worlds.imports.colours import RED_ROOF
from worlds.imports.faces import parts_of, valid_parts
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import Base, ImportedObject, make_object
from worlds.imports.openstreetmap.building_tags import (
    LEAST_WALL,
    building_kind,
    heights,
    is_open_below,
    why_absent,
)
from worlds.imports.openstreetmap.element_kinds import is_building
from worlds.imports.openstreetmap.features import OsmArea, OsmFeatures, Tags
from worlds.imports.openstreetmap.passages import Passage, Passages
from worlds.imports.openstreetmap.tags import (
    TABLES,
    has_tag,
    heading_deg,
    length,
    tag_value,
)
from worlds.imports.solids import extruded
from worlds.maps import LocalMetres

# How the report counts buildings that are not made as in the file.
TWICE = "building drawn twice, taken once"
_NESTED = "building inside another one, taken as its part"
# An outline lies in another one if this share of its area does.
_INSIDE_SHARE = 0.9
# Parts are meant as the whole building if they leave at most this share of its
# outline uncovered.
_MOST_UNCOVERED = 0.1
# Parts are enlarged by this before they are cut out of their outline, so that
# no sliver remains where their edges differ by a rounding error [m].
_SEAM = 0.01
# Pieces of an outline are dropped if no circle of this radius fits in [m].
_SLIVER_RADIUS = 0.25
# Greatest diameter of a tower or tank [m].
_WIDEST_WORK = 150.0
# Least height of a passage [m].
_LEAST_CLEAR = 2.0
# Least height of the building above a passage [m].
_LINTEL = 0.4


@dataclass(frozen=True)
class _Block:
    """A solid of a building.

    Attributes:
        name: id of its area in the file.
        tags: tags of this area.
        polygon: footprint in W [m].
        low: height of the lowest point above the ground [m].
        high: height of the highest point above the ground [m].
        roof: height of the roof [m]; 0 for a flat roof.
    """

    name: str
    tags: Tags
    polygon: Polygon
    low: float
    high: float
    roof: float

    def replaced(self, polygon: Polygon, low: float, high: float) -> _Block:
        """Returns the solid with new footprint and heights, and a flat roof."""
        tags = {k: v for k, v in self.tags.items() if k != "roof:shape"}
        return _Block(self.name, tags, polygon, low, high, 0.0)


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
    for area in areas:
        absent = why_absent(area.tags)
        is_past = absent == "demolished" and (
            with_gone or year_of_date(area.tags.get("end_date", ""))
        )
        if absent is None or is_past:
            yield area
        else:
            faults.add(f"{absent} building, left out", area.name)


def works_at_points(features: OsmFeatures) -> Iterator[OsmArea]:
    """Yields the towers, masts, chimneys and tanks that are nodes, as circles.

    Those on buildings are left out.
    """
    outlines = STRtree(
        [
            polygon
            for area in features.areas
            if is_building(area.tags)
            for polygon in area.polygons
        ]
    )
    for name, tags, place in features.nodes:
        work = TABLES["works"].get(tags.get("man_made", ""))
        if work is None or len(outlines.query(Point(place), "within")):
            continue
        where = (name, features.faults)
        diameter = tag_value(tags, "diameter", length, _WIDEST_WORK, where)
        circle = Point(0.0, 0.0).buffer((diameter or work[1]) / 2, quad_segs=4)
        ring = np.array(circle.exterior.coords)
        metres = LocalMetres(*place).metres(np.ones(2))
        around = Polygon(np.array(place) + ring / metres)
        yield OsmArea(name, tags, [around])


def make_buildings(
    areas: Iterable[OsmArea],
    local: LocalMetres,
    year_attribute: str | None,
    faults: ImportFaults,
    once: bool = False,
    passages: Sequence[Passage] = (),
) -> Iterator[ImportedObject]:
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
    outlines, parts = _outlines_and_parts(areas, local, faults)
    if once:
        outlines, nested = _taken_once(outlines, faults)
        parts += nested
    copies: Counter[str] = Counter()
    for whole, blocks in _grouped_by_building(outlines, parts, faults):
        walls, roofs = [], []
        base = Base.RAISED
        for block in _solids_with_openings(blocks, through, faults):
            tags, where = block.tags, (block.name, faults)
            facing_deg = tag_value(
                tags, "roof:direction", heading_deg, 90.0, where, -270.0
            )
            wall, roof = extruded(
                block.polygon,
                block.low,
                block.high,
                whole.name,
                faults,
                tags.get("roof:shape", "flat"),
                block.roof,
                is_raised=block.low > 0.0,
                facing_deg=facing_deg,
                is_across=tags.get("roof:orientation") == "across",
            )
            if block.low <= 0.0:
                base = Base.GROUND
            walls.append(wall)
            roofs.append(roof)
        copies[whole.name] += 1
        copy = copies[whole.name]
        number = f"_{copy}" if copy > 1 else ""
        made = make_object(
            f"building_{whole.name}{number}",
            "building",
            "Building",
            {"body": np.concatenate(walls), "roof": np.concatenate(roofs)},
            {"roof": RED_ROOF},
            construction_year(whole.tags, year_attribute, whole.name, faults),
            demolition_year(whole.tags, whole.name, faults),
            # If parts look different, the look of the first one counts.
            tags={**blocks[0].tags, **whole.tags},
            lod=1.0,
            kind=building_kind(whole.tags),
            base=base,
        )
        yield replace(made, is_gone=True) if is_gone(whole.tags) else made


def _outlines_and_parts(
    areas: Iterable[OsmArea], local: LocalMetres, faults: ImportFaults
) -> tuple[list[_Block], list[_Block]]:
    """Returns the outlines of buildings, and the building parts, as solids."""
    outlines: list[_Block] = []
    parts: list[_Block] = []
    for name, tags, polygons in areas:
        low, high, roof = heights(tags, (name, faults))
        if is_open_below(tags) and low > 0.0:
            faults.add("roof without walls, made without its posts", name)
        blocks = parts if has_tag(tags, "building:part") else outlines
        for polygon in polygons:
            for footprint in valid_parts(local.polygon(polygon), name, faults):
                blocks.append(_Block(name, tags, footprint, low, high, roof))
    return outlines, parts


def _grouped_by_building(
    outlines: Iterable[_Block], parts: Iterable[_Block], faults: ImportFaults
) -> list[tuple[_Block, list[_Block]]]:
    """Returns each building: its outline, and the solids that it consists of.

    A part that lies in no outline, or has a date that its building does not
    have, is a building of its own; `faults` counts the latter. Parts do not
    belong to a former building that once stood in their place.
    """
    # Standing buildings come first, so they have the same numbers as in the
    # tree.
    outlines = sorted(outlines, key=lambda outline: is_gone(outline.tags))
    standing = STRtree(
        [outline.polygon for outline in outlines if not is_gone(outline.tags)]
    )
    of_outline: dict[int, list[_Block]] = {}
    alone = []
    for part in parts:
        inside = standing.query(
            part.polygon.representative_point(), predicate="within"
        )
        if len(inside):
            of_outline.setdefault(int(inside.min()), []).append(part)
        else:
            alone.append((part, [part]))
    buildings = []
    for number, outline in enumerate(outlines):
        solids = _with_parts(outline, of_outline.get(number, []), faults)
        own = [one for one in solids if _has_own_date(one, outline, faults)]
        for part in own:
            kind = "building part with a date of its own, made as a building"
            faults.add(kind, part.name)
            # What the part does not state is as for the whole.
            part = replace(part, tags={**_dates(outline.tags), **part.tags})
            alone.append((part, [part]))
        rest = [one for one in solids if one not in own]
        if rest:
            buildings.append((outline, rest))
    return [*buildings, *alone]


def _has_own_date(part: _Block, outline: _Block, faults: ImportFaults) -> bool:
    """Returns whether a part was built or demolished in another year.

    Dates of the part that are not understood are counted in `faults`, and do
    not differ.
    """
    if part.name == outline.name:
        return False
    whole = _dates(outline.tags)
    years = {
        key: understood_year(value, key, part.name, faults)
        for key, value in _dates(part.tags).items()
    }
    return any(
        year not in (None, year_of_date(whole.get(key, "")))
        for key, year in years.items()
    )


def _solids_with_openings(
    blocks: Iterable[_Block], passages: Passages, faults: ImportFaults
) -> Iterator[_Block]:
    """Yields the solids of a building, with an opening for each passage.

    Above an opening, a solid stays whole, with its roof.
    """
    for block in blocks:
        opening = passages.through(block.polygon, block.low)
        if opening is None:
            yield block
            continue
        area, clear = opening
        highest = block.high - block.roof - _LINTEL
        if highest < _LEAST_CLEAR:
            # The passage extends into the roof.
            highest = block.high - _LINTEL
        clear = min(clear, highest)
        if clear < max(_LEAST_CLEAR, block.low):
            kind = "building too low for its passage, not opened"
            faults.add(kind, block.name)
            yield block
            continue
        for piece in _without_slivers(block.polygon.difference(area)):
            yield block.replaced(piece, block.low, clear)
        roof = min(block.roof, block.high - clear - LEAST_WALL)
        yield replace(block, low=clear, roof=roof)


def _taken_once(
    outlines: Sequence[_Block], faults: ImportFaults
) -> tuple[list[_Block], list[_Block]]:
    """Returns each outline of a building once, and the outlines inside others.

    If an outline were used twice, or used as a whole building inside another
    one, two walls could stand in the same place and hide each other's windows.
    """
    tree = STRtree([outline.polygon for outline in outlines])
    whole: dict[int, _Block] = {}
    nested = []
    largest_first = sorted(
        range(len(outlines)), key=lambda k: -outlines[k].polygon.area
    )
    for number in largest_first:
        outline = outlines[number]
        around = [
            k
            for k in tree.query(outline.polygon, "intersects").tolist()
            if k in whole and _lies_in(outline, whole[k])
        ]
        twins = [k for k in around if _lies_in(whole[k], outline)]
        dates = [_dates(whole[k].tags) for k in around]
        if twins:
            faults.add(TWICE, outline.name)
            twin = whole[twins[0]]
            whole[twins[0]] = replace(twin, tags=_common_tags(twin, outline))
        elif dates and _dates(outline.tags) in ({}, *dates):
            faults.add(_NESTED, outline.name)
            nested.append(outline)
        else:
            whole[number] = outline
    return [whole[k] for k in sorted(whole)], nested


def _lies_in(outline: _Block, other: _Block) -> bool:
    """Returns whether an outline lies in another one.

    The result is False for buildings that stood at different times.
    """
    if is_gone(outline.tags) or is_gone(other.tags):
        return False
    dates, others = _dates(outline.tags), _dates(other.tags)
    # A building that was demolished may have made room for the other.
    if dates.get("end_date") != others.get("end_date"):
        return False
    starts = {
        tags["start_date"] for tags in (dates, others) if "start_date" in tags
    }
    if len(starts) > 1:
        return False
    shared = outline.polygon.intersection(other.polygon).area
    return bool(shared >= _INSIDE_SHARE * outline.polygon.area)


def _common_tags(kept: _Block, twin: _Block) -> Tags:
    """Returns the tags of a building that was drawn twice.

    The tags of the outline that is kept take precedence, except a tag that says
    no more than that there is a building.
    """
    tags = {**twin.tags, **kept.tags}
    if tags.get("building") == "yes" and "building" in twin.tags:
        tags["building"] = twin.tags["building"]
    return tags


def _dates(tags: Tags) -> dict[str, str]:
    return {key: tags[key] for key in ("start_date", "end_date") if key in tags}


def is_gone(tags: Tags) -> bool:
    """Returns whether a building was demolished, at an unknown date."""
    return (
        year_of_date(tags.get("end_date", "")) is None
        and why_absent(tags) == "demolished"
    )


def _with_parts(
    outline: _Block, parts: list[_Block], faults: ImportFaults
) -> list[_Block]:
    """Returns the solids of a building with an outline and parts.

    These are the parts, and the outline's own solid beside the parts, without
    slivers. If more than 10 % of the outline is beside the parts, the outline's
    own solid also fills the space below parts that begin above the ground.
    Otherwise the parts are meant as the whole building, and this space stays
    open. Without parts, the result is the outline's own solid.

    `faults` counts outlines that are more than 10 % beside the parts: the file
    does not state how high the rest is, because the height of an outline can be
    that of its highest part.
    """
    if not parts:
        return [outline]
    covered = shapely.union_all([part.polygon for part in parts])
    uncovered = outline.polygon.difference(covered.buffer(_SEAM))
    solids = list(parts)
    if uncovered.area > _MOST_UNCOVERED * outline.polygon.area:
        solids += _solids_below(parts, outline, uncovered)
        # A building inside another one says nothing of the rest.
        if any(has_tag(part.tags, "building:part") for part in parts):
            faults.add(
                "building with parts for some of its outline, the rest as high"
                " as the whole",
                outline.name,
            )
    solids += [
        outline.replaced(piece, outline.low, outline.high)
        for piece in _without_slivers(uncovered)
    ]
    return solids


def _solids_below(
    parts: Iterable[_Block], outline: _Block, uncovered: BaseGeometry
) -> Iterator[_Block]:
    """Yields solids that fill a building's outline below its parts.

    `uncovered` is the area of the outline beside all parts, which the outline's
    own solid fills.
    """
    filled = uncovered
    for part in sorted(parts, key=lambda part: part.low):
        # Of parts above each other, only the lowest is supported.
        open_below = part.polygon.difference(filled)
        top = min(part.low, outline.high)
        if top > outline.low and not is_open_below(part.tags):
            for piece in parts_of(open_below):
                yield outline.replaced(piece, outline.low, top)
        filled = shapely.union(filled, part.polygon)


def _without_slivers(area: BaseGeometry) -> Iterator[Polygon]:
    """Yields the polygons of an area, except those that are narrow."""
    for piece in parts_of(area):
        if not piece.buffer(-_SLIVER_RADIUS).is_empty:
            yield piece
