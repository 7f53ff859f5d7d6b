"""Buildings of OpenStreetMap and their parts.

https://wiki.openstreetmap.org/wiki/Simple_3D_Buildings
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.strtree import STRtree

from cns_drake.imports.building_years import construction_year, year_of_date
from cns_drake.imports.faces import extruded, parts_of, sound_parts
from cns_drake.imports.foreign_city import RED_ROOF, Imported, make_imported
from cns_drake.imports.openstreetmap.reading import (
    Local,
    OsmArea,
    Tags,
    has_tag,
)
from cns_drake.imports.openstreetmap.tags import heights, why_absent
from cns_drake.imports.options import ImportFaults

# What the report says about buildings that are not made as the file has them.
TWICE = "building drawn twice, taken once"
_NESTED = "building inside another one, taken as its part"
# An outline lies in another one if so much of it does.
_INSIDE = 0.9
# If parts leave less of an outline than this, they are the whole building.
_ALL_OF_IT = 0.9
# Remainders of an outline narrower than this are dropped [m].
_SLIVER = 0.25


@dataclass(frozen=True)
class _Block:
    """A solid of a building: footprint, lowest and highest point, roof."""

    name: str
    tags: Tags
    polygon: Polygon
    low: float
    high: float
    roof: float

    def replaced(self, polygon: Polygon, low: float, high: float) -> _Block:
        """Returns the remainder of this block, with a flat roof."""
        plain = {k: v for k, v in self.tags.items() if k != "roof:shape"}
        return _Block(self.name, plain, polygon, low, high, 0.0)


def standing_buildings(
    areas: Iterable[OsmArea], faults: ImportFaults, with_gone: bool = False
) -> Iterator[OsmArea]:
    """Yields present and former buildings and parts above the ground.

    Demolished ones without a date are among them on demand only. Others are
    counted as faults.
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
) -> Iterator[Imported]:
    """Yields buildings; parts replace the area that they cover.

    With `once`, buildings that lie in each other are joined.
    """
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
    # Parts are not of what has stood in their place.
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
        for block in blocks:
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
            # If parts look different, the first one's look counts.
            tags={**blocks[0].tags, **whole.tags},
            lod=1.0,
        )
        yield replace(made, is_gone=True) if _is_gone(whole.tags) else made


def _taken_once(
    outlines: Sequence[_Block], faults: ImportFaults
) -> tuple[list[_Block], list[_Block]]:
    """Sorts outlines that lie in another one's.

    Walls of both would stand in the same place, each before the other's
    windows.

    Returns:
        The outlines of buildings, each once, and those that are parts.
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
    """Returns whether an outline lies in another one that may stand with it."""
    if _is_gone(one.tags) or _is_gone(other.tags):
        return False
    dates, others = _dates(one.tags), _dates(other.tags)
    # What has ended may have made room for the other one.
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

    If parts cover an outline, they are the building. Otherwise the outline's
    own solid fills the rest, and the parts are additions to it. That solid also
    stands below parts that begin above the ground.
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
