"""Reads roads from an OpenDRIVE file.

The import joins lanes whose ends meet, and does not use the links between
roads, lanes and junctions.
"""

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
import contextlib
from dataclasses import replace
from itertools import pairwise
import math
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np

from evaluation.base import (
    Element,
    InputError,
    parse_yaml,
    read_elements,
    value_errors,
)
from worlds.imports.faults import WHOLE_FILE, ImportFaults
from worlds.imports.opendrive import curves, road_model
from worlds.imports.opendrive.things import read_things
from worlds.imports.part_tables import PartTable

# Versions up to 1.8 are read.
_LAST_MINOR = 8
# A gap between two pieces of a road's course is counted if it is wider than
# this [m].
_WIDEST_JOINT = 0.1
# Greatest curvature of a curve [1/m].
_SHARPEST = 100.0
# Pieces of a road's course, and lane sections, are left out if they are shorter
# than this [m].
_SHORTEST_PIECE = 1e-5
# Greatest width of a lane [m].
_WIDEST_LANE = 100.0
# Greatest height of a kerb [m].
_HIGHEST_LANE = 1.0
# Width of a painted line without a plausible width [m].
_MARK_WIDTH = 0.12
# Bold lines without a width are this many times as wide.
_BOLD = 2.0
# Greatest plausible width of a painted line [m].
_WIDEST_MARK = 1.0
# Least distance between the starts of two dashes [m].
_CLOSEST_DASHES = 0.1


# Unit of a speed limit -> its size [m/s].
_UNITS = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704}
# Greatest speed limit [m/s].
_FASTEST = 100.0
# Greatest extent of a network along x or y; whole countries are refused [m].
_WIDEST = 20_000.0
# If any road is farther from the origin than this, all are moved to it [m].
_FAR_AWAY = 10_000.0
# Lengths that differ by less than this are equal [m].
_ROUNDING = 0.01
# Greatest roll of a road; banked test tracks have up to 49 deg [rad].
_MOST_ROLL = math.radians(50.0)
# Names are cut to this length where they become part of other names.
_LONGEST_NAME = 60
_TABLE_FILE = Path(__file__).with_name("parts.yaml")
_PARTS = PartTable(_TABLE_FILE)
_WHOLE = parse_yaml(_TABLE_FILE.read_bytes())["whole"].split()


def read_roads(path: Path, faults: ImportFaults) -> road_model.RoadMap:
    """Returns all roads of a file.

    Raises:
        InputError: the file cannot be read, or describes an impossible road.
            The message names the file, the road, the line and the fault.
    """
    top = read_elements(path, "OpenDRIVE")
    _check_version(top, path)
    roads: list[road_model.ImportedRoad] = []
    names: set[str] = set()
    for kind in ("road", "junction"):
        with value_errors(path):
            _check_ids(top.all(kind))
    for element in top.all("road"):
        name = _unique_name(element.attrib.get("id", ""), names)
        names.add(name)
        with value_errors(f"{path}: road {name}"):
            road = _read_road(element, name, faults)
        if road is not None:
            roads.append(road)
    if not roads:
        raise InputError(f"{path}: the file has no roads")
    faults.check_ruins(path, (road.name for road in roads))
    _count_unread(top, faults, WHOLE_FILE)
    x, y = _origin_of(path, roads)
    reference = top.first("header", "geoReference")
    system = "" if reference is None else reference.text or ""
    with value_errors(path):
        east, north, up = _offset_of(top)
    return road_model.RoadMap(
        tuple(_moved(road, x, y) for road in roads),
        " ".join(system.split()),
        (x + east, y + north, up),
        len(list(top.all("road"))),
    )


def _check_version(top: Element, path: Path) -> None:
    """Raises an InputError if the file has a version that is not read."""
    header = top.first("header")
    with value_errors(path):
        version = [
            1 if header is None else int(header.number(part, 1.0))
            for part in ("revMajor", "revMinor")
        ]
    if version[0] != 1 or version[1] > _LAST_MINOR:
        raise InputError(
            f"{path}: OpenDRIVE {version[0]}.{version[1]}; versions up to"
            f" 1.{_LAST_MINOR} are read"
        )


def _offset_of(top: Element) -> tuple[float, float, float]:
    """Returns the place of the file's origin in its reference system [m].

    An offset that turns the file, too, is counted, and not read.
    """
    found = top.first("header", "offset")
    if found is None or found.number("hdg", 0.0) != 0.0:
        return 0.0, 0.0, 0.0
    x, y, z = (found.number(axis, 0.0) for axis in "xyz")
    return x, y, z


def _origin_of(
    path: Path, roads: Sequence[road_model.ImportedRoad]
) -> tuple[float, float]:
    """Returns the origin of W in coordinates of the file, x and y [m].

    The origin is that of the file, or the middle of the network if the network
    is far from the origin of the file.
    """
    starts = np.array(
        [(piece.x, piece.y) for road in roads for piece in road.pieces]
    )
    low, high = starts.min(axis=0), starts.max(axis=0)
    width = float((high - low).max())
    if width > _WIDEST:
        raise InputError(
            f"{path}: {width / 1000:.0f} km across; cut out a piece of at most"
            f" {_WIDEST / 1000:.0f} km"
        )
    if np.abs(starts).max() <= _FAR_AWAY:
        return 0.0, 0.0
    x, y = np.round((low + high) / 2.0).tolist()
    return x, y


def _check_ids(elements: Iterable[Element]) -> None:
    """Checks that all elements of a kind have different ids.

    Raises:
        ValueError: two elements have the same id; the message names the id and
            the lines.
    """
    lines: dict[str, int] = {}
    for element in elements:
        own_id = element.value("id", "")
        if own_id in lines:
            raise ValueError(
                f"{element.tag} {_plain_name(own_id)}: line {element.line}:"
                f" duplicate id, that of line {lines[own_id]}"
            )
        lines[own_id] = element.line


def _unique_name(own_id: str, taken: AbstractSet[str]) -> str:
    """Returns a name of letters, digits, dots and dashes, made from an id.

    `taken` contains names that the result must not be.
    """
    stem = _plain_name(own_id)
    name = stem
    number = 1
    while name in taken:
        number += 1
        name = f"{stem}-{number}"
    return name


def _plain_name(own_id: str) -> str:
    """Returns an id reduced to letters, digits, dots and dashes."""
    plain = re.sub(r"[^0-9A-Za-z.-]+", "-", own_id)
    return plain[:_LONGEST_NAME] or "unnamed"


def _moved(
    road: road_model.ImportedRoad, x: float, y: float
) -> road_model.ImportedRoad:
    """Returns a road in a frame whose origin is at x and y [m]."""
    pieces = [replace(p, x=p.x - x, y=p.y - y) for p in road.pieces]
    return replace(road, pieces=tuple(pieces))


def _read_road(
    element: Element, name: str, faults: ImportFaults
) -> road_model.ImportedRoad | None:
    """Returns a road of the file; None for a road without course or lanes.

    Raises:
        ValueError: the road is impossible; the message names the line.
    """
    pieces = _read_course(element.all("planView", "geometry"), name, faults)
    if not pieces:
        faults.add("road without a course, left out", name, ruins=True)
        return None
    stated = element.number("length")
    length = pieces[-1].s + pieces[-1].length
    if abs(stated - length) > _ROUNDING:
        faults.add("road whose length differs from its course's, cut", name)
        length = min(stated, length)
    sections = read_sections(element, length, name, faults)
    if not sections:
        faults.add("road without lanes, left out", name, ruins=True)
        return None
    if max(pieces[0].s, sections[0].start) > _WIDEST_JOINT:
        faults.add("road whose course or lanes begin after its start", name)
    if element.first("lateralProfile", "shape") is not None:
        faults.add("lateral shape of a road, not read", name)
    junction = element.value("junction", "-1")
    banking = read_cubics(element.all("lateralProfile", "superelevation"), "s")
    along = np.linspace(0.0, length, math.ceil(length) + 1)
    if banking and np.abs(banking.at(along, along)).max() > _MOST_ROLL:
        faults.add("superelevation beyond 50 deg, taken as level", name)
        banking = road_model.Cubics()
    offsets = element.all("lanes", "laneOffset")
    return road_model.ImportedRoad(
        name=name,
        junction=None if junction == "-1" else junction,
        length=length,
        pieces=tuple(pieces),
        elevation=read_cubics(
            element.all("elevationProfile", "elevation"), "s"
        ),
        superelevation=banking,
        lane_offset=read_cubics(offsets, "s"),
        sections=tuple(sections),
        keeps_left=element.value("rule", "RHT").upper() == "LHT",
        limits=step_function(_speed_limits(element, name, faults)),
        things=tuple(read_things(element, name, faults)),
        spans=tuple(
            road_model.Span(tag, s, s + span.number("length"))
            for tag in ("bridge", "tunnel")
            for span in element.all("objects", tag)
            for s in (span.number("s"),)
        ),
    )


def _read_course(
    elements: Iterable[Element], name: str, faults: ImportFaults
) -> list[road_model.CoursePiece]:
    """Returns the pieces of a road's course, in their order along the road.

    Args:
        elements: the elements `geometry` of the road.
        name: name of the road, as an example in `faults`.
        faults: counts pieces without length, and gaps between pieces.

    Raises:
        ValueError: a piece has an impossible length or curve; the message names
            its line.
    """
    pieces: list[road_model.CoursePiece] = []
    for element in elements:
        where = f"line {element.line}: geometry: "
        length = element.number("length")
        if length < 0.0:
            raise ValueError(f"{where}length: {length:g}")
        if length < _SHORTEST_PIECE:
            faults.add("geometry without length, left out", name)
            continue
        try:
            shape = _read_curve(element, length)
        except ValueError as error:
            text = str(error)
            # Numbers that cannot be read already name their line.
            prefix = "" if text.startswith("line") else where
            raise ValueError(prefix + text) from error
        s, x, y, heading = (element.number(k) for k in ("s", "x", "y", "hdg"))
        pieces.append(road_model.CoursePiece(s, x, y, heading, length, shape))
    pieces.sort(key=lambda piece: piece.s)
    for piece, after in pairwise(pieces):
        end = piece.evaluate(np.array([after.s]))[0]
        gap = math.hypot(end[0] - after.x, end[1] - after.y)
        if max(gap, abs(piece.s + piece.length - after.s)) > _WIDEST_JOINT:
            faults.add("gap of over 0.1 m in the course of a road", name)
    return pieces


def _read_curve(geometry: Element, length: float) -> curves.Shape:
    """Returns the curve of a `geometry` element.

    Raises:
        ValueError: the element has no curve, or a curve that is too sharp. The
            message names the fault only.
    """
    shape: curves.Shape | None = None
    for curve in geometry.all("*"):
        if curve.tag == "line":
            shape = curves.Arc(0.0)
        elif curve.tag == "arc":
            shape = curves.Arc(curve.number("curvature"))
        elif curve.tag == "spiral":
            ends = curve.number("curvStart"), curve.number("curvEnd")
            if max(map(abs, ends)) > _SHARPEST:
                raise ValueError(f"a spiral of curvature {max(ends):g} 1/m")
            shape = curves.Spiral(*ends, length)
        elif curve.tag == "poly3":
            v = [curve.number(k) for k in "abcd"]
            # At the curve's length in the file, u is not greater than that
            # length.
            shape = curves.Cubic(
                (0, 1, 0, 0), v, length, length, stretched=False
            )
        elif curve.tag == "paramPoly3":
            u, v = ([curve.number(k + c) for k in "abcd"] for c in "UV")
            by_arc = curve.value("pRange", "normalized") == "arcLength"
            last = length if by_arc else 1.0
            shape = curves.Cubic(u, v, last, length, by_parameter=by_arc)
    if shape is None:
        raise ValueError("neither a line nor a known curve")
    if shape.sharpest > _SHARPEST:
        raise ValueError(f"a curve of curvature {shape.sharpest:g} 1/m")
    return shape


def _speed_limits(
    road: Element, name: str, faults: ImportFaults
) -> Iterator[tuple[float, float]]:
    """Yields the start [m] and the value [m/s] of each speed limit.

    The value is 0 if there is no limit, or none that can be read.
    """
    for road_type in road.all("type"):
        limit = 0.0
        speed = road_type.first("speed")
        if speed is not None:
            with contextlib.suppress(ValueError):
                limit = float(speed.value("max", ""))
            limit *= _UNITS.get(speed.value("unit", "m/s"), 0.0)
            if not 0.0 < limit <= _FASTEST:
                kind = "unlimited or unreadable speed, taken as 50 km/h"
                faults.add(kind, name)
                limit = 0.0
        yield road_type.number("s", 0.0), limit


def _count_unread(element: Element, faults: ImportFaults, name: str) -> None:
    """Counts parts of an element that affect the roads but are not read.

    `name` is the name of the road or junction that contains the element.
    """
    attributes = {
        key: _plain_value(value) for key, value in element.attrib.items()
    }
    _PARTS.account([element.tag], attributes, name, faults)
    known = _PARTS.names(element.tag, "children")
    for child in element.all("*"):
        own = name
        if child.tag in ("road", "junction"):
            own = child.attrib.get("id", "")
        if child.tag in _WHOLE or not (child.attrib or len(child)):
            continue
        if child.tag in known:
            _count_unread(child, faults, own)
        else:
            faults.add(f"{child.tag} of {element.tag}, not read", own)


def _plain_value(text: str) -> str:
    """Returns a value in one notation: `0` for `0.0` and `-0.0`."""
    with contextlib.suppress(ValueError):
        return f"{float(text) + 0.0:g}"
    return text


class _HeightStep(NamedTuple):
    """Heights of a lane's edges above the road from a distance `s` on [m]."""

    s: float
    inner: float
    outer: float


def read_cubics(
    elements: Iterable[Element], start: str, offset: float = 0.0
) -> road_model.Cubics:
    """Returns the function that elements define along a road.

    Each element has the coefficients `a` to `d` of a cubic polynomial. The
    attribute named `start` contains the distance at which the polynomial
    begins; `offset` is added to this distance [m].
    """
    return road_model.Cubics(
        [
            (
                element.number(start, 0.0) + offset,
                *(element.number(coefficient, 0.0) for coefficient in "abcd"),
            )
            for element in elements
        ]
    )


def step_function(rows: Iterable[tuple[float, float]]) -> road_model.Cubics:
    """Returns a step function of the distance along a road.

    Each row has the start of a step [m], and the value from this start on.
    """
    return road_model.Cubics([(*row, 0.0, 0.0, 0.0) for row in rows])


def read_sections(
    road: Element, length: float, name: str, faults: ImportFaults
) -> list[road_model.LaneSection]:
    """Returns the lane sections of a road, in their order along the road.

    Args:
        road: the road in the file.
        length: length of the road [m]; sections beyond it are left out.
        name: name of the road, as an example in `faults`.
        faults: counts lanes and marks that are changed.

    Raises:
        ValueError: a lane is impossible; the message names its line.
    """
    elements = list(road.all("lanes", "laneSection"))
    elements.sort(key=lambda element: element.number("s"))
    starts = [element.number("s") for element in elements]
    ends = [*starts[1:], length][: len(starts)]
    sections = []
    before: dict[int, road_model.Lane] = {}
    for element, start, end in zip(elements, starts, ends, strict=True):
        start, end = max(start, 0.0), min(end, length)
        if end - start < _SHORTEST_PIECE:
            continue
        lanes = _read_lanes(element, start, name, faults)
        middle_marks = tuple(
            mark
            for lane in element.all("center", "lane")
            for mark in _read_marks(lane, start, name, faults)
        )
        if is_single_sided(element):
            # The lanes of the other side continue.
            sides = {number > 0 for number in lanes}
            lanes |= {
                number: lane
                for number, lane in before.items()
                if (number > 0) not in sides
            }
        before = lanes
        sections.append(road_model.LaneSection(start, end, lanes, middle_marks))
    return sections


def _read_lanes(
    section: Element, start: float, name: str, faults: ImportFaults
) -> dict[int, road_model.Lane]:
    """Returns the lanes of a section by their number, without lane 0.

    Args:
        section: the section in the file.
        start: distance along the road at which the section begins [m].
        name: name of the road, as an example in `faults`.
        faults: counts lanes and marks that are changed.

    Raises:
        ValueError: a lane is impossible; the message names its line.
    """
    lanes: dict[int, road_model.Lane] = {}
    for side in ("left", "right"):
        for element in section.all(side, "lane"):
            lane = _read_lane(element, start, name, faults)
            if lane.number == 0:
                continue
            if lane.number in lanes:
                raise ValueError(
                    f"line {element.line}: lane {lane.number}: duplicate id,"
                    " that of a lane before it"
                )
            lanes[lane.number] = lane
    return lanes


def is_single_sided(section: Element) -> bool:
    """Returns whether a section has lanes on one side of the road only.

    The lanes on the other side continue from the section before.
    """
    return section.value("singleSide", "false").lower() in ("true", "1")


def _read_lane(
    element: Element, start: float, name: str, faults: ImportFaults
) -> road_model.Lane:
    """Returns a lane of the file; the arguments are as for `_read_lanes`."""
    number = element.number("id")
    if number != int(number):
        raise ValueError(
            f"line {element.line}: lane: id: {number} is not a valid id"
        )
    heights = sorted(
        _HeightStep(
            height.number("sOffset", 0.0) + start,
            height.number("inner", 0.0),
            height.number("outer", height.number("inner", 0.0)),
        )
        for height in element.all("height")
    )
    if any(
        abs(height) > _HIGHEST_LANE
        for step in heights
        for height in (step.inner, step.outer)
    ):
        faults.add("lane more than 1 m above its road, laid on it", name)
        heights = []
    direction = element.value("direction", "standard")
    lane = road_model.Lane(
        number=int(number),
        kind=element.value("type", "none"),
        width=read_cubics(element.all("width"), "sOffset", start),
        border=read_cubics(element.all("border"), "sOffset", start),
        height=max((step.inner for step in heights), default=0.0),
        marks=tuple(_read_marks(element, start, name, faults)),
        inner_height=step_function((one.s, one.inner) for one in heights),
        outer_height=step_function((one.s, one.outer) for one in heights),
        is_level=element.value("level", "false").lower() in ("true", "1"),
        is_reversed=direction == "reversed",
    )
    if direction not in ("standard", "reversed"):
        faults.add(f"lane with traffic in direction {direction}", name)
    for width in (*element.all("width"), *element.all("border")):
        if abs(width.number("a", 0.0)) > _WIDEST_LANE:
            raise ValueError(
                f"line {width.line}: lane {lane.number}: {width.tag}: "
                f"{width.number('a'):g} m is more than {_WIDEST_LANE:g} m"
            )
    return lane


def _read_marks(
    lane: Element, start: float, road: str, faults: ImportFaults
) -> list[road_model.RoadMark]:
    """Returns the marks of a lane, in their order along the road.

    Marks whose lines cannot be used get the usual lines of their type, and are
    counted in `faults`.

    Args:
        lane: the lane in the file.
        start: distance along the road at which the lane's section begins [m].
        faults: counts the marks that were changed.

    Raises:
        ValueError: a text is not a number; the error names its line.
    """
    marks = []
    for element in lane.all("roadMark"):
        stated = element.number("width", 0.0)
        width = stated if 0.0 < stated <= _WIDEST_MARK else _MARK_WIDTH
        if element.value("weight", "standard") == "bold" and not stated:
            width *= _BOLD
        lines = _read_mark_lines(element, width)
        if lines is None:
            faults.add("road mark with impossible dashes, made usual", road)
        marks.append(
            road_model.RoadMark(
                start + element.number("sOffset", 0.0),
                element.value("type", "none"),
                element.value("color", "standard"),
                width,
                tuple(lines or ()),
            )
        )
    return sorted(marks, key=lambda mark: mark.start)


def _read_mark_lines(
    mark: Element, usual: float
) -> list[road_model.MarkLine] | None:
    """Returns the lines of a mark (ASAM OpenDRIVE 1.7, 11.9.3).

    A line without a plausible width has the usual width [m]. The result is None
    if a line has impossible lengths.
    """
    lines = []
    for line in mark.all("type", "line"):
        dash, gap = line.number("length", 0.0), line.number("space", 0.0)
        # Programs write 0 for both in a line without gaps.
        if min(dash, gap) < 0.0 or (gap > 0.0 and dash == 0.0):
            return None
        if gap > 0.0 and dash + gap < _CLOSEST_DASHES:
            return None
        stated = line.number("width", 0.0)
        aside, start = line.number("tOffset", 0.0), line.number("sOffset", 0.0)
        width = stated if 0.0 < stated <= _WIDEST_MARK else usual
        lines.append(road_model.MarkLine(aside, start, dash, gap, width))
    return lines
