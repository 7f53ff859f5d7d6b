"""The areas of imported streets, along which a city is built."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
import math

import numpy as np
import shapely
from shapely.geometry import LinearRing, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import arctan2, dot, length_of, wrapped
from worlds.city import TILE, Covering, kerb_area, parking_bays
from worlds.imports.opendrive.lanes import (
    LaneBand,
    is_raised,
    lane_class,
    lane_polygon,
)
from worlds.roads import Areas, union_without_slits
from worlds.shapes import polygons_of, snap

# Slits between lanes are closed up to twice this width [m].
_SEAM = 0.05
# Vertices closer to an outline than this are dropped [m].
_SIMPLIFY = 0.005
# Ground that lanes enclose beside a junction belongs to it up to this area
# [m^2]; larger ground is an island.
_LARGEST_GAP = 60.0
# Classes of lanes at road level. Where lanes overlap, the first class counts.
_LEVEL_CLASSES = ("road", "parking", "sidewalk", "other-ground")
_NOWHERE = Polygon()
_ISLAND_RGB = (0.55, 0.53, 0.50)
_PATH_RGB = (0.52, 0.42, 0.38)


class ImportedStreets:
    """The areas of the lanes on the ground in W [m], by kind of lane.

    Where lanes overlap, road takes precedence over parking, parking over other
    ground, and all of these over sidewalks.

    Attributes:
        areas: carriageway, sidewalks and medians. The carriageway is everything
            at road level; `lane_area` contains only the lanes for driving.
        junctions: the area of all junctions.
        coverings: parts of the carriageway that are not road, such as parking
            bays.
        margins: lanes without a use, on which nothing is built.
    """

    def __init__(
        self, bands: Sequence[LaneBand], kerbless: BaseGeometry = _NOWHERE
    ):
        """Finds the areas of lanes; `kerbless` is an area without kerbs [m]."""
        by_kind, in_junctions = _areas_by_kind(bands)
        junctions = shapely.union_all(in_junctions)
        gaps = _gaps_in_junctions(by_kind, junctions)
        road = _simplified(
            union_without_slits([*by_kind["road"], *gaps], _SEAM)
        )
        parking, path, other = _areas_beside(
            road, [by_kind[kind] for kind in _LEVEL_CLASSES[1:]]
        )
        paved = road.union(parking).union(path)
        carriageway = _carriageway(paved, other)
        medians = _medians(by_kind["median"], carriageway)
        kerbed = carriageway.difference(medians)
        streets = carriageway.union(medians)
        sidewalks = _sidewalks(by_kind["walk"], kerbed, kerbless, streets)
        self.areas = Areas(
            carriageway, _without_slivers(road), sidewalks, medians
        )
        self.junctions = shapely.union_all([junctions, *gaps])
        self.coverings = [
            parking_bays(parking),
            Covering("paths", "sidewalk", snap(path), _PATH_RGB),
            Covering("islands", "other-ground", snap(other), _ISLAND_RGB),
        ]
        self.margins = _margins(by_kind["margins"], streets.union(sidewalks))


def _carriageway(paved: BaseGeometry, other: BaseGeometry) -> MultiPolygon:
    """Returns everything at road level, with tapers where lanes end.

    `paved` is the area of road, parking and paths, and `other` the area of
    other ground at road level.
    """
    level = _simplified(union_without_slits([paved, other], _SEAM))
    tapered = union_without_slits([level, *kerb_tapers(level)], _SEAM)
    return _cut_at_tiles(_without_slivers(_simplified(tapered)))


def _medians(
    areas: Sequence[BaseGeometry], carriageway: BaseGeometry
) -> MultiPolygon:
    """Returns the medians outside the carriageway, from the areas of lanes."""
    medians = _simplified(shapely.union_all(areas))
    return _without_slivers(medians.difference(carriageway))


def _sidewalks(
    areas: Sequence[BaseGeometry],
    kerbed: BaseGeometry,
    kerbless: BaseGeometry,
    streets: BaseGeometry,
) -> MultiPolygon:
    """Returns the sidewalks, with kerbs where there is no lane for walking."""
    walks = _simplified(shapely.union_all(areas))
    # A carriageway without a sidewalk, as in junctions, has a kerb that takes
    # ground, too.
    kerbs = kerb_area(kerbed)
    walks = walks.union(snap(kerbs.difference(kerbless)))
    return _without_slivers(snap(walks.difference(streets)))


def _margins(
    areas: Sequence[BaseGeometry], taken: BaseGeometry
) -> MultiPolygon:
    """Returns the lanes without a use, outside the area `taken`."""
    margins = shapely.union_all(areas).difference(taken)
    return _without_slivers(snap(margins))


def _areas_by_kind(
    bands: Sequence[LaneBand],
) -> tuple[defaultdict[str, list[BaseGeometry]], list[BaseGeometry]]:
    """Returns areas of lanes by kind, and areas at road level in junctions.

    The kinds are the semantic classes of lanes at road level, `walk` and
    `median` for lanes above a kerb, and `margins` for lanes without a use.
    """
    by_kind: defaultdict[str, list[BaseGeometry]] = defaultdict(list)
    in_junctions: list[BaseGeometry] = []
    for band in bands:
        area = lane_polygon(band)
        if area.is_empty:
            continue
        kind = lane_class(band.kind)
        if kind is None:
            by_kind["margins"].append(area)
            continue
        raised = is_raised(band.kind, band.lane.height)
        if raised:
            kind = "median" if band.kind == "median" else "walk"
        by_kind[kind].append(area)
        if band.road.junction is not None and not raised:
            in_junctions.append(area)
    return by_kind, in_junctions


def _gaps_in_junctions(
    by_kind: Mapping[str, Sequence[BaseGeometry]], junctions: BaseGeometry
) -> list[Polygon]:
    """Returns the ground that lanes enclose in junctions, without islands.

    `by_kind` contains areas as in `_areas_by_kind`, and `junctions` is the area
    of all junctions in W [m].
    """
    islands = shapely.union_all([*by_kind["median"], *by_kind["walk"]])
    level = [area for kind in _LEVEL_CLASSES for area in by_kind[kind]]
    return [
        gap
        for gap in _enclosed_gaps(shapely.union_all(level))
        if gap.intersects(junctions) and not gap.intersects(islands)
    ]


def _areas_beside(
    road: BaseGeometry, areas_of_kinds: Iterable[Sequence[BaseGeometry]]
) -> Iterator[BaseGeometry]:
    """Yields the area of each kind, outside the road and the kinds before."""
    paved = road
    for areas in areas_of_kinds:
        area = _simplified(shapely.union_all(areas).difference(paved))
        yield area
        paved = paved.union(area)


def _enclosed_gaps(lanes: BaseGeometry) -> list[Polygon]:
    """Returns the gaps that lanes enclose, without those large as islands."""
    # GEOS divides by zero where lanes only touch; they enclose ground as well.
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = lanes.buffer(_SEAM, join_style="mitre")
    return [
        Polygon(hole).buffer(2.0 * _SEAM)
        for polygon in polygons_of(grown)
        for hole in polygon.interiors
        if Polygon(hole).area < _LARGEST_GAP
    ]


def _simplified(area: BaseGeometry) -> BaseGeometry:
    """Returns an area on the grid, without unnecessary vertices."""
    return snap(snap(area).simplify(_SIMPLIFY))


def _cut_at_tiles(area: MultiPolygon) -> MultiPolygon:
    """Returns an area with a corner wherever an edge leaves a tile.

    Meshes of tiles with different slopes have different spacings. A kerb on an
    edge across two such tiles would have a wall on a part of the edge only.
    """

    def cut(ring: LinearRing) -> np.ndarray:
        corners = shapely.get_coordinates(ring)
        pieces = []
        for a, b in pairwise(corners):
            low, high = np.sort([a, b], axis=0)
            shares = [0.0]
            for axis in range(2):
                first = np.ceil(low[axis] / TILE) * TILE
                lines = np.arange(first, high[axis], TILE)
                shares += ((lines - a[axis]) / (b[axis] - a[axis])).tolist()
            pieces.append(a + np.unique(shares)[:, None] * (b - a))
        return np.concatenate([*pieces, corners[-1:]])

    polygons = [
        Polygon(
            cut(polygon.exterior), [cut(hole) for hole in polygon.interiors]
        )
        for polygon in area.geoms
    ]
    return _without_slivers(snap(MultiPolygon(polygons)))


def _without_slivers(area: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of an area, except slivers."""
    return MultiPolygon(polygons_of(area))


# Least and greatest width of a step [m].
_STEP = (0.02, 2.0)
# Least length of the kerb before a step [m].
_KERB_BEFORE = 1.0
# The kerbs on both sides of a step have the same direction within this angle;
# the step itself turns by more [rad].
_ASTRAY = np.radians(45.0)
# Greatest length of a taper relative to the width of its step.
_TAPER_RATIO = 10.0
# Greatest length of a taper [m].
_LONGEST_TAPER = 6.0
# Places where a taper may end are at most this far apart [m].
_SPACING = 0.25
# Corners this close to a straight edge are dropped [m].
_CORNER_TOLERANCE = 0.005
# A taper may be longer than allowed by a rounding error [m].
_ROUNDING = 1e-6


def kerb_tapers(carriageway: BaseGeometry) -> list[Polygon]:
    """Returns areas that turn steps in a carriageway's edge into tapers [m].

    `carriageway` is the area of the carriageway in W. The tapers lie outside of
    the carriageway.
    """
    # In an OpenDRIVE junction, lanes often lack the shoulders of the roads that
    # lead to the junction, so that the kerb has a step where the road meets the
    # junction. Real kerbs have tapers instead.
    mirror = np.array([-1.0, 1.0])
    tapers: list[Polygon] = []
    for polygon in polygons_of(carriageway):
        polygon = shapely.orient_polygons(polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            simple = LinearRing(ring).simplify(_CORNER_TOLERANCE)
            xy = shapely.get_coordinates(simple)[:-1]
            tapers += map(Polygon, _tapers(xy))
            # Reversed and mirrored, the ring has the carriageway on its left
            # again, and its steps to the right are steps to the left.
            mirrored = _tapers(xy[::-1] * mirror)
            tapers += (Polygon(corners * mirror) for corners in mirrored)
    return tapers


def _tapers(xy: np.ndarray) -> Iterator[np.ndarray]:
    """Yields the corners of tapers, where an edge steps to the left.

    The edge is a ring of corners (N, 2) with the carriageway on its left [m].
    """
    steps = np.roll(xy, -1, axis=0) - xy
    lengths = np.hypot(*steps.T)
    heading = arctan2(steps[:, 1], steps[:, 0])
    turns = wrapped(heading - np.roll(heading, 1))
    is_step = (
        (lengths > _STEP[0])
        & (lengths < _STEP[1])
        & (turns > _ASTRAY)
        & (np.roll(turns, -1) < -_ASTRAY)
    )
    for k in np.flatnonzero(is_step):
        # The corners of the kerb before the step, the one nearest to the step
        # first.
        before = np.roll(xy[::-1], k + 1 - len(xy), axis=0)
        behind = np.roll(xy, -k - 1, axis=0)
        ahead = np.array([math.cos(heading[k - 1]), math.sin(heading[k - 1])])
        aside = float(lengths[k]) * math.sin(turns[k])
        straight = before[: _num_straight_edges(before, -ahead) + 1]
        chain = _kerb_line(behind, ahead)
        reach = length_of(straight)
        if reach < _KERB_BEFORE or len(chain) < 2:
            continue
        longest = min(_LONGEST_TAPER, _TAPER_RATIO * aside)
        dense = shapely.get_coordinates(
            shapely.segmentize(shapely.linestrings(chain), _SPACING)
        )
        away = dense - xy[k]
        along, left = (
            dot(away, ahead),
            dot(away, np.array([-ahead[1], ahead[0]])),
        )
        reached = np.flatnonzero(
            (along > _SPACING) & (along < longest + _ROUNDING)
        )
        if not len(reached):
            continue
        # The taper touches the kerb at the place that is farthest to the right
        # in its view.
        last = int(
            reached[np.argmin(np.round(left[reached] / along[reached], 6))]
        )
        yield np.concatenate([xy[k : k + 1], dense[: last + 1]])


def _num_straight_edges(xy: np.ndarray, ahead: np.ndarray) -> int:
    """Returns how many of the first edges continue in a direction.

    The edges lie between corners (N, 2), and `ahead` (2,) is the direction.
    """
    steps = np.diff(xy, axis=0)
    goes_on = dot(steps, ahead) > math.cos(_ASTRAY) * np.hypot(*steps.T)
    return int(np.argmin(np.append(goes_on, False)))


def _kerb_line(xy: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Returns the first corners (M, 2) of a kerb, as far as it runs straight.

    If the kerb soon steps back, the corner behind that step is the last corner.

    Args:
        xy: (N, 2) corners of the kerb, a ring with the carriageway on its left
            [m].
        ahead: (2,) direction in which the kerb begins, of length 1.
    """
    last = _num_straight_edges(xy, ahead)
    if 0 < last < len(xy) - 2 and _num_straight_edges(xy[last + 1 :], ahead):
        step = xy[last + 1] - xy[last]
        goes_right = ahead[0] * step[1] - ahead[1] * step[0] < 0.0
        if goes_right and np.hypot(*step) < _STEP[1]:
            last += 1
    return xy[: last + 1]
