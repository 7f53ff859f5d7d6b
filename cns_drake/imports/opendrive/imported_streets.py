"""The areas of imported streets, along which a city is built."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import LinearRing, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry import polygons_of, snap
from cns_drake.city.ground.coverings import TILE, Covering
from cns_drake.city.ground.streets import kerb_area, parking_bays
from cns_drake.imports.opendrive.kerb_tapers import kerb_tapers
from cns_drake.imports.opendrive.lanes import LaneBand, is_raised, lane_class
from cns_drake.roads.carriageway import Areas, union_without_slits

# Slits between lanes are closed up to twice this width [m].
_SEAM = 0.05
# Vertices closer to an outline than this are dropped [m].
_SIMPLIFY = 0.005
# Ground that lanes enclose beside a junction belongs to it up to this area
# [m^2]; larger ground is an island.
_LARGEST_GAP = 60.0
# Classes of lanes at road level.
_LEVEL_CLASSES = ("road", "parking", "sidewalk", "other-ground")
# Lanes with less area are left out [m^2].
_LEAST_AREA = 1e-6
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
        alike, in_junctions = _areas_by_kind(bands)
        junctions = shapely.union_all(in_junctions)
        islands = shapely.union_all([*alike["median"], *alike["walk"]])
        level = [one for kind in _LEVEL_CLASSES for one in alike[kind]]
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


def _areas_by_kind(
    bands: Sequence[LaneBand],
) -> tuple[defaultdict[str, list[BaseGeometry]], list[BaseGeometry]]:
    """Returns areas of lanes by kind, and areas at road level in junctions.

    The kinds are the semantic classes of lanes at road level, `walk` and
    `median` for lanes above a kerb, and `margins` for lanes without a use.
    """
    alike: defaultdict[str, list[BaseGeometry]] = defaultdict(list)
    in_junctions: list[BaseGeometry] = []
    for band in bands:
        area = lane_polygon(band)
        if area.is_empty:
            continue
        kind = lane_class(band.kind)
        if kind is None:
            alike["margins"].append(area)
            continue
        raised = is_raised(band.kind, band.lane.height)
        if raised:
            kind = "median" if band.kind == "median" else "walk"
        alike[kind].append(area)
        if band.road.junction is not None and not raised:
            in_junctions.append(area)
    return alike, in_junctions


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
