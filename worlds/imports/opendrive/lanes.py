"""The lanes of roads: kinds, edges and areas.

Edges are sampled densely enough for simulated LiDARs.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
import math
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import cos, parse_yaml, sin
from worlds.imports.opendrive.road_model import (
    Cubics,
    ImportedRoad,
    Lane,
    LaneSection,
)

# Types of lanes and objects, from `types.yaml`.
TYPES = parse_yaml(Path(__file__).with_name("types.yaml").read_bytes())
# Types of lanes on which cars drive, each in one direction.
DRIVEN = frozenset(TYPES["driven lanes"])
_RAISED = frozenset({"sidewalk", "walking", "curb"})
# A lane at least this high has a kerb [m].
_LEAST_KERB = 0.03
# Greatest distance between two places on an edge [m].
_SPACING = 2.0
# Greatest error of chords of the reference line, of widths and of heights:
# edges are then exact to 5 mm [m].
SAG = 0.002
# Smaller negative widths are rounding errors [m].
_ROUNDING = 1e-3
# A lane counts as absent where it is narrower than this [m].
LEAST_WIDTH = 0.1
# Lanes with less area are left out [m^2].
_LEAST_AREA = 1e-6
# No lane is farther from the origin of W than this along x or y [m].
_FARTHEST_LANE = 50_000.0
# No lane is farther above or below the origin of W than this [m].
_HIGHEST_LANE = 10_000.0
# Places on both sides of a joint are this far from it [m].
_JOINT_TOLERANCE = 1e-6
# Joints that are closer than this are one joint [m].
_SAME_JOINT = 4.0 * _JOINT_TOLERANCE


def lane_class(kind: str) -> str | None:
    """Returns the semantic class of a lane type; None for the type `none`."""
    classes: dict[str, str] = TYPES["lanes"]
    return None if kind == "none" else classes.get(kind, "road")


def is_raised(kind: str, height: float) -> bool:
    """Returns whether a lane is above a kerb, and not at road level.

    Args:
        kind: type of the lane.
        height: height of the lane's inner edge above the road, as the file
            states it [m].
    """
    has_kerb = height >= _LEAST_KERB
    return kind in _RAISED or (
        has_kerb and lane_class(kind) not in ("road", "parking")
    )


@dataclass(frozen=True)
class LaneBand:
    """A lane of a road section, sampled at N places from end to end.

    Attributes:
        road: the road.
        section: number of the section in this road.
        lane: the lane.
        kind: type of the lane. The kind is "enclosed" for a lane of type none
            if there are other lanes farther outside, as on a road that is
            closed to traffic.
        inner: (N, 3) places on the edge nearer to the middle of the road [m].
            Where the width of the lane has a step, a place on one edge is
            repeated. For a lane above a kerb, z is the height of the road and
            not of the lane.
        outer: (N, 3) places on the other edge, like `inner` [m].
        middle: (N, 3) places midway between the two edges [m].
        heading: (N,) heading of the road [rad].
        roll: (N,) roll of the road [rad]; 0 for a level lane.
        grade: (N,) grade of the road, rise per run.
        rise: (N, 2) heights of the lane's edges above the road [m]; NaN if
            unknown.
        s: (N,) distances along the road [m].
        is_inverted: whether the lane's width in the file is negative somewhere,
            or its border is within the lane beside it. Such a lane has no width
            there.
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
    rise: np.ndarray
    s: np.ndarray
    is_inverted: bool

    @property
    def width(self) -> np.ndarray:
        """Width (N,) of the lane [m]."""
        return np.linalg.norm(self.outer - self.inner, axis=1)


def lane_bands(road: ImportedRoad) -> Iterator[LaneBand]:
    """Yields all lanes of a road, section by section, from the middle outwards.

    The lanes on the left of a section come before the lanes on the right.

    Raises:
        ValueError: a lane leads out of the world. The message names the road
            and the fault.
    """
    for index, section in enumerate(road.sections):
        s, inside = stations(
            road, section.start, section.end, _cubics_of(section)
        )
        _, _, _, heading, roll = road.reference(s, inside).T
        grade = road.elevation.slopes(s, inside)
        offset = road.lane_offset.at(s, inside)
        middle_line = road.points(s, inside, offset)
        for side in (1, -1):
            t, inner = offset, middle_line
            # Beyond a level lane, all edges are lower or higher.
            beside_level = False
            numbers = sorted(
                (n for n in section.lanes if n * side > 0), key=abs
            )
            for number in numbers:
                lane = section.lanes[number]
                # A negative width is a slip in the file.
                if lane.width or not lane.border:
                    width = lane.width.at(s, inside)
                    beyond = t + side * np.maximum(width, 0.0)
                else:
                    border = np.abs(lane.border.at(s, inside))
                    inner_border = side * (t - offset)
                    width = border - inner_border
                    beyond = offset + side * np.maximum(border, inner_border)
                is_level = lane.is_level and bool(road.superelevation)
                own_roll = np.zeros(len(s)) if is_level else roll
                beside_level |= is_level
                if beside_level:
                    outer = inner + _across(heading, own_roll, beyond - t)
                else:
                    outer = road.points(s, inside, beyond)
                _check_place(road, number, outer)
                yield _at_own_height(
                    LaneBand(
                        road=road,
                        section=index,
                        lane=lane,
                        kind=_kind_of(road, section, lane),
                        inner=inner,
                        outer=outer,
                        middle=(inner + outer) / 2.0,
                        heading=heading,
                        roll=own_roll,
                        grade=grade,
                        rise=_edge_heights(lane, s, inside),
                        s=s,
                        is_inverted=bool((width < -_ROUNDING).any()),
                    )
                )
                t, inner = beyond, outer


def lane_polygon(band: LaneBand) -> BaseGeometry:
    """Returns the area of a lane in W [m]; empty for a lane without width."""
    inner, outer = band.inner[:, :2], band.outer[:, :2]
    outline = Polygon(np.concatenate([inner, outer[::-1]]))
    if outline.is_valid:
        return outline if outline.area > _LEAST_AREA else Polygon()
    # In a bend tighter than the width of the lane, its edge folds over.
    corners = np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], axis=1)
    pieces = [
        shapely.make_valid(Polygon(quad), method="structure")
        for quad in corners
    ]
    return shapely.union_all(
        [piece for piece in pieces if piece.area > _LEAST_AREA]
    )


def _across(
    heading: np.ndarray, roll: np.ndarray, width: np.ndarray
) -> np.ndarray:
    """Returns vectors (N, 3) to the left across a road, with lengths (N,)."""
    left = np.stack([-sin(heading), cos(heading)], axis=1)
    flat = left * (width * cos(roll))[:, None]
    return np.column_stack([flat, width * sin(roll)])


def _edge_heights(lane: Lane, s: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Returns the heights (N, 2) of a lane's edges, as in `LaneBand.rise`."""
    if not lane.inner_height:
        return np.full((len(s), 2), np.nan)
    edges = lane.inner_height, lane.outer_height
    return np.stack([height.at(s, inside) for height in edges], axis=1)


def _at_own_height(band: LaneBand) -> LaneBand:
    """Returns a lane at the height from the file, unless it is above a kerb."""
    if not band.lane.inner_height or is_raised(band.kind, band.lane.height):
        return band
    up = np.array([0.0, 0.0, 1.0])
    inner = band.inner + band.rise[:, :1] * up
    outer = band.outer + band.rise[:, 1:] * up
    return replace(band, inner=inner, outer=outer, middle=(inner + outer) / 2.0)


def _check_place(road: ImportedRoad, lane: int, edge: np.ndarray) -> None:
    """Checks that a lane is near the origin of W.

    Args:
        edge: (N, 3) outer edge of the lane in W [m].

    Raises:
        ValueError: the edge is too far from the origin, or not finite.
    """
    for reach, axes in (
        (_FARTHEST_LANE, edge[:, :2]),
        (_HIGHEST_LANE, edge[:, 2]),
    ):
        farthest = float(np.abs(axes).max())
        # NaN counts as too far.
        if not farthest <= reach:
            raise ValueError(
                f"road {road.name}: lane {lane}: {farthest:g} m from the"
                f" world's origin, more than {reach:g} m"
            )


def _kind_of(road: ImportedRoad, section: LaneSection, lane: Lane) -> str:
    """Returns the type of a lane, as in `LaneBand.kind`."""
    if lane.kind != "none" or road.junction is not None:
        return lane.kind
    beyond = [
        other.kind
        for other in section.lanes.values()
        if abs(other.number) > abs(lane.number)
        and other.number * lane.number > 0
    ]
    return "enclosed" if any(kind != "none" for kind in beyond) else "none"


def _cubics_of(section: LaneSection) -> list[Cubics]:
    """Returns the functions along the road that shape a section's lanes."""
    return [
        cubics
        for lane in section.lanes.values()
        for cubics in (lane.width, lane.border, lane.inner_height)
    ]


def stations(
    road: ImportedRoad,
    start: float,
    end: float,
    more: Sequence[Cubics] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Returns distances along a road at which its shape must be sampled.

    Between two of these distances, the road is nearly straight. A joint of two
    pieces of the road is contained twice, once for each piece.

    Args:
        road: the road.
        start: the first distance [m].
        end: the last distance [m].
        more: functions along the road whose shape matters in addition to the
            shape of the road.

    Returns:
        (N,) distances along the road, and (N,) distances that select the piece
        of the road (see `ImportedRoad.reference`) [m].
    """
    functions = [
        road.elevation,
        road.superelevation,
        road.lane_offset,
        *more,
    ]
    starts = np.array([piece.s for piece in road.pieces])
    places, inside = [], []
    for a, b in pairwise(_joints(road, start, end, functions)):
        piece = int(np.searchsorted(starts, a + _JOINT_TOLERANCE, "right")) - 1
        sharpest = road.pieces[max(0, piece)].shape.sharpest
        bend = max(sharpest, *(one.bend(a, b) for one in functions))
        step = _SPACING
        if bend > 0.0:
            # A chord of this length is at most `SAG` from an arc.
            step = min(step, math.sqrt(8.0 * SAG / bend))
        # Rounded: a length is a few last bits more or less.
        number = math.ceil(round((b - a) / step, 6)) + 1
        s = np.linspace(a, b, number)
        places.append(s)
        inside.append(np.clip(s, a + _JOINT_TOLERANCE, b - _JOINT_TOLERANCE))
    return np.concatenate(places), np.concatenate(inside)


def _joints(
    road: ImportedRoad, start: float, end: float, functions: Iterable[Cubics]
) -> np.ndarray:
    """Returns the joints of a road's pieces and of functions along the road.

    The result is increasing distances (N,) along the road from `start` to
    `end`, including both [m].
    """
    joints = np.concatenate(
        [
            [start, end],
            [piece.s for piece in road.pieces],
            *(function.starts for function in functions),
        ]
    )
    joints = np.unique(np.clip(joints, start, end))
    between = joints[
        (joints > start + _SAME_JOINT) & (joints < end - _SAME_JOINT)
    ]
    between = between[np.diff(between, prepend=-math.inf) > _SAME_JOINT]
    return np.concatenate([[start], between, [end]])
