"""Reads lanes, section by section, from an OpenDRIVE file."""

from collections.abc import Iterable
from typing import NamedTuple

from cns_drake.base import Element
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive import road_model
from cns_drake.imports.opendrive.course_reader import SHORTEST_PIECE

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
        if end - start < SHORTEST_PIECE:
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
        road: name of the road.
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
