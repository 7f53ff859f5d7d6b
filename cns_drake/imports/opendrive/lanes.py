"""The lanes of roads: kinds, edges, levels (ground or bridge), heights.

Edges are sampled densely enough for simulated LiDARs.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.imports.opendrive.road_model import (
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
_SAG = 0.002
# Greatest number of places on the edges of a road.
_MOST_STATIONS = 200_000
# No lane is farther from the reference line than this along x or y [m].
_FARTHEST = 50_000.0
# No lane is farther above or below it than this [m].
_HIGHEST = 10_000.0
# Distances along the road that differ by less than this are the same [m].
_INWARDS = 1e-6
# A road at least this far above another one is a bridge [m].
_HEADROOM = 3.0
# Places are above one another if they are at most this far apart, as seen from
# above [m].
_ABOVE_WITHIN = 2.5
# A bridge extends this far to both sides of the road that it crosses [m].
_BRIDGE_REACH = 8.0
_LEAST_WIDTH = 0.1
# Number of nearby places whose planes are averaged.
_NEIGHBOURS = 8
# Distance between the places of a lane [m].
_PLACE_SPACING = 0.5
# A kerb within this distance of a sidewalk has the sidewalk's height [m].
_BESIDE = 1.0
# Nearer places have more weight; this distance limits their weight [m].
_CORE = 0.05
# Number of places that are processed at a time.
_BLOCK = 200_000
_LEVEL = 1e-9
# The arrays of a band, with one row for each place along the road.
_ARRAYS = (
    "inner", "outer", "middle", "heading", "roll", "grade", "rise", "s",
)  # fmt: skip


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

    @property
    def width(self) -> np.ndarray:
        """Width (N,) of the lane [m]."""
        return np.linalg.norm(self.outer - self.inner, axis=1)


def lane_bands(road: ImportedRoad) -> Iterator[LaneBand]:
    """Yields all lanes of a road, section by section, from the middle outwards.

    Raises:
        ValueError: the road bends so often that it would need too many places,
            or a lane leads out of the world. The message names the road and the
            fault.
    """
    for k, section in enumerate(road.sections):
        s, inside = stations(
            road, section.start, section.end, _cubics_of(section)
        )
        _, _, _, heading, roll = road.reference(s, inside).T
        grade = road.elevation.at(s, inside, is_slope=True)
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
                if lane.width or not lane.border:
                    # A negative width is a slip in the file.
                    width = np.maximum(lane.width.at(s, inside), 0.0)
                    beyond = t + side * width
                else:
                    border = np.abs(lane.border.at(s, inside))
                    beyond = offset + side * np.maximum(
                        border, side * (t - offset)
                    )
                is_level = lane.is_level and bool(road.superelevation)
                own_roll = np.zeros(len(s)) if is_level else roll
                beside_level |= is_level
                if beside_level:
                    outer = inner + _across(heading, own_roll, beyond - t)
                else:
                    outer = road.points(s, inside, beyond)
                _check_place(road, number, outer)
                yield _band(
                    LaneBand(
                        road=road,
                        section=k,
                        lane=lane,
                        kind=_kind(road, section, lane),
                        inner=inner,
                        outer=outer,
                        middle=(inner + outer) / 2.0,
                        heading=heading,
                        roll=own_roll,
                        grade=grade,
                        rise=_rise(lane, s, inside),
                        s=s,
                    )
                )
                t, inner = beyond, outer


def _across(
    heading: np.ndarray, roll: np.ndarray, width: np.ndarray
) -> np.ndarray:
    """Returns the steps (N, 3) across the road to the left, of a width (N,)."""
    left = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    flat = left * (width * np.cos(roll))[:, None]
    return np.column_stack([flat, width * np.sin(roll)])


def _rise(lane: Lane, s: np.ndarray, inside: np.ndarray) -> np.ndarray:
    if not lane.inner_height:
        return np.full((len(s), 2), np.nan)
    both = lane.inner_height, lane.outer_height
    return np.stack([one.at(s, inside) for one in both], axis=1)


def _band(band: LaneBand) -> LaneBand:
    """Returns a lane with its own height, if it is at road level."""
    if not band.lane.inner_height or is_raised(band.kind, band.lane.height):
        return band
    up = np.array([0.0, 0.0, 1.0])
    inner = band.inner + band.rise[:, :1] * up
    outer = band.outer + band.rise[:, 1:] * up
    return replace(band, inner=inner, outer=outer, middle=(inner + outer) / 2.0)


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


def _cubics_of(section: LaneSection) -> list[Cubics]:
    return [
        one
        for lane in section.lanes.values()
        for one in (lane.width, lane.border, lane.inner_height)
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
        start: where the first place is [m].
        end: where the last place is [m].
        more: functions along the road whose shape matters in addition to the
            shape of the road.

    Returns:
        (N,) distances along the road, and (N,) distances that select the piece
        of the road (see `ImportedRoad.reference`) [m].

    Raises:
        ValueError: there are too many places.
    """
    cubics: list[Cubics] = [
        road.elevation,
        road.superelevation,
        road.lane_offset,
        *more,
    ]
    joints = np.concatenate(
        [
            [start, end],
            [piece.s for piece in road.pieces],
            *(one.starts for one in cubics),
        ]
    )
    joints = np.unique(np.clip(joints, start, end))
    between = joints[
        (joints > start + 4.0 * _INWARDS) & (joints < end - 4.0 * _INWARDS)
    ]
    between = between[np.diff(between, prepend=-math.inf) > 4.0 * _INWARDS]
    ends = np.concatenate([[start], between, [end]])
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


def split_levels(
    bands: Sequence[LaneBand],
) -> tuple[list[LaneBand], list[LaneBand]]:
    """Returns the lanes on the ground and the lanes on bridges.

    A lane that leads onto a bridge is cut at the bridge's end.
    """
    raised = _raised_places(bands)
    ground: list[LaneBand] = []
    bridges: list[LaneBand] = []
    for band in bands:
        above = raised.get(band.road.name)
        if above is None:
            ground.append(band)
            continue
        low, high = np.searchsorted(
            above, [band.s - _BRIDGE_REACH, band.s + _BRIDGE_REACH]
        )
        is_bridge = high > low
        for run, carried in _stretches_of_one_level(is_bridge):
            parts = {name: getattr(band, name)[run] for name in _ARRAYS}
            (bridges if carried else ground).append(replace(band, **parts))
    return ground, bridges


def _raised_places(bands: Sequence[LaneBand]) -> dict[str, np.ndarray]:
    """Returns road -> distances at which it passes over another road [m].

    The distances are increasing.
    """
    names = {band.road.name: k for k, band in enumerate(bands)}
    rows = []
    for band in bands:
        wide = band.width > _LEAST_WIDTH
        for edge in (band.inner, band.middle, band.outer):
            owner = np.full(len(band.s), names[band.road.name])
            rows.append(np.column_stack([edge, band.s, owner])[wide])
    places = np.concatenate(rows) if rows else np.zeros((0, 5))
    if len(places) == 0 or np.ptp(places[:, 2]) < _HEADROOM:
        return {}
    # The highest and the lowest place of each square metre are enough.
    tree = cKDTree(places[:, :2])
    found: dict[str, list[float]] = {}
    high = np.flatnonzero(places[:, 2] > places[:, 2].min() + _HEADROOM)
    for k, near in zip(
        high,
        tree.query_ball_point(places[high, :2], _ABOVE_WITHIN),
        strict=True,
    ):
        others = places[near]
        below = others[:, 2] < places[k, 2] - _HEADROOM
        if (below & (others[:, 4] != places[k, 4])).any():
            road = bands[int(places[k, 4])].road.name
            found.setdefault(road, []).append(float(places[k, 3]))
    return {road: np.unique(some) for road, some in found.items()}


def _stretches_of_one_level(
    is_bridge: np.ndarray,
) -> Iterator[tuple[slice, bool]]:
    """Yields stretches of one level; neighbouring stretches share a place."""
    starts = np.flatnonzero(np.diff(is_bridge.astype(int), prepend=-1))
    for a, b in zip(starts, [*starts[1:], len(is_bridge)], strict=True):
        last = min(b + 1, len(is_bridge))
        if last - a > 1:
            yield slice(int(a), int(last)), bool(is_bridge[a])


class RoadHeights:
    """The height of imported carriageways, and of the ground near them.

    At a place on a single road, the height is exact. Where roads with different
    heights overlap in a junction, the height changes gradually from one road to
    the other (Shepard's interpolation between planes with the grade and roll of
    the roads).
    """

    def __init__(self, bands: Sequence[LaneBand]):
        """Takes all lanes on the ground, at least one."""
        places = np.concatenate([_places(band) for band in bands])
        self._p = places[:, :3]
        heading, roll, grade = places[:, 3:].T
        across = np.tan(roll)
        self._slope = np.stack(
            [
                grade * np.cos(heading) - across * np.sin(heading),
                grade * np.sin(heading) + across * np.cos(heading),
            ],
            axis=1,
        )
        self._tree = cKDTree(self._p[:, :2])

    @property
    def is_level(self) -> bool:
        """Whether all roads lie at z = 0."""
        return bool(
            np.abs(self._p[:, 2]).max() < _LEVEL
            and np.abs(self._slope).max() < _LEVEL
        )

    def heights(self, xy: ArrayLike) -> np.ndarray:
        """Returns the heights (N,) at places (N, 2) [m]."""
        xy = np.asarray(xy, dtype=float).reshape(-1, 2)
        blocks = [
            self._block(xy[k : k + _BLOCK]) for k in range(0, len(xy), _BLOCK)
        ]
        return np.concatenate([np.zeros(0), *blocks])

    def _block(self, xy: np.ndarray) -> np.ndarray:
        count = min(_NEIGHBOURS, len(self._p))
        distance, index = self._tree.query(xy, k=count)
        distance, index = distance.reshape(-1, count), index.reshape(-1, count)
        away = xy[:, None] - self._p[index, :2]
        z = self._p[index, 2] + (self._slope[index] * away).sum(axis=2)
        weight = 1.0 / (distance**2 + _CORE**2) ** 2
        return (z * weight).sum(axis=1) / weight.sum(axis=1)


class KerbHeights:
    """The height of imported sidewalks above the road, by place.

    The constructor takes the lanes on the ground, and the usual height of a
    kerb [m], which applies where the file states no height. An object is called
    with places (N, 2) in W [m], and returns heights (N,) [m]. `differ` says
    whether any kerb has another height than the usual height.
    """

    def __init__(self, bands: Sequence[LaneBand], usual: float):
        """Takes the lanes on the ground, and the usual height of a kerb [m].

        Kerbs without a height in the file, or away from sidewalks, have the
        usual one.
        """
        self._usual = usual
        rows = [np.zeros((0, 6))]
        for band in bands:
            if is_raised(band.kind, band.lane.height):
                rise = np.nan_to_num(band.rise, nan=usual)
                edges = [band.inner[:, :2], band.outer[:, :2], rise]
                own = _interpolated(band, np.column_stack(edges))
                wide = np.linalg.norm(own[:, :2] - own[:, 2:4], axis=1)
                rows.append(own[wide > _LEAST_WIDTH])
        places = np.concatenate(rows)
        self._inner, self._outer, self._rise = np.split(places, 3, axis=1)
        self._tree = cKDTree((self._inner + self._outer) / 2.0)
        self.differ = bool((np.abs(self._rise - usual) > _SAG).any())

    def __call__(self, xy: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) at places (N, 2) [m]."""
        distance, k = self._tree.query(xy)
        across = self._outer[k] - self._inner[k]
        width2 = (across**2).sum(axis=1)
        part = ((xy - self._inner[k]) * across).sum(axis=1) / width2
        low, high = self._rise[k].T
        own = low + np.clip(part, 0.0, 1.0) * (high - low)
        near = distance < np.sqrt(width2) / 2.0 + _BESIDE
        return np.where(near, own, self._usual)


def _places(band: LaneBand) -> np.ndarray:
    """Returns (N, 6): places in the middle, and heading, roll and grade."""
    return _interpolated(
        band,
        np.column_stack([band.middle, band.heading, band.roll, band.grade]),
    )


def _interpolated(band: LaneBand, rows: np.ndarray) -> np.ndarray:
    """Returns values (N, K) of a lane, interpolated between its stations."""
    # Both sides of a joint stay, with a stretch of no length between them.
    steps = np.diff(band.s)
    counts = np.maximum(np.ceil(steps / _PLACE_SPACING).astype(int), 1)
    first = np.repeat(np.arange(len(steps)), counts)
    part = (
        np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    ) / counts[first]
    between = rows[first] + part[:, None] * (rows[first + 1] - rows[first])
    return np.concatenate([between, rows[-1:]])
