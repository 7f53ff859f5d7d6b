"""Reads the painted lines of a lane from an OpenDRIVE file."""

from __future__ import annotations

from collections.abc import Iterator

from cns_drake.base.xml_elements import Element
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.opendrive.road_model import MarkLine, RoadMark

# Width of a painted line without a plausible one [m].
_WIDTH, _WIDEST = 0.12, 1.0
# Shortest distance between the starts of two dashes [m].
_SHORTEST = 0.1


def read_marks(
    lane: Element, start: float, road: str, faults: ImportFaults
) -> list[RoadMark]:
    """Returns the marks of a lane, in their order along the road.

    Args:
        lane: the element.
        start: of its section along the road [m].
        road: name of the road.
        faults: counts marks whose lines are not usable.

    Raises:
        ValueError: naming line and fault, if a text is not a number.
    """
    marks = []
    for one in lane.all("roadMark"):
        stated = one.number("width", 0.0)
        width = stated if 0.0 < stated <= _WIDEST else _WIDTH
        if one.text("weight", "standard") == "bold" and not stated:
            width *= 2.0
        lines: tuple[MarkLine, ...] = ()
        try:
            lines = tuple(_lines(one, width))
        except _NoPatternError:
            faults.add("road mark with impossible dashes, made usual", road)
        marks.append(
            RoadMark(
                start + one.number("sOffset", 0.0),
                one.text("type", "none"),
                one.text("color", "standard"),
                width,
                lines,
            )
        )
    return sorted(marks, key=lambda mark: mark.start)


class _NoPatternError(Exception):
    """The dashes of a line cannot be painted."""


def _lines(mark: Element, usual: float) -> Iterator[MarkLine]:
    """Yields the lines of a mark (ASAM OpenDRIVE 1.7, 11.9.3).

    Args:
        mark: the element.
        usual: width of a line that has no plausible one [m].

    Raises:
        _NoPatternError: if a line has lengths that cannot be.
    """
    for one in mark.all("type", "line"):
        dash, gap = one.number("length", 0.0), one.number("space", 0.0)
        # Programs write both as 0 for a line without gaps.
        if min(dash, gap) < 0.0 or (gap > 0.0 and dash == 0.0):
            raise _NoPatternError
        if gap > 0.0 and dash + gap < _SHORTEST:
            raise _NoPatternError
        stated = one.number("width", 0.0)
        yield MarkLine(
            aside=one.number("tOffset", 0.0),
            start=one.number("sOffset", 0.0),
            dash=dash,
            gap=gap,
            width=stated if 0.0 < stated <= _WIDEST else usual,
        )
