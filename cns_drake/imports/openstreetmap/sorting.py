"""Brings a file of OpenStreetMap into the order in which it can be read.

The reader wants nodes before ways before relations, each once, by ascending
positive numbers. Overpass writes nodes last, or the places of ways in these,
editors give negative numbers to new things and mark deleted ones, and files
with a history have each version of a thing.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

from cns_drake.imports.options import ImportFaults

# A negative number of a file becomes this less that number.
_FIRST_NEW = 10**12
_KINDS = ("Node", "Way", "Relation")
_CHUNK = 1 << 24


def number_in_file(number: int) -> int:
    """Returns the number of a thing in the file that was sorted."""
    return _FIRST_NEW - number if number > _FIRST_NEW else number


class _Thing(NamedTuple):
    """One version of a thing; nodes have a place, others what they refer to."""

    version: int
    is_there: bool
    tags: Mapping[str, str]
    content: Any


def sorted_file(path: Path, folder: Path, faults: ImportFaults) -> Path:
    """Returns a file that can be read: the given one, or one in a folder.

    Things that are left out are counted.

    Raises:
        RuntimeError, ValueError: it is no such file.
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
    """Returns whether things have an order, and ways only numbers of nodes."""
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
    """Returns the things that an editor marks as deleted, in XML alone.

    A remark of Overpass, such as that its time was over, is counted.
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
            # The reader says what is wrong.
            return set()
    if remark:
        words = " ".join("".join(remark).split())
        faults.add(f"the file may be cut off: {words}", "its remark")
    return found


def _holds(path: Path, *words: bytes) -> bool:
    """Returns whether a file holds one of the words, each of at most 8."""
    rest = b""
    with path.open("rb") as stream:
        while chunk := stream.read(_CHUNK):
            if any(word in rest + chunk for word in words):
                return True
            rest = chunk[-8:]
    return False
