"""Reads the courses of roads in plan view from an OpenDRIVE file."""

from collections.abc import Iterable
from itertools import pairwise
import math

import numpy as np

from cns_drake.base import Element
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive import curves, road_model

# Greatest length of a road [m].
LONGEST_ROAD = 100_000.0
# A gap between two pieces of a road's course is counted if it is wider than
# this [m].
WIDEST_JOINT = 0.1
# Greatest curvature of a curve [1/m].
_SHARPEST = 100.0
# Pieces of a road's course, and lane sections, are left out if they are shorter
# than this [m].
SHORTEST_PIECE = 1e-5


def read_course(
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
        if length < SHORTEST_PIECE:
            faults.add("geometry without length, left out", name)
            continue
        if length > LONGEST_ROAD:
            raise ValueError(
                f"{where}length: {length:g} m are more than {LONGEST_ROAD:g} m"
            )
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
        if max(gap, abs(piece.s + piece.length - after.s)) > WIDEST_JOINT:
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
