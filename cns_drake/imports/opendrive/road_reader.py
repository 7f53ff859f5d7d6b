"""Reads roads from an OpenDRIVE file.

The import joins lanes whose ends meet, and does not use the links between
roads, lanes and junctions. The import only reports, as faults, links to things
that are not in the file.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import replace
from itertools import pairwise
import math
from pathlib import Path
import re

import numpy as np

from cns_drake.base.errors import InputError, value_errors
from cns_drake.base.xml_elements import Element, read_elements
from cns_drake.base.yaml_files import parse_yaml
from cns_drake.imports.opendrive import curves, road_model
from cns_drake.imports.opendrive.things import read_things
from cns_drake.imports.options import ImportFaults

# Width of a painted line without a plausible width [m].
_MARK_WIDTH = 0.12
# Greatest plausible width of a painted line [m].
_WIDEST_MARK = 1.0
# Least distance between the starts of two dashes [m].
_CLOSEST_DASHES = 0.1
_ENDS = ("predecessor", "successor")
_UNITS = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704}
# Greatest speed limit [m/s].
_FASTEST = 100.0
# Larger networks, such as whole countries, are refused [m].
_LARGEST = 20_000.0
_LONGEST_ROAD = 100_000.0
_LONGEST_TOGETHER = 2_000_000.0
# Roads farther from the origin than this are moved to it [m].
_FAR = 10_000.0
# Lengths that differ by less than this are equal [m].
_ROUNDING = 0.01
# Pieces of a road's course that are farther apart are counted [m].
_WIDEST_JOINT = 0.1
# Greatest width of a lane [m].
_WIDEST = 100.0
# Greatest curvature of a curve [1/m].
_SHARPEST = 100.0
# Shorter pieces are left out [m].
_SHORTEST = 1e-5
# Greatest height of a kerb [m].
_HIGHEST_LANE = 1.0
# Greatest roll of a road; banked test tracks have up to 49 deg [rad].
_MOST_BANKED = math.radians(50.0)
# Names are cut to this length where they become part of other names.
_LONGEST_NAME = 60


def read_marks(
    lane: Element, start: float, road: str, faults: ImportFaults
) -> list[road_model.RoadMark]:
    """Returns the marks of a lane, in their order along the road.

    Marks whose lines cannot be used get the usual lines of their type, and are
    counted in `faults`.

    Args:
        lane: the lane in the file.
        start: distance along the road at which the lane's section begins [m].
        road: name of the road.
        faults: counts the marks that were changed.

    Raises:
        ValueError: a text is not a number; the error names its line.
    """
    marks = []
    for one in lane.all("roadMark"):
        stated = one.number("width", 0.0)
        width = stated if 0.0 < stated <= _WIDEST_MARK else _MARK_WIDTH
        if one.value("weight", "standard") == "bold" and not stated:
            width *= 2.0
        lines = _mark_lines(one, width)
        if lines is None:
            faults.add("road mark with impossible dashes, made usual", road)
        marks.append(
            road_model.RoadMark(
                start + one.number("sOffset", 0.0),
                one.value("type", "none"),
                one.value("color", "standard"),
                width,
                tuple(lines or ()),
            )
        )
    return sorted(marks, key=lambda mark: mark.start)


def _mark_lines(
    mark: Element, usual: float
) -> list[road_model.MarkLine] | None:
    """Returns the lines of a mark (ASAM OpenDRIVE 1.7, 11.9.3).

    A line without a plausible width has the usual one [m]. The result is None
    if a line has impossible lengths.
    """
    found = []
    for one in mark.all("type", "line"):
        dash, gap = one.number("length", 0.0), one.number("space", 0.0)
        # Programs write 0 for both in a line without gaps.
        if min(dash, gap) < 0.0 or (gap > 0.0 and dash == 0.0):
            return None
        if gap > 0.0 and dash + gap < _CLOSEST_DASHES:
            return None
        stated = one.number("width", 0.0)
        aside, start = one.number("tOffset", 0.0), one.number("sOffset", 0.0)
        width = stated if 0.0 < stated <= _WIDEST_MARK else usual
        found.append(road_model.MarkLine(aside, start, dash, gap, width))
    return found


def count_dangling_links(top: Element, faults: ImportFaults) -> None:
    """Counts links to objects that are not in the file, as faults.

    Objects are roads, lanes and junctions. `top` is the root element of the
    file.
    """
    roads = {one.attrib.get("id", ""): one for one in top.all("road")}
    junctions = {one.attrib.get("id", "") for one in top.all("junction")}
    for name, road in roads.items():
        own = road.attrib.get("junction", "-1")
        if own not in ("-1", "") and own not in junctions:
            faults.add("road of a junction that is not in the file", name)
        for end in _ENDS:
            kind, linked = _link_at(road, end)
            known = junctions if kind == "junction" else roads
            if linked is not None and linked not in known:
                faults.add(f"link to a {kind} that is not in the file", name)
        for _ in _dangling_lane_links(road, roads):
            faults.add("link to a lane that is not in the file", name)
    for junction in top.all("junction"):
        name = junction.attrib.get("id", "")
        for connection in junction.all("connection"):
            for key in ("incomingRoad", "connectingRoad", "linkedRoad"):
                linked = connection.attrib.get(key)
                if linked is not None and linked not in roads:
                    faults.add(
                        "connection of a junction with a road that is not in"
                        " the file",
                        f"junction {name}",
                    )


_KNOWN = parse_yaml(Path(__file__).with_name("unread.yaml").read_bytes())


def count_unread(element: Element, faults: ImportFaults, name: str) -> None:
    """Counts parts of an element that affect the roads but are not read.

    `name` is the name of the road or junction that contains the element.
    """
    known = _KNOWN["elements"].get(element.tag)
    for key, usual in _KNOWN["attributes"].get(element.tag, {}).items():
        value = element.attrib.get(key)
        with contextlib.suppress(TypeError, ValueError):
            value = f"{float(value or ''):g}"
        if value is not None and value not in usual:
            faults.add(f"{key} of {element.tag}, not read", name)
    for child in element.all("*"):
        own = name
        if child.tag in ("road", "junction"):
            own = child.attrib.get("id", "")
        if not child.attrib and not len(child):
            continue
        if known is not None and child.tag not in known:
            faults.add(f"{child.tag} of {element.tag}, not read", own)
        elif child.tag != "userData":
            count_unread(child, faults, own)


def _link_at(road: Element, end: str) -> tuple[str, str | None]:
    """Returns kind and id of the link at an end of a road; None if none."""
    link = road.first("link", end)
    if link is None:
        return "road", None
    kind = link.attrib.get("elementType", "road")
    return kind, link.attrib.get("elementId")


def _dangling_lane_links(
    road: Element, roads: Mapping[str, Element]
) -> Iterator[Element]:
    """Yields the links of a road's lanes to lanes that do not exist."""
    own = _lane_sections(road)
    for k, section in enumerate(own):
        for end in _ENDS:
            beyond = _lanes_beyond(road, own, k, end, roads)
            if beyond is None:
                continue
            for lane in _section_lanes(section):
                for link in lane.all("link", end):
                    if link.attrib.get("id") not in beyond:
                        yield link


def _lanes_beyond(
    road: Element,
    own: Sequence[Element],
    k: int,
    end: str,
    roads: Mapping[str, Element],
) -> set[str | None] | None:
    """Returns the numbers of the lanes beyond one end of a road's section.

    Args:
        road: the road.
        own: the sections of its lanes, along the road.
        k: index of the section.
        end: `predecessor` or `successor`.
        roads: name of a road -> the road.

    Returns:
        The numbers as in the file. None beyond an end of the road that no
        known road follows.
    """
    step = 1 if end == "successor" else -1
    at = k + step
    if 0 <= at < len(own):
        beside = [own[at]]
        # One side of a road may continue through others.
        while _is_single_sided(own[at]) and 0 < at < len(own) - 1:
            at += step
            beside.append(own[at])
    else:
        kind, linked = _link_at(road, end)
        if kind != "road" or linked is None or linked not in roads:
            return None
        # The link names the end of the other road; some files omit it.
        others = _lane_sections(roads[linked])
        beside = others[:1] + others[-1:]
    return {
        lane.attrib.get("id") for one in beside for lane in _section_lanes(one)
    }


def _lane_sections(road: Element) -> list[Element]:
    """Returns the sections of a road's lanes, sorted along the road."""
    found = list(road.all("lanes", "laneSection"))
    return sorted(found, key=lambda section: section.number("s", 0.0))


def _section_lanes(section: Element) -> Iterator[Element]:
    """Yields the lanes of a section."""
    for side in ("left", "center", "right"):
        yield from section.all(side, "lane")


def read_roads(path: Path, faults: ImportFaults) -> road_model.RoadMap:
    """Returns all roads of a file.

    Raises:
        InputError: the file cannot be read, or describes an impossible road.
            The message names the file, the road, the line and the fault.
    """
    top = read_elements(path, "OpenDRIVE")
    roads: list[road_model.ImportedRoad] = []
    names: set[str] = set()
    together = 0.0
    for kind in ("road", "junction"):
        with value_errors(path):
            _check_ids(top.all(kind))
    for element in top.all("road"):
        name = _unique_name(element.attrib.get("id", ""), names)
        names.add(name)
        with value_errors(f"{path}: road {name}"):
            road = _road(element, name, faults)
        if road is not None:
            roads.append(road)
            together += road.length
    if not roads:
        raise InputError(f"{path}: the file has no roads")
    count_dangling_links(top, faults)
    count_unread(top, faults, "the file")
    if together > _LONGEST_TOGETHER:
        raise InputError(
            f"{path}: {together / 1000:.0f} km of roads; at most "
            f"{_LONGEST_TOGETHER / 1000:.0f} km can be read"
        )
    ends = np.array([(p.x, p.y) for road in roads for p in road.pieces])
    low, high = ends.min(axis=0), ends.max(axis=0)
    size = float((high - low).max())
    if size > _LARGEST:
        raise InputError(
            f"{path}: {size / 1000:.0f} km across; cut out a piece of at most"
            f" {_LARGEST / 1000:.0f} km"
        )
    x = y = 0.0
    if np.abs(ends).max() > _FAR:
        x, y = np.round((low + high) / 2.0).tolist()
    reference = top.first("header", "geoReference")
    return road_model.RoadMap(
        tuple(_moved(road, x, y) for road in roads),
        " ".join((reference.text or "").split())
        if reference is not None
        else "",
        (x, y, 0.0),
    )


def _check_ids(elements: Iterable[Element]) -> None:
    """Checks that all elements of a kind have different ids.

    Raises:
        ValueError: naming id and lines, if two are the same.
    """
    lines: dict[str, int] = {}
    for one in elements:
        own = one.value("id", "")
        if own in lines:
            raise ValueError(
                f"{one.tag} {_plain_name(own)}: line {one.line}: duplicate id,"
                f" that of line {lines[own]}"
            )
        lines[own] = one.line


def _unique_name(own: str, taken: set[str]) -> str:
    """Returns a new, unique name of letters, digits, dots and dashes."""
    stem = _plain_name(own)
    name = stem
    number = 1
    while name in taken:
        number += 1
        name = f"{stem}-{number}"
    return name


def _plain_name(own: str) -> str:
    """Returns an id reduced to letters, digits, dots and dashes."""
    return re.sub(r"[^0-9A-Za-z.-]+", "-", own)[:_LONGEST_NAME] or "unnamed"


def _moved(
    road: road_model.ImportedRoad, x: float, y: float
) -> road_model.ImportedRoad:
    pieces = [replace(p, x=p.x - x, y=p.y - y) for p in road.pieces]
    return replace(road, pieces=tuple(pieces))


def _road(
    element: Element, name: str, faults: ImportFaults
) -> road_model.ImportedRoad | None:
    pieces = _pieces(element.all("planView", "geometry"), name, faults)
    if not pieces:
        faults.add("road without a course, left out", name)
        return None
    stated = element.number("length")
    length = pieces[-1].s + pieces[-1].length
    if abs(stated - length) > _ROUNDING:
        faults.add("road whose length differs from its course's, cut", name)
        length = min(stated, length)
    if length > _LONGEST_ROAD:
        raise ValueError(f"{length:g} m are more than {_LONGEST_ROAD:g} m")
    sections = _sections(element, length, name, faults)
    if not sections:
        faults.add("road without lanes, left out", name)
        return None
    if max(pieces[0].s, sections[0].start) > _WIDEST_JOINT:
        faults.add("road whose course or lanes begin after its start", name)
    if element.first("lateralProfile", "shape") is not None:
        faults.add("lateral shape of a road, not read", name)
    junction = element.value("junction", "-1")
    banking = _cubics(element.all("lateralProfile", "superelevation"), "s")
    along = np.linspace(0.0, length, math.ceil(length) + 1)
    if banking and np.abs(banking.at(along, along)).max() > _MOST_BANKED:
        faults.add("superelevation beyond 50 deg, taken as level", name)
        banking = road_model.Cubics()
    offsets = element.all("lanes", "laneOffset")
    return road_model.ImportedRoad(
        name=name,
        junction=None if junction == "-1" else junction,
        length=length,
        pieces=tuple(pieces),
        elevation=_cubics(element.all("elevationProfile", "elevation"), "s"),
        superelevation=banking,
        lane_offset=_cubics(offsets, "s"),
        sections=tuple(sections),
        keeps_left=element.value("rule", "RHT").upper() == "LHT",
        limits=_steps(_limits(element, name, faults)),
        things=tuple(read_things(element, name, faults)),
        spans=tuple(
            one.tag
            for tag in ("bridge", "tunnel")
            for one in element.all("objects", tag)
        ),
    )


def _pieces(
    elements: Iterable[Element], name: str, faults: ImportFaults
) -> list[road_model.Piece]:
    found: list[road_model.Piece] = []
    for one in elements:
        length = one.number("length")
        if length < 0.0:
            raise ValueError(f"line {one.line}: geometry: length: {length:g}")
        if length < _SHORTEST:
            faults.add("geometry without length, left out", name)
            continue
        if length > _LONGEST_ROAD:
            raise ValueError(
                f"line {one.line}: geometry: length: {length:g} m are more"
                f" than {_LONGEST_ROAD:g} m"
            )
        try:
            shape = _shape(one, length)
        except ValueError as error:
            at = f"line {one.line}: geometry: "
            text = str(error)
            prefix = "" if text.startswith("line") else at
            raise ValueError(prefix + text) from error
        s, x, y, heading = (one.number(k) for k in ("s", "x", "y", "hdg"))
        found.append(road_model.Piece(s, x, y, heading, length, shape))
    found.sort(key=lambda piece: piece.s)
    for piece, after in pairwise(found):
        end = piece.evaluate(np.array([after.s]))[0]
        gap = math.hypot(end[0] - after.x, end[1] - after.y)
        if max(gap, abs(piece.s + piece.length - after.s)) > _WIDEST_JOINT:
            faults.add("gap of over 0.1 m in the course of a road", name)
    return found


def _shape(geometry: Element, length: float) -> curves.Shape:
    """Returns the curve of a `geometry` element.

    Raises:
        ValueError: if it has no curve, or one that is too sharp.
    """
    shape: curves.Shape | None = None
    for one in geometry.all("*"):
        if one.tag == "line":
            shape = curves.Arc(0.0)
        elif one.tag == "arc":
            shape = curves.Arc(one.number("curvature"))
        elif one.tag == "spiral":
            ends = one.number("curvStart"), one.number("curvEnd")
            if max(map(abs, ends)) > _SHARPEST:
                raise ValueError(f"a spiral of curvature {max(ends):g} 1/m")
            shape = curves.Spiral(*ends, length)
        elif one.tag == "poly3":
            v = [one.number(k) for k in "abcd"]
            # At the curve's length in the file, u is not greater than that
            # length.
            shape = curves.Cubic(
                (0, 1, 0, 0), v, length, length, stretched=False
            )
        elif one.tag == "paramPoly3":
            u, v = ([one.number(k + c) for k in "abcd"] for c in "UV")
            by_arc = one.value("pRange", "normalized") == "arcLength"
            last = length if by_arc else 1.0
            shape = curves.Cubic(u, v, last, length, by_parameter=by_arc)
    if shape is None:
        raise ValueError("neither a line nor a known curve")
    if shape.sharpest > _SHARPEST:
        raise ValueError(f"a curve of curvature {shape.sharpest:g} 1/m")
    return shape


def _cubics(
    elements: Iterable[Element], start: str, offset: float = 0.0
) -> road_model.Cubics:
    return road_model.Cubics(
        [
            (
                one.number(start, 0.0) + offset,
                *(one.number(k, 0.0) for k in "abcd"),
            )
            for one in elements
        ]
    )


def _steps(rows: Iterable[tuple[float, float]]) -> road_model.Cubics:
    """Returns a step function; each row is a start and the value from there."""
    return road_model.Cubics([(*row, 0.0, 0.0, 0.0) for row in rows])


def _sections(
    road: Element, length: float, name: str, faults: ImportFaults
) -> list[road_model.LaneSection]:
    elements = list(road.all("lanes", "laneSection"))
    elements.sort(key=lambda one: one.number("s"))
    starts = [one.number("s") for one in elements]
    ends = [*starts[1:], length][: len(starts)]
    found = []
    before: dict[int, road_model.Lane] = {}
    for one, start, end in zip(elements, starts, ends, strict=True):
        start, end = max(start, 0.0), min(end, length)
        if end - start < _SHORTEST:
            continue
        lanes: dict[int, road_model.Lane] = {}
        for side in ("left", "right"):
            for element in one.all(side, "lane"):
                lane = _lane(element, start, name, faults)
                if lane.number == 0:
                    continue
                if lane.number in lanes:
                    raise ValueError(
                        f"line {element.line}: lane {lane.number}: duplicate"
                        " id, that of a lane before it"
                    )
                lanes[lane.number] = lane
        middle = [
            mark
            for element in one.all("center", "lane")
            for mark in read_marks(element, start, name, faults)
        ]
        if _is_single_sided(one):
            # The lanes of the other side continue.
            sides = {number > 0 for number in lanes}
            lanes |= {k: v for k, v in before.items() if (k > 0) not in sides}
        before = lanes
        found.append(road_model.LaneSection(start, end, lanes, tuple(middle)))
    return found


def _is_single_sided(section: Element) -> bool:
    return section.value("singleSide", "false").lower() in ("true", "1")


def _lane(
    element: Element, start: float, name: str, faults: ImportFaults
) -> road_model.Lane:
    number = element.number("id")
    if number != int(number):
        raise ValueError(
            f"line {element.line}: lane: id: {number} is not a valid id"
        )
    heights = sorted(
        (
            one.number("sOffset", 0.0) + start,
            one.number("inner", 0.0),
            one.number("outer", one.number("inner", 0.0)),
        )
        for one in element.all("height")
    )
    if any(
        abs(value) > _HIGHEST_LANE for _, *both in heights for value in both
    ):
        faults.add("lane more than 1 m above its road, laid on it", name)
        heights = []
    direction = element.value("direction", "standard")
    lane = road_model.Lane(
        number=int(number),
        kind=element.value("type", "none"),
        width=_cubics(element.all("width"), "sOffset", start),
        border=_cubics(element.all("border"), "sOffset", start),
        height=max((inner for _, inner, _ in heights), default=0.0),
        marks=tuple(read_marks(element, start, name, faults)),
        inner_height=_steps((s, inner) for s, inner, _ in heights),
        outer_height=_steps((s, outer) for s, _, outer in heights),
        is_level=element.value("level", "false").lower() in ("true", "1"),
        is_reversed=direction == "reversed",
    )
    if direction not in ("standard", "reversed"):
        faults.add(f"lane with traffic in direction {direction}", name)
    for one in (*element.all("width"), *element.all("border")):
        if abs(one.number("a", 0.0)) > _WIDEST:
            raise ValueError(
                f"line {one.line}: lane {lane.number}: {one.tag}: "
                f"{one.number('a'):g} m is more than {_WIDEST:g} m"
            )
    return lane


def _limits(
    road: Element, name: str, faults: ImportFaults
) -> Iterator[tuple[float, float]]:
    """Yields the start [m] and the value [m/s] of each speed limit."""
    for one in road.all("type"):
        limit = 0.0
        speed = one.first("speed")
        if speed is not None:
            with contextlib.suppress(ValueError):
                limit = float(speed.value("max", ""))
            limit *= _UNITS.get(speed.value("unit", "m/s"), 0.0)
            if not 0.0 < limit <= _FASTEST:
                kind = "unlimited or unreadable speed, taken as 50 km/h"
                faults.add(kind, name)
                limit = 0.0
        yield one.number("s", 0.0), limit
