"""Reads the parts of an OpenStreetMap file that make up a city.

The reader needs first the nodes, then the ways, then the relations, each by
ascending positive id and only in its newest version. Files in another order,
such as files of Overpass and of editors, are sorted first.
"""

from collections.abc import Iterable, Iterator, Mapping
import contextlib
from dataclasses import dataclass, field
import math
from pathlib import Path
import tempfile
from typing import Any, NamedTuple
from xml.parsers import expat

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular
from cns_drake.city.geometry.polygons import hull_of
from cns_drake.imports.openstreetmap.tags import TABLES, has_tag
from cns_drake.imports.options import ImportFaults

# A negative id of a file becomes this number minus the id.
_FIRST_NEW = 10**12
_KINDS = ("Node", "Way", "Relation")
_CHUNK = 1 << 24


def number_in_file(number: int) -> int:
    """Returns the id that an object has in the user's file.

    Editors give negative ids to new objects. The sorted copy of the file has
    positive ids instead. `number` is the id in the sorted copy.
    """
    return _FIRST_NEW - number if number > _FIRST_NEW else number


class _Thing(NamedTuple):
    """One version of an object.

    Its content is its place for a node, and otherwise the ids to which it
    refers.
    """

    version: int
    is_there: bool
    tags: Mapping[str, str]
    content: Any


def sorted_file(path: Path, folder: Path, faults: ImportFaults) -> Path:
    """Returns a file in the order that the reader needs.

    The result is `path`, or a sorted copy in `folder` if `path` is in another
    order. Objects that are left out of the copy are counted in `faults`.

    Raises:
        RuntimeError, ValueError: the file is not an OpenStreetMap file.
    """
    import osmium

    deleted = _marked_as_deleted(path, faults)
    if not deleted and _is_sorted(path):
        return path
    things: dict[tuple[int, int], _Thing] = {}
    places: dict[int, tuple[float, float]] = {}
    for one in _read(path):
        kind = _KINDS.index(type(one).__name__)
        key = kind, one.id
        name = f"{_KINDS[kind][0].lower()}{one.id}"
        is_there = one.visible and key not in deleted
        made = _Thing(one.version, is_there, dict(one.tags), _content(one))
        if kind == 1:
            places |= {
                n.ref: (n.lon, n.lat) for n in one.nodes if n.location.valid()
            }
        known = things.get(key)
        if known is not None:
            faults.add("thing that is there twice, taken once", name)
            if (known.version, len(known.tags)) >= (
                one.version,
                len(made.tags),
            ):
                continue
        things[key] = made
    for number, place in places.items():
        things.setdefault((0, number), _Thing(0, True, {}, place))
    target = folder / "sorted.osm.pbf"
    with osmium.SimpleWriter(str(target)) as writer:
        for kind, number in sorted(things, key=lambda k: (k[0], _new(k[1]))):
            thing = things[kind, number]
            if not thing.is_there:
                name = f"{_KINDS[kind][0].lower()}{number}"
                faults.add("deleted thing, left out", name)
                continue
            common: dict[str, Any] = {
                "id": _new(number),
                "tags": dict(thing.tags),
                "version": 1,
            }
            if kind == 0:
                writer.add_node(
                    osmium.osm.mutable.Node(location=thing.content, **common)
                )
            elif kind == 1:
                refs = [_new(ref) for ref in thing.content]
                writer.add_way(osmium.osm.mutable.Way(nodes=refs, **common))
            else:
                members = [(t, _new(ref), r) for t, ref, r in thing.content]
                writer.add_relation(
                    osmium.osm.mutable.Relation(members=members, **common)
                )
    return target


def _read(path: Path) -> Iterator[Any]:
    import osmium

    yield from osmium.FileProcessor(str(path))


def _new(number: int) -> int:
    return number if number > 0 else _FIRST_NEW - number


def _content(one: Any) -> Any:
    kind = type(one).__name__
    if kind == "Node":
        return (one.lon, one.lat) if one.location.valid() else None
    if kind == "Way":
        return [n.ref for n in one.nodes]
    return [(m.type, m.ref, m.role) for m in one.members]


def _is_sorted(path: Path) -> bool:
    """Returns whether objects are in order, and ways have only node ids."""
    last = 0, 0
    for one in _read(path):
        key = _KINDS.index(type(one).__name__), one.id
        if key <= last or one.id <= 0 or not one.visible:
            return False
        if key[0] == 1 and any(n.location.valid() for n in one.nodes):
            return False
        last = key
    return True


def _marked_as_deleted(
    path: Path, faults: ImportFaults
) -> set[tuple[int, int]]:
    """Returns the objects that an editor has marked as deleted (XML only).

    A remark by Overpass, such as that it ran out of time, is counted as a
    fault.
    """
    found: set[tuple[int, int]] = set()
    remark: list[str] = []
    is_open = False

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal is_open
        is_open = tag == "remark"
        kind = tag.capitalize()
        if kind in _KINDS and attributes.get("action") == "delete":
            found.add((_KINDS.index(kind), int(attributes.get("id", "0"))))

    def end(tag: str) -> None:
        nonlocal is_open
        is_open = False

    def text(data: str) -> None:
        if is_open:
            remark.append(data)

    if path.suffix == ".osm" and _holds(path, b"action=", b"<remark"):
        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = start, end
        parser.CharacterDataHandler = text
        try:
            with path.open("rb") as stream:
                parser.ParseFile(stream)
        except expat.ExpatError:
            # Reading the file reports what is wrong.
            return set()
    if remark:
        words = " ".join("".join(remark).split())
        faults.add(f"the file may be cut off: {words}", "its remark")
    return found


def _holds(path: Path, *words: bytes) -> bool:
    """Returns whether a file contains any of some words of at most 8 bytes."""
    rest = b""
    with path.open("rb") as stream:
        while chunk := stream.read(_CHUNK):
            if any(word in rest + chunk for word in words):
                return True
            rest = chunk[-8:]
    return False


Tags = Mapping[str, str]

# Semi-axes of the Earth, WGS 84 [m].
_SEMI_MAJOR = 6378137.0
_FLATTENING = 1.0 / 298.257223563
# Smaller areas are points with rounding errors; it is about 0.01 m^2 [deg^2].
_NO_AREA = 1e-12
_FLAT = "without area"
_OPEN = "whose outline does not close"
_LETTERS = {"Node": "n", "Way": "w", "Relation": "r"}
_KIND_KEYS = tuple(TABLES["kinds"].split())
_GONE = tuple(TABLES["gone"].split())
_LIFECYCLE = tuple(TABLES["lifecycle"].split())


class Local:
    """Converts degrees to metres east and north of an origin.

    The constructor takes the longitude and latitude of the origin [deg]. An
    object is called with longitudes and latitudes (N, 2) [deg], and returns x
    and y (N, 2) [m]. The conversion uses the Earth's radii of curvature at the
    origin. A place d metres north and d metres east of the origin is off by
    about 1.1 d^2 tan(latitude) / R, where R is the Earth's radius: at a
    latitude of 52 deg by 0.5 m if d is 1.5 km, and by 22 m if d is 10 km. At
    that latitude, lengths 10 km north of the origin are wrong by 20 in 10,000.
    """

    def __init__(self, longitude: float, latitude: float):
        e2 = _FLATTENING * (2.0 - _FLATTENING)
        s = math.sin(math.radians(latitude))
        w2 = 1.0 - e2 * s * s
        north = _SEMI_MAJOR * (1.0 - e2) / w2**1.5
        east = _SEMI_MAJOR / math.sqrt(w2) * math.cos(math.radians(latitude))
        self._origin = np.array([longitude, latitude])
        self._metres = np.radians(1.0) * np.array([east, north])

    def __call__(self, places: np.ndarray) -> np.ndarray:
        offset = places - self._origin
        # The shorter way around the Earth, also across the 180th meridian.
        offset[..., 0] -= 360.0 * np.rint(offset[..., 0] / 360.0)
        return self.metres(offset)

    def metres(self, offset: np.ndarray) -> np.ndarray:
        """Converts differences of longitude and latitude to metres.

        `offset` (..., 2) contains the differences in longitude and latitude
        [deg]. The result (..., 2) contains the distances east and north [m].
        """
        return np.asarray(offset * self._metres)

    def polygon(self, polygon: Polygon) -> Polygon:
        return shapely.transform(polygon, self)


# A node: its id, tags and place [deg].
OsmNode = tuple[str, Tags, tuple[float, float]]


class OsmWay(NamedTuple):
    """A way of an OpenStreetMap file, such as a street.

    Attributes:
        name: id of the way, such as `w123`.
        tags: tags of the way.
        line: (N, 2) longitude and latitude of the way's nodes [deg].
        nodes: ids of the way's nodes.
    """

    name: str
    tags: Tags
    line: np.ndarray
    nodes: tuple[int, ...]


class OsmArea(NamedTuple):
    """An area of an OpenStreetMap file, such as a building.

    Attributes:
        name: id of the area, such as `w123` or `r123`.
        tags: tags of the area.
        polygons: polygons of the area, in longitude and latitude [deg].
    """

    name: str
    tags: Tags
    polygons: list[Polygon]


@dataclass
class OsmFeatures:
    """The content of an OpenStreetMap file.

    Places are longitude and latitude [deg]. An id is a number with the prefix
    `n` for a node, `w` for a way and `r` for a relation.

    Attributes:
        areas: closed ways and multipolygons.
        ways: ways; places that are not in the file are left out.
        trees: nodes that are trees.
        crossings: number and tags of each node that is a crossing.
        nodes: all other nodes with tags.
        outers: id of a way that is the outline of a building's multipolygon ->
            id of this multipolygon.
        kinds: id -> kind, for all objects with tags.
        faults: counts of faulty parts.
    """

    areas: list[OsmArea] = field(default_factory=list)
    ways: list[OsmWay] = field(default_factory=list)
    trees: list[OsmNode] = field(default_factory=list)
    crossings: list[tuple[int, Tags]] = field(default_factory=list)
    nodes: list[OsmNode] = field(default_factory=list)
    outers: dict[str, str] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)
    faults: ImportFaults = field(default_factory=ImportFaults)


def read_openstreetmap(path: Path) -> OsmFeatures:
    """Reads an OpenStreetMap file.

    Raises:
        InputError: if it cannot be read.
    """
    import osmium

    features = OsmFeatures()
    check_regular(path)
    wanted: dict[str, None] = {}
    flat: set[str] = set()
    with (
        tempfile.TemporaryDirectory() as folder,
        _reader_errors(path),
    ):
        source = sorted_file(path, Path(folder), features.faults)
        reader = osmium.FileProcessor(str(source)).with_locations().with_areas()
        for one in reader:
            tags = {tag.k: tag.v for tag in one.tags}
            own = number_in_file(one.id)
            if tags and not isinstance(one, osmium.osm.Area):
                letter = _LETTERS[type(one).__name__]
                features.kinds[f"{letter}{own}"] = thing_kind(tags)
            if isinstance(one, osmium.osm.Area):
                own = number_in_file(one.orig_id())
                polygons = _polygons(one)
                name = f"{'w' if one.from_way() else 'r'}{own}"
                if polygons and is_building(tags) and _is_flat(polygons):
                    flat.add(name)
                elif polygons:
                    features.areas.append(OsmArea(name, tags, polygons))
            elif isinstance(one, osmium.osm.Way) and tags:
                name = f"w{own}"
                if is_building(tags):
                    wanted[name] = None
                nodes = [n for n in one.nodes if n.location.valid()]
                missing = len(one.nodes) - len(nodes)
                if missing and name not in wanted:
                    gap = "place of a way that is not in the file, left out"
                    features.faults.add(gap, name, missing)
                if len(nodes) > 1:
                    line = np.array([(n.lon, n.lat) for n in nodes])
                    numbers = tuple(n.ref for n in nodes)
                    features.ways.append(OsmWay(name, tags, line, numbers))
            elif isinstance(one, osmium.osm.Relation):
                if tags.get("type") == "multipolygon" and is_building(tags):
                    wanted[f"r{own}"] = None
                    features.outers |= {
                        f"w{number_in_file(member.ref)}": f"r{own}"
                        for member in one.members
                        if member.type == "w" and member.role != "inner"
                    }
            elif isinstance(one, osmium.osm.Node) and one.location.valid():
                is_tree = tags.get("natural") == "tree"
                if not is_tree and tags.get("highway") == "crossing":
                    features.crossings.append((one.id, tags))
                elif tags:
                    node = (
                        f"n{own}",
                        tags,
                        (one.lon, one.lat),
                    )
                    (features.trees if is_tree else features.nodes).append(node)
    closed = {name for name, _, _ in features.areas}
    shapeless = [name for name in wanted if name not in closed]
    ways = {way.name: way for way in features.ways}
    for name in shapeless:
        fault = _FLAT if name in flat else _why_no_area(ways.get(name))
        features.faults.add(f"building {fault}, left out", name)
    return features


def _why_no_area(way: OsmWay | None) -> str:
    """Returns why the reader makes no area of a way; None is a relation."""
    if way is None:
        return f"{_OPEN} or crosses itself"
    if way.nodes[0] != way.nodes[-1]:
        return _OPEN
    if _is_flat([hull_of(way.line)]):
        return _FLAT
    is_simple = LineString(way.line).is_simple
    return _OPEN if is_simple else "whose outline crosses itself"


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


def _polygons(area: Any) -> list[Polygon]:
    found = []
    for outer in area.outer_rings():
        holes = [
            [(n.lon, n.lat) for n in inner] for inner in area.inner_rings(outer)
        ]
        found.append(Polygon([(n.lon, n.lat) for n in outer], holes))
    return found


def _is_flat(outlines: Iterable[BaseGeometry]) -> bool:
    return sum(outline.area for outline in outlines) < _NO_AREA


def thing_kind(tags: Tags) -> str:
    """Returns the kind of an element in words, from the first known tag.

    For example, it is `highway=residential`, or `other` without a known tag.
    """
    for key in _KIND_KEYS:
        if has_tag(tags, key):
            return f"{key}={tags[key]}"
    if any(key.startswith("addr:") for key in tags):
        return "address"
    for key in tags:
        stage, _, rest = key.partition(":")
        if stage in _LIFECYCLE and rest:
            return f"{stage}:{rest}"
    return f"relation of type {tags['type']}" if "type" in tags else "other"


def is_building(tags: Tags) -> bool:
    """Returns whether tags describe a building or a part of a building.

    A former building counts as well, if its tags state the date of its
    demolition.
    """
    return (
        has_tag(tags, "building")
        or has_tag(tags, "building:part")
        or ("end_date" in tags and was_building(tags))
    )


def was_building(tags: Tags) -> bool:
    """Returns whether tags mark a building that no longer exists."""
    return any(has_tag(tags, f"{stage}:building") for stage in _GONE)
