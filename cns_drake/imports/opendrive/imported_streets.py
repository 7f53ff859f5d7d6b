"""The areas of imported streets, along which a city is built."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import LinearRing, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city import (
    TILE,
    Covering,
    kerb_area,
    parking_bays,
    polygons_of,
    snap,
)
from cns_drake.imports.opendrive.kerb_tapers import kerb_tapers
from cns_drake.imports.opendrive.lanes import (
    LaneBand,
    is_raised,
    lane_class,
    lane_polygon,
)
from cns_drake.roads import Areas, union_without_slits

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
    """Returns the sidewalks, with kerbs where there is no lane for walking.

    Args:
        areas: areas of the lanes for walking.
        kerbed: the area along which kerbs stand.
        kerbless: area without kerbs.
        streets: area of the carriageway and the medians.
    """
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
