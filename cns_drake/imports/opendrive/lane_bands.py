"""The borders of lanes, sampled closely enough for LiDAR."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np

from cns_drake.imports.opendrive.road_model import (
    Cubics,
    ImportedRoad,
    Lane,
    LaneSection,
)

# Greatest distance of two places on a border, and greatest error of chords of
# the reference line, of widths and of heights: borders are then true to 5 mm
# [m].
_SPACING = 2.0
_SAG = 0.002
_MOST_STATIONS = 200_000
# No lane is farther from the reference line, or higher [m].
_FARTHEST, _HIGHEST = 50_000.0, 10_000.0
# Places nearer to each other than this, counted from the joints, are one [m].
_INWARDS = 1e-6


@dataclass(frozen=True)
class LaneBand:
    """A lane of a section, from end to end.

    Attributes:
        road, section, lane: its road, the number of its section there, its
            lane.
        kind: type of the lane; "enclosed" for a lane of type none with others
            farther outside, as on a road that is closed to traffic.
        inner, outer: (N, 3) places on its edges, in the order of the road; two
            are the same at a step in its width [m].
        middle: (N, 3) between them.
        heading, roll, grade: (N,) of the road there [rad, rad, 1].
        s: (N,) along the road [m].
    """

    road: ImportedRoad
    section: int
    lane: Lane
    kind: str
    inner: np.ndarray
    outer: np.ndarray
    middle: np.ndarray
    heading: np.ndarray
    roll: np.ndarray
    grade: np.ndarray
    s: np.ndarray

    @property
    def width(self) -> np.ndarray:
        """Its width (N,) [m]."""
        return np.linalg.norm(self.outer - self.inner, axis=1)


def lane_bands(road: ImportedRoad) -> Iterator[LaneBand]:
    """Yields all lanes of a road, section by section, from the middle.

    Raises:
        ValueError: naming road and fault, if it has too many bends to be
            followed, or a lane leads out of the world.
    """
    for k, section in enumerate(road.sections):
        s, inside = _stations(road, section)
        _, _, _, heading, roll = road.reference(s, inside).T
        grade = road.elevation.slope(s, inside)
        offset = road.lane_offset.at(s, inside)
        middle_line = road.points(s, inside, offset)
        for side in (1, -1):
            t, inner = offset, middle_line
            numbers = sorted(
                (n for n in section.lanes if n * side > 0), key=abs
            )
            for number in numbers:
                lane = section.lanes[number]
                if lane.width or not lane.border:
                    # A width below zero is a slip.
                    width = np.maximum(lane.width.at(s, inside), 0.0)
                    beyond = t + side * width
                else:
                    border = np.abs(lane.border.at(s, inside))
                    beyond = offset + side * np.maximum(
                        border, side * (t - offset)
                    )
                outer = road.points(s, inside, beyond)
                _check_place(road, number, outer)
                yield LaneBand(
                    road=road,
                    section=k,
                    lane=lane,
                    kind=_kind(road, section, lane),
                    inner=inner,
                    outer=outer,
                    middle=(inner + outer) / 2.0,
                    heading=heading,
                    roll=roll,
                    grade=grade,
                    s=s,
                )
                t, inner = beyond, outer


def _check_place(road: ImportedRoad, lane: int, edge: np.ndarray) -> None:
    for reach, axes in ((_FARTHEST, edge[:, :2]), (_HIGHEST, edge[:, 2])):
        farthest = float(np.abs(axes).max())
        # NaN counts as too far.
        if not farthest <= reach:
            raise ValueError(
                f"road {road.name}: lane {lane}: {farthest:g} m off, more than"
                f" {reach:g} m"
            )


def _kind(road: ImportedRoad, section: LaneSection, lane: Lane) -> str:
    if lane.kind != "none" or road.junction is not None:
        return lane.kind
    beyond = [
        other.kind
        for other in section.lanes.values()
        if abs(other.number) > abs(lane.number)
        and other.number * lane.number > 0
    ]
    return "enclosed" if any(kind != "none" for kind in beyond) else "none"


def _stations(
    road: ImportedRoad, section: LaneSection
) -> tuple[np.ndarray, np.ndarray]:
    """Returns places along a section, and the starts of their pieces.

    A joint is there twice, once for each side.
    """
    cubics: list[Cubics] = [
        road.elevation,
        road.superelevation,
        road.lane_offset,
    ]
    for lane in section.lanes.values():
        cubics += [lane.width, lane.border]
    joints = np.concatenate(
        [
            [section.start, section.end],
            [piece.s for piece in road.pieces],
            *(one.starts for one in cubics),
        ]
    )
    joints = np.unique(np.clip(joints, section.start, section.end))
    between = joints[
        (joints > section.start + 4.0 * _INWARDS)
        & (joints < section.end - 4.0 * _INWARDS)
    ]
    between = between[np.diff(between, prepend=-math.inf) > 4.0 * _INWARDS]
    ends = np.concatenate([[section.start], between, [section.end]])
    starts = np.array([piece.s for piece in road.pieces])
    places, inside = [], []
    total = 0
    for a, b in pairwise(ends):
        piece = int(np.searchsorted(starts, a + _INWARDS, "right")) - 1
        sharpest = road.pieces[max(0, piece)].shape.sharpest
        bend = max(sharpest, *(one.bend(a, b) for one in cubics))
        step = _SPACING
        if bend > 0.0:
            step = min(step, math.sqrt(8.0 * _SAG / bend))
        number = math.ceil((b - a) / step) + 1
        total += number
        if total > _MOST_STATIONS:
            raise ValueError(f"road {road.name}: too many bends")
        s = np.linspace(a, b, number)
        places.append(s)
        inside.append(np.clip(s, a + _INWARDS, b - _INWARDS))
    return np.concatenate(places), np.concatenate(inside)
