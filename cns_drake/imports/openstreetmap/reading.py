"""Reads the parts of an OpenStreetMap file that make up a city."""

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
import contextlib
from pathlib import Path
import tempfile
from typing import Any

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular
from cns_drake.city.geometry.polygons import hull_of
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.openstreetmap.element_kinds import (
    element_kind,
    is_building,
)
from cns_drake.imports.openstreetmap.features import (
    OsmArea,
    OsmFeatures,
    OsmNode,
    OsmWay,
    Tags,
)
from cns_drake.imports.openstreetmap.sorting import number_in_file, sorted_file

# An outline with less area is a point with rounding errors [deg^2]. The area is
# about 0.01 m^2.
_NO_AREA = 1e-12
_WITHOUT_AREA = "without area"
_NOT_CLOSED = "whose outline does not close"
_LETTERS = {"Node": "n", "Way": "w", "Relation": "r"}


def read_openstreetmap(path: Path) -> OsmFeatures:
    """Returns the content of an OpenStreetMap file.

    Buildings without an area are left out and counted as faults.

    Raises:
        InputError: if the file cannot be read.
    """
    import osmium

    features = OsmFeatures()
    check_regular(path)
    buildings: list[str] = []
    flat: set[str] = set()
    with (
        tempfile.TemporaryDirectory() as folder,
        _reader_errors(path),
    ):
        source = sorted_file(path, Path(folder), features.faults)
        reader = osmium.FileProcessor(str(source)).with_locations().with_areas()
        for element in reader:
            tags = {tag.k: tag.v for tag in element.tags}
            if isinstance(element, osmium.osm.Area):
                area = _area_of(element, tags)
                if not area.polygons:
                    continue
                if is_building(tags) and _has_no_area(area.polygons):
                    flat.add(area.name)
                else:
                    features.areas.append(area)
                continue
            letter = _LETTERS[type(element).__name__]
            name = f"{letter}{number_in_file(element.id)}"
            if tags:
                features.kinds[name] = element_kind(tags)
            if isinstance(element, osmium.osm.Way) and tags:
                if is_building(tags):
                    buildings.append(name)
                way = _way_of(element, name, tags, features.faults)
                if way is not None:
                    features.ways.append(way)
            elif isinstance(element, osmium.osm.Relation):
                if tags.get("type") == "multipolygon" and is_building(tags):
                    buildings.append(name)
                    features.outers |= {
                        f"w{number_in_file(member.ref)}": name
                        for member in element.members
                        if member.type == "w" and member.role != "inner"
                    }
            elif (
                isinstance(element, osmium.osm.Node)
                and element.location.valid()
            ):
                _add_node(element, name, tags, features)
    _count_without_area(buildings, flat, features)
    return features


def _count_without_area(
    buildings: Iterable[str], flat: AbstractSet[str], features: OsmFeatures
) -> None:
    """Counts the buildings of a file that are none of the features' areas.

    `buildings` contains the ids of all buildings, and `flat` the ids of those
    whose outline closes, but has no area.
    """
    areas = {area.name for area in features.areas}
    ways = {way.name: way for way in features.ways}
    for name in buildings:
        if name not in areas:
            fault = (
                _WITHOUT_AREA if name in flat else _why_no_area(ways.get(name))
            )
            features.faults.add(f"building {fault}, left out", name)


def _area_of(area: Any, tags: Tags) -> OsmArea:
    """Returns an area of osmium, named after its way or relation."""
    letter = "w" if area.from_way() else "r"
    name = f"{letter}{number_in_file(area.orig_id())}"
    return OsmArea(name, tags, _polygons_of(area))


def _way_of(
    way: Any, name: str, tags: Tags, faults: ImportFaults
) -> OsmWay | None:
    """Returns a way of osmium; None unless two or more nodes have places.

    Nodes without a place are left out, and counted unless the way is a
    building.
    """
    nodes = [node for node in way.nodes if node.location.valid()]
    missing = len(way.nodes) - len(nodes)
    if missing and not is_building(tags):
        gap = "place of a way that is not in the file, left out"
        faults.add(gap, name, missing)
    if len(nodes) < 2:
        return None
    line = np.array([(node.lon, node.lat) for node in nodes])
    return OsmWay(name, tags, line, tuple(node.ref for node in nodes))


def _add_node(node: Any, name: str, tags: Tags, features: OsmFeatures) -> None:
    """Adds a node of osmium to the features, if it has tags."""
    is_tree = tags.get("natural") == "tree"
    if not is_tree and tags.get("highway") == "crossing":
        features.crossings.append((node.id, tags))
    elif tags:
        nodes = features.trees if is_tree else features.nodes
        nodes.append(OsmNode(name, tags, (node.lon, node.lat)))


def _why_no_area(way: OsmWay | None) -> str:
    """Returns why osmium makes no area of a building, in words.

    `way` is the way of the building; None if the building is a relation.
    """
    if way is None:
        return f"{_NOT_CLOSED} or crosses itself"
    if way.nodes[0] != way.nodes[-1]:
        return _NOT_CLOSED
    if _has_no_area([hull_of(way.line)]):
        return _WITHOUT_AREA
    is_simple = LineString(way.line).is_simple
    return _NOT_CLOSED if is_simple else "whose outline crosses itself"


@contextlib.contextmanager
def _reader_errors(path: Path) -> Iterator[None]:
    """Raises errors of osmium as an InputError that names the file."""
    import osmium

    try:
        yield
    except (
        RuntimeError,
        ValueError,
        OverflowError,
        OSError,
        osmium.InvalidLocationError,
    ) as error:
        first = str(error).splitlines()[0] if str(error) else "unreadable"
        raise InputError(f"{path}: {first}") from error


def _polygons_of(area: Any) -> list[Polygon]:
    """Returns the polygons of an osmium area [deg]."""
    polygons = []
    for outer in area.outer_rings():
        holes = [
            [(n.lon, n.lat) for n in inner] for inner in area.inner_rings(outer)
        ]
        polygons.append(Polygon([(n.lon, n.lat) for n in outer], holes))
    return polygons


def _has_no_area(outlines: Iterable[BaseGeometry]) -> bool:
    return sum(outline.area for outline in outlines) < _NO_AREA
