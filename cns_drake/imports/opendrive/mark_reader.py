"""Reads the marks of lanes from an OpenDRIVE file."""

from cns_drake.base.xml_elements import Element
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive import road_model

# Width of a painted line without a plausible width [m].
_MARK_WIDTH = 0.12
# Bold lines without a width are this many times as wide.
_BOLD = 2.0
# Greatest plausible width of a painted line [m].
_WIDEST_MARK = 1.0
# Least distance between the starts of two dashes [m].
_CLOSEST_DASHES = 0.1


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
