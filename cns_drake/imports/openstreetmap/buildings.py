"""Buildings of OpenStreetMap, made from outlines and building parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.strtree import STRtree

from cns_drake.imports.building_years import construction_year, year_of_date
from cns_drake.imports.colours import RED_ROOF
from cns_drake.imports.faces import parts_of, valid_parts
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.openstreetmap.building_tags import (
    building_kind,
    heights,
    why_absent,
)
from cns_drake.imports.openstreetmap.features import OsmArea, Tags
from cns_drake.imports.openstreetmap.local_metres import LocalMetres
from cns_drake.imports.openstreetmap.passages import Passage, Passages
from cns_drake.imports.openstreetmap.tags import has_tag
from cns_drake.imports.solids import extruded
from cns_drake.imports.structures import ImportedStructure, make_imported

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
        """Returns the solid with new footprint and heights, and a flat roof."""
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
    local: LocalMetres,
    year_attribute: str | None,
    faults: ImportFaults,
    once: bool = False,
    passages: Sequence[Passage] = (),
) -> Iterator[ImportedStructure]:
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
    for whole, blocks in _grouped_by_building(outlines, parts):
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
        copies[whole.name] += 1
        copy = copies[whole.name]
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
        yield replace(made, is_gone=True) if is_gone(whole.tags) else made


def _outlines_and_parts(
    areas: Iterable[OsmArea], local: LocalMetres, faults: ImportFaults
) -> tuple[list[_Block], list[_Block]]:
    """Returns the outlines of buildings, and the building parts, as solids."""
    outlines: list[_Block] = []
    parts: list[_Block] = []
    for name, tags, polygons in areas:
        low, high, roof = heights(tags, (name, faults))
        group = parts if has_tag(tags, "building:part") else outlines
        for polygon in polygons:
            for one in valid_parts(local.polygon(polygon), name, faults):
                group.append(_Block(name, tags, one, low, high, roof))
    return outlines, parts


def _grouped_by_building(
    outlines: Iterable[_Block], parts: Iterable[_Block]
) -> list[tuple[_Block, list[_Block]]]:
    """Returns each building: its outline, and the solids that it consists of.

    A part that lies in no outline is a building of its own. Parts do not belong
    to a former building that once stood in their place.
    """
    outlines = sorted(outlines, key=lambda one: is_gone(one.tags))
    standing = STRtree(
        [one.polygon for one in outlines if not is_gone(one.tags)]
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
    return [
        *(
            (one, _with_parts(one, of_outline.get(k, [])))
            for k, one in enumerate(outlines)
        ),
        *alone,
    ]


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
    """Returns each outline of a building once, and the outlines inside others.

    If an outline were used twice, or used as a whole building inside another
    one, two walls could stand in the same place and hide each other's windows.
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
    """Returns whether an outline lies in another one.

    The result is False for buildings that stood at different times.
    """
    if is_gone(one.tags) or is_gone(other.tags):
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


def is_gone(tags: Tags) -> bool:
    """Returns whether a building was demolished, at an unknown date."""
    return (
        year_of_date(tags.get("end_date", "")) is None
        and why_absent(tags) == "demolished"
    )


def _with_parts(outline: _Block, parts: list[_Block]) -> list[_Block]:
    """Returns the blocks of a building.

    If the parts cover the outline, the building consists of the parts only.
    Otherwise the outline's own solid is added. It fills the rest of the
    outline, and the space below parts that begin above the ground.
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
