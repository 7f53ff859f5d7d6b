"""Reads the parts of an OpenStreetMap file that make up a city."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
import contextlib
from pathlib import Path
import tempfile
from typing import Any, NamedTuple
from xml.parsers import expat

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import InputError, check_regular
from worlds.imports.faces import is_tangled
from worlds.imports.faults import WHOLE_FILE, ImportFaults
from worlds.imports.openstreetmap.element_kinds import element_kind, is_building
from worlds.imports.openstreetmap.features import (
    OsmArea,
    OsmFeatures,
    OsmNode,
    OsmWay,
    Tags,
)
from worlds.shapes import hull_of

# An outline with less area is a point with rounding errors [deg^2]. The area is
# about 0.01 m^2.
_NO_AREA = 1e-12
_WITHOUT_AREA = "without area"
_NOT_CLOSED = "whose outline does not close"
# Ways of fewer nodes cost little, however often they cross themselves.
_MANY_NODES = 64
# Distance of pieces of a way that lie in each other, 0.3 to 0.6 m [deg].
_NEAR = 5e-6
# A coordinate that osmium does not know.
_NOT_IN_FILE = 2**31 - 1
_LETTERS = {"Node": "n", "Way": "w", "Relation": "r"}
# A negative id of a file becomes this number minus the id.
_FIRST_NEW = 10**12
_KINDS = ("Node", "Way", "Relation")
# Indices of kinds.
_NODE = 0
_WAY = 1
# An object: the index of its kind, and its id.
_Key = tuple[int, int]
# Number of bytes of a file that are searched at a time.
_CHUNK_SIZE = 1 << 24
# Greatest length of a word that is searched in a file [bytes].
_LONGEST_WORD = 8


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
        source = _sorted_file(path, Path(folder), features.faults)
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
            name = f"{letter}{_number_in_file(element.id)}"
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
                        f"w{_number_in_file(member.ref)}": name
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
            kind = f"building {fault}, left out"
            features.faults.add(kind, name, ruins=True)


def _area_of(area: Any, tags: Tags) -> OsmArea:
    """Returns an area of osmium, named after its way or relation."""
    letter = "w" if area.from_way() else "r"
    name = f"{letter}{_number_in_file(area.orig_id())}"
    return OsmArea(name, tags, _polygons_of(area))


def _way_of(
    way: Any, name: str, tags: Tags, faults: ImportFaults
) -> OsmWay | None:
    """Returns a way of osmium; None unless two or more nodes have places.

    Nodes without a place are left out, and counted unless the way is a
    building.
    """
    nodes = [node for node in way.nodes if node.location.valid()]
    if not is_building(tags):
        others = Counter(
            node.location.x == _NOT_IN_FILE
            for node in way.nodes
            if not node.location.valid()
        )
        for is_absent, number in others.items():
            gap = "that is not in the file" if is_absent else "off the globe"
            kind = f"place of a way {gap}, left out"
            faults.add(kind, name, number, ruins=len(nodes) < 2)
    if len(nodes) < 2:
        return None
    line = np.array([(node.lon, node.lat) for node in nodes])
    if len(line) > _MANY_NODES and (
        is_tangled(line) or is_tangled(line, reach=_NEAR)
    ):
        faults.add("way with a tangle of nodes, left out", name, ruins=True)
        return None
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


def _number_in_file(number: int) -> int:
    """Returns the id that an object has in the user's file.

    Editors give negative ids to new objects. The sorted copy of the file has
    positive ids instead. `number` is the id in the sorted copy.
    """
    return _FIRST_NEW - number if number > _FIRST_NEW else number


class _Version(NamedTuple):
    """One version of an object.

    Attributes:
        is_there: whether the object exists in this version.
        tags: tags of the object.
        content: longitude and latitude of a node [deg], ids of the nodes of a
            way, or type, id and role of the members of a relation.
    """

    version: int
    is_there: bool
    tags: Mapping[str, str]
    content: Any


def _sorted_file(path: Path, folder: Path, faults: ImportFaults) -> Path:
    """Returns a file in the order that the reader needs.

    It needs first the nodes, then the ways, then the relations, each by
    ascending positive id and only in its newest version. Files of Overpass and
    of editors have another order.

    The result is `path`, or a sorted copy in `folder` if `path` is in another
    order. Objects that are left out of the copy are counted in `faults`.

    Raises:
        RuntimeError, ValueError: the file is not an OpenStreetMap file.
    """
    import osmium  # Here and below only where used: the import takes long.

    deleted = _marked_as_deleted(path)
    _report_remark(path, faults)
    if not deleted and _is_sorted(path):
        return path
    versions = _newest_versions(path, deleted, faults)
    target = folder / "sorted.osm.pbf"
    with osmium.SimpleWriter(str(target)) as writer:
        for key in sorted(versions, key=lambda k: (k[0], _positive_id(k[1]))):
            if versions[key].is_there:
                _write_object(writer, key, versions[key])
            else:
                faults.add("deleted thing, left out", _name_of(key))
    return target


def _newest_versions(
    path: Path, deleted: AbstractSet[_Key], faults: ImportFaults
) -> dict[_Key, _Version]:
    """Returns the newest version of each object of a file.

    Nodes that the file has only as places of its ways are included. Objects in
    `deleted` are marked as not there, and objects that the file has twice are
    counted in `faults`.
    """
    versions: dict[_Key, _Version] = {}
    places: dict[int, tuple[float, float]] = {}
    for element in _objects_in(path):
        key = _key_of(element)
        is_there = element.visible and key not in deleted
        version = _Version(
            element.version, is_there, dict(element.tags), _content(element)
        )
        if key[0] == _WAY:
            places |= {
                node.ref: (node.lon, node.lat)
                for node in element.nodes
                if node.location.valid()
            }
        known = versions.get(key)
        if known is not None:
            faults.add("thing that is there twice, taken once", _name_of(key))
            if _newness(known) >= _newness(version):
                continue
        versions[key] = version
    for number, place in places.items():
        versions.setdefault((_NODE, number), _Version(0, True, {}, place))
    return versions


def _newness(version: _Version) -> tuple[int, int]:
    """Returns a pair that is greater for the newer of two versions.

    Of copies of one version, the copy with more tags counts as newer.
    """
    return version.version, len(version.tags)


def _write_object(writer: Any, key: _Key, version: _Version) -> None:
    """Writes an object with a positive id, and positive ids in its content."""
    from osmium.osm import mutable

    kind, number = key
    common: dict[str, Any] = {
        "id": _positive_id(number),
        "tags": dict(version.tags),
        "version": 1,
    }
    if kind == _NODE:
        writer.add_node(mutable.Node(location=version.content, **common))
    elif kind == _WAY:
        refs = [_positive_id(ref) for ref in version.content]
        writer.add_way(mutable.Way(nodes=refs, **common))
    else:
        members = [(t, _positive_id(ref), r) for t, ref, r in version.content]
        writer.add_relation(mutable.Relation(members=members, **common))


def _key_of(element: Any) -> _Key:
    return _KINDS.index(type(element).__name__), element.id


def _name_of(key: _Key) -> str:
    """Returns the name of an object, such as `w123`."""
    return f"{_KINDS[key[0]][0].lower()}{key[1]}"


def _objects_in(path: Path) -> Iterator[Any]:
    import osmium

    yield from osmium.FileProcessor(str(path))


def _positive_id(number: int) -> int:
    return number if number > 0 else _FIRST_NEW - number


def _content(element: Any) -> Any:
    """Returns the content of an object of osmium, as in `_Version`."""
    kind = type(element).__name__
    if kind == "Node":
        is_placed = element.location.valid()
        return (element.lon, element.lat) if is_placed else None
    if kind == "Way":
        return [node.ref for node in element.nodes]
    return [(m.type, m.ref, m.role) for m in element.members]


def _is_sorted(path: Path) -> bool:
    """Returns whether the reader can take a file as it is.

    The objects must be in order, exist, and have positive ids. The places of
    nodes must be in the nodes only, and not in the ways.
    """
    last = 0, 0
    for element in _objects_in(path):
        key = _key_of(element)
        if key <= last or element.id <= 0 or not element.visible:
            return False
        if key[0] == _WAY and any(
            node.location.valid() for node in element.nodes
        ):
            return False
        last = key
    return True


def _marked_as_deleted(path: Path) -> set[_Key]:
    """Returns the objects that an editor has marked as deleted (XML only)."""
    deleted: set[_Key] = set()

    def start(tag: str, attributes: dict[str, str]) -> None:
        kind = tag.capitalize()
        if kind in _KINDS and attributes.get("action") == "delete":
            deleted.add((_KINDS.index(kind), int(attributes.get("id", "0"))))

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    return deleted if _is_parsed(path, parser, b"action=") else set()


def _report_remark(path: Path, faults: ImportFaults) -> None:
    """Counts a remark by Overpass, such as that it ran out of time, as a fault.

    Only files of Overpass in XML have remarks.
    """
    remark: list[str] = []
    is_open = False

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal is_open
        is_open = tag == "remark"

    def end(tag: str) -> None:
        nonlocal is_open
        is_open = False

    def text(data: str) -> None:
        if is_open:
            remark.append(data)

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = text
    if _is_parsed(path, parser, b"<remark") and remark:
        words = " ".join("".join(remark).split())
        faults.add(f"the file may be cut off: {words}", WHOLE_FILE)


def _is_parsed(path: Path, parser: expat.XMLParserType, word: bytes) -> bool:
    """Parses an XML file that contains a word; returns whether this worked.

    Other files are not parsed, because parsing takes far longer than the search
    for the word. In a file with a fault, the handlers of `parser` may have been
    called for a part of the file.
    """
    if path.suffix != ".osm" or not _has_word(path, word):
        return False
    try:
        with path.open("rb") as stream:
            parser.ParseFile(stream)
    except expat.ExpatError:
        # Reading the file reports what is wrong.
        return False
    return True


def _has_word(path: Path, word: bytes) -> bool:
    """Returns whether a file contains a word, at most `_LONGEST_WORD` bytes."""
    rest = b""
    with path.open("rb") as stream:
        while chunk := stream.read(_CHUNK_SIZE):
            if word in rest + chunk:
                return True
            rest = chunk[-_LONGEST_WORD:]
    return False
