"""Streets of OpenStreetMap: carriageways, sidewalks and paths."""

from collections.abc import Iterable, Iterator

import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from worlds.imports import faces
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import ImportedObject
from worlds.imports.openstreetmap.area_looks import AreaLook, flat_object
from worlds.imports.openstreetmap.bridges import Bridges
from worlds.imports.openstreetmap.features import OsmFeatures, OsmWay, Tags
from worlds.imports.openstreetmap.tags import has_tag
from worlds.imports.openstreetmap.way_tags import (
    driven_directions,
    is_tunnel,
    lanes_beside,
    path_width,
    sidewalk_sides,
    street_width,
)
from worlds.imports.streets import KERB_HEIGHT, SIDEWALK_WIDTH, Street
from worlds.maps import LocalMetres

_ROAD = AreaLook("Road", "road", None, 0.0)
_NO_RAMPS = "bridge over a way, built without ramps and without drives on it"
_WALK = AreaLook("Sidewalk", "sidewalk", None, KERB_HEIGHT)


def street_surfaces(
    features: OsmFeatures, local: LocalMetres, bridges: Bridges
) -> Iterator[ImportedObject]:
    """Yields the carriageways, their sidewalks, and paths for people.

    Sidewalks and paths end at carriageways. Tunnels are left out, and counted
    as faults, as are bridges over other ways, which `decks` makes.
    """
    faults = features.faults
    _count_left_out(bridges, faults)
    roads, walks = _street_areas(features, local, bridges)
    carriageways = shapely.union_all(list(roads.values()))
    for name, area in roads.items():
        areas = faces.parts_of(area)
        yield from flat_object(f"road_{name}", _ROAD, areas, faults)
    for name, area in walks.items():
        areas = faces.parts_of(area.difference(carriageways))
        yield from flat_object(f"walk_{name}", _WALK, areas, faults)


def _street_areas(
    features: OsmFeatures, local: LocalMetres, bridges: Bridges
) -> tuple[dict[str, BaseGeometry], dict[str, BaseGeometry]]:
    """Returns the areas in W of carriageways, and of sidewalks and paths [m].

    The keys are the ids of the ways. For a sidewalk, `_l` or `_r` for its side
    follows the id. Implausible tags of streets are counted as faults.
    """
    faults = features.faults
    roads: dict[str, BaseGeometry] = {}
    walks: dict[str, BaseGeometry] = {}
    for name, tags, line, _ in features.ways:
        if _is_elsewhere(name, tags, bridges):
            continue
        width = street_width(tags, (name, faults))
        path = path_width(tags, (name, faults))
        if width is None and path is None:
            continue
        course = LineString(local(line))
        if width is not None:
            half = width / 2.0
            roads[name] = course.buffer(half, quad_segs=4)
            on_left, on_right = sidewalk_sides(tags)
            reach = half + SIDEWALK_WIDTH
            if on_left:
                walks[f"{name}_l"] = course.buffer(reach, single_sided=True)
            if on_right:
                walks[f"{name}_r"] = course.buffer(-reach, single_sided=True)
        elif path is not None:
            walks[name] = course.buffer(path / 2.0, quad_segs=4)
    return roads, walks


def _count_left_out(bridges: Bridges, faults: ImportFaults) -> None:
    """Counts the bridges over other ways, and the tunnels."""
    for kind, ids in (
        (_NO_RAMPS, bridges.over_streets),
        ("tunnel, left out", bridges.tunnels),
    ):
        for name in sorted(ids):
            faults.add(kind, name)


def _is_elsewhere(name: str, tags: Tags, bridges: Bridges) -> bool:
    """Returns whether a way is not a line on the ground."""
    is_tunnel_or_area = is_tunnel(tags) or has_tag(tags, "area")
    return is_tunnel_or_area or name in bridges.over_streets


def drivable_streets(
    ways: Iterable[OsmWay], local: LocalMetres, bridges: Bridges
) -> list[Street]:
    """Returns the streets on which cars may drive.

    Args:
        ways: ways of the file.
        local: converts places of the file to metres.
        bridges: the bridges and tunnels. Streets over other ways and in tunnels
            are left out.
    """
    streets = []
    for name, tags, line, nodes in ways:
        width = street_width(tags)
        if width is None or _is_elsewhere(name, tags, bridges):
            continue
        directions = driven_directions(tags)
        if any(directions):
            streets.append(
                Street(
                    local(line),
                    nodes,
                    *directions,
                    aside=lanes_beside(tags, width),
                    width=width,
                    name=name,
                    tags=tags,
                )
            )
    return streets
