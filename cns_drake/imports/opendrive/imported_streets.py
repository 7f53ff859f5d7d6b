"""The areas of imported streets, along which a city is built.

In an OpenDRIVE junction, lanes often lack the shoulders of the roads that lead
to the junction, so that the kerb has a step where the road meets the junction.
Real kerbs have tapers instead, and this module adds such tapers.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import LinearRing, LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base.angles import wrapped
from cns_drake.city.geometry import Structure, polygons_of, snap
from cns_drake.city.ground.coverings import TILE, Covering
from cns_drake.city.ground.streets import kerb_area, parking_bays
from cns_drake.imports.foreign_city import make_imported
from cns_drake.imports.opendrive.lanes import LaneBand, is_raised, lane_class
from cns_drake.roads.carriageway import Areas, union_without_slits

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
# Slits between lanes are closed up to twice this width [m].
_SEAM = 0.05
# Vertices closer to an outline than this are dropped [m].
_SIMPLIFY = 0.005
# Ground that lanes enclose beside a junction belongs to it up to this area
# [m^2]; larger ground is an island.
_LARGEST_GAP = 60.0
_LEVEL = ("road", "parking", "sidewalk", "other-ground")
_LEAST_AREA = 1e-6
_NOWHERE = Polygon()
_ISLAND_RGB = (0.55, 0.53, 0.50)
_PATH_RGB = (0.52, 0.42, 0.38)
_DEPTH = np.array([0.0, 0.0, 0.8])  # [m]
_LEAST_CROSS = 1e-6
# How far the end of a bridge extends to both sides: wider than a kerb [m].
_END = 0.2


def kerb_tapers(carriageway: BaseGeometry) -> list[Polygon]:
    """Returns areas that turn steps in a carriageway's edge into tapers [m].

    `carriageway` is the area of the carriageway in W. The tapers lie outside of
    the carriageway.
    """
    found: list[Polygon] = []
    for polygon in polygons_of(carriageway):
        polygon = shapely.orient_polygons(polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            simple = LinearRing(ring).simplify(_CORNER_TOLERANCE)
            xy = shapely.get_coordinates(simple)[:-1]
            found += map(Polygon, _tapers(xy))
            # Reversed and mirrored, the ring has the carriageway on its left
            # again.
            mirror = np.array([-1.0, 1.0])
            found += (Polygon(a * mirror) for a in _tapers(xy[::-1] * mirror))
    return found


def _tapers(xy: np.ndarray) -> Iterator[np.ndarray]:
    """Yields the corners of tapers, where an edge steps to the left.

    The edge is a ring of corners (N, 2) with the carriageway on its left [m].
    """
    steps = np.roll(xy, -1, axis=0) - xy
    lengths = np.hypot(*steps.T)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
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
        ahead = np.array([np.cos(heading[k - 1]), np.sin(heading[k - 1])])
        aside = float(lengths[k] * np.sin(turns[k]))
        straight = before[: _straight_on(before, -ahead) + 1]
        chain = _kerb_line(behind, ahead)
        reach = np.hypot(*np.diff(straight, axis=0).T).sum()
        if reach < _KERB_BEFORE or len(chain) < 2:
            continue
        within = min(_LONGEST_TAPER, _TAPER_RATIO * aside)
        dense = shapely.get_coordinates(
            shapely.segmentize(shapely.linestrings(chain), _SPACING)
        )
        away = dense - xy[k]
        along, left = away @ ahead, away @ [-ahead[1], ahead[0]]
        reached = np.flatnonzero((along > _SPACING) & (along < within + 1e-6))
        if not len(reached):
            continue
        # The taper touches the kerb at the place that is farthest to the right
        # in its view.
        last = int(reached[np.argmin(left[reached] / along[reached])])
        yield np.concatenate([xy[k : k + 1], dense[: last + 1]])


def _straight_on(xy: np.ndarray, ahead: np.ndarray) -> int:
    """Returns how many of the first edges continue in a direction.

    The edges lie between corners (N, 2), and `ahead` (2,) is the direction.
    """
    steps = np.diff(xy, axis=0)
    goes_on = steps @ ahead > np.cos(_ASTRAY) * np.hypot(*steps.T)
    return int(np.argmin(np.append(goes_on, False)))


def _kerb_line(xy: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Returns the first corners (M, 2) of a kerb, as far as it runs straight.

    If the kerb soon steps back, the corner behind that step is the last one.

    Args:
        xy: (N, 2) corners of the kerb, a ring with the carriageway on its left
            [m].
        ahead: (2,) direction in which the kerb begins, of length 1.
    """
    last = _straight_on(xy, ahead)
    if 0 < last < len(xy) - 2 and _straight_on(xy[last + 1 :], ahead):
        step = xy[last + 1] - xy[last]
        goes_right = step @ [-ahead[1], ahead[0]] < 0.0
        if goes_right and np.hypot(*step) < _STEP[1]:
            last += 1
    return xy[: last + 1]


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
        alike: dict[str, list[BaseGeometry]] = defaultdict(list)
        in_junctions: list[BaseGeometry] = []
        for band in bands:
            area = lane_polygon(band)
            kind = lane_class(band.kind)
            if area.is_empty:
                continue
            raised = is_raised(band.kind, band.lane.height)
            if kind is None:
                alike["margins"].append(area)
                continue
            if raised:
                kind = "median" if band.kind == "median" else "walk"
            alike[kind].append(area)
            if band.road.junction is not None and not raised:
                in_junctions.append(area)
        junctions = shapely.union_all(in_junctions)
        islands = shapely.union_all([*alike["median"], *alike["walk"]])
        level = [one for kind in _LEVEL for one in alike[kind]]
        gaps = [
            gap
            for gap in _enclosed_gaps(shapely.union_all(level))
            if gap.intersects(junctions) and not gap.intersects(islands)
        ]
        road = _simplified(union_without_slits([*alike["road"], *gaps], _SEAM))
        parking = _simplified(
            shapely.union_all(alike["parking"]).difference(road)
        )
        paved = road.union(parking)
        path = _simplified(
            shapely.union_all(alike["sidewalk"]).difference(paved)
        )
        paved = paved.union(path)
        other = _simplified(
            shapely.union_all(alike["other-ground"]).difference(paved)
        )
        whole = _simplified(union_without_slits([paved, other], _SEAM))
        tapers = kerb_tapers(whole)
        whole = _simplified(union_without_slits([whole, *tapers], _SEAM))
        carriageway = _cut_at_tiles(_without_slivers(whole))
        medians = _simplified(shapely.union_all(alike["median"]))
        medians = _without_slivers(medians.difference(carriageway))
        walks = _simplified(shapely.union_all(alike["walk"]))
        taken = carriageway.union(medians)
        # A carriageway without a sidewalk, as in junctions, has a kerb that
        # takes ground, too.
        kerbs = kerb_area(carriageway.difference(medians))
        walks = walks.union(snap(kerbs.difference(kerbless)))
        sidewalks = _without_slivers(snap(walks.difference(taken)))
        self.areas = Areas(
            carriageway, _without_slivers(road), sidewalks, medians
        )
        self.junctions = shapely.union_all([junctions, *gaps])
        self.coverings = [
            parking_bays(parking),
            Covering("paths", "sidewalk", snap(path), _PATH_RGB),
            Covering("islands", "other-ground", snap(other), _ISLAND_RGB),
        ]
        taken = taken.union(sidewalks)
        margins = shapely.union_all(alike["margins"]).difference(taken)
        self.margins = _without_slivers(snap(margins))


def lane_polygon(band: LaneBand) -> BaseGeometry:
    """Returns the area of a lane in W [m]; empty for a lane without width."""
    inner, outer = band.inner[:, :2], band.outer[:, :2]
    outline = Polygon(np.concatenate([inner, outer[::-1]]))
    if outline.is_valid:
        return outline if outline.area > _LEAST_AREA else Polygon()
    # In a bend tighter than the width of the lane, its edge folds over.
    corners = np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], axis=1)
    pieces = [
        shapely.make_valid(Polygon(four), method="structure")
        for four in corners
    ]
    return shapely.union_all([p for p in pieces if p.area > _LEAST_AREA])


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
        xy = shapely.get_coordinates(ring)
        pieces = []
        for a, b in pairwise(xy):
            low, high = np.sort([a, b], axis=0)
            parts = [0.0]
            for k in range(2):
                lines = np.arange(np.ceil(low[k] / TILE) * TILE, high[k], TILE)
                parts += ((lines - a[k]) / (b[k] - a[k])).tolist()
            pieces.append(a + np.unique(parts)[:, None] * (b - a))
        return np.concatenate([*pieces, xy[-1:]])

    cut_open = [
        Polygon(cut(one.exterior), [cut(hole) for hole in one.interiors])
        for one in area.geoms
    ]
    return _without_slivers(snap(MultiPolygon(cut_open)))


def _without_slivers(area: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of an area, except slivers."""
    return MultiPolygon(polygons_of(area))


def bridge_decks(bands: Sequence[LaneBand]) -> Iterator[Structure]:
    """Yields the structures of bridges: their upper sides and undersides.

    `bands` contains the lanes on bridges.
    """
    of_road: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for band in bands:
        # The sides of parts without a lane are closed as well.
        kind = lane_class(band.kind) or "other-ground"
        left, right = band.inner, band.outer
        if band.lane.number > 0:
            left, right = right, left
        of_road[band.road.name, kind].append(_triangles_between(right, left))
        low_left, low_right = left - _DEPTH, right - _DEPTH
        of_road[band.road.name, "other-structure"] += [
            _triangles_between(low_left, low_right),
            _triangles_between(low_right, right),
            _triangles_between(left, low_left),
        ]
    for (road, kind), pieces in of_road.items():
        triangles = np.concatenate(pieces)
        edges = np.cross(
            triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        )
        triangles = triangles[np.linalg.norm(edges, axis=1) > _LEAST_CROSS]
        if len(triangles):
            yield make_imported(
                f"bridge_{road}_{kind}", kind, "Bridge", {"deck": triangles}, {}
            ).structure


def bridge_ends(bands: Sequence[LaneBand]) -> BaseGeometry:
    """Returns narrow strips across the lanes at both ends of bridges, in W [m].

    `bands` contains the lanes on bridges.
    """
    lines = [
        LineString([band.inner[k, :2], band.outer[k, :2]])
        for band in bands
        for k in (0, -1)
    ]
    return shapely.union_all(lines).buffer(_END, cap_style="flat")


def _triangles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns triangles between two lines (N, 3).

    They look upwards if the second line is on the left.
    """
    return np.concatenate(
        [
            np.stack([a[:-1], a[1:], b[1:]], axis=1),
            np.stack([a[:-1], b[1:], b[:-1]], axis=1),
        ]
    )
