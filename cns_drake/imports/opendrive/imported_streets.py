"""The areas of imported streets, as a city is built along them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import LinearRing, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.polygons import polygons_of, snap
from cns_drake.city.ground.streets import (
    TILE,
    Covering,
    kerb_area,
    parking_bays,
)
from cns_drake.imports.opendrive.kerb_tapers import kerb_tapers
from cns_drake.imports.opendrive.lane_bands import LaneBand
from cns_drake.imports.opendrive.lane_kinds import is_raised, lane_class

# Slits up to twice this width between lanes are closed [m].
_SEAM = 0.05
# Vertices closer to an outline than this are dropped [m].
_SIMPLIFY = 0.005
# Ground that lanes enclose beside a junction is part of it up to this size
# [m^2]; larger ground is an island.
_LARGEST_GAP = 60.0
_LEVEL = ("road", "parking", "sidewalk", "other-ground")
_LEAST_AREA = 1e-6
_NOWHERE = Polygon()
_ISLAND_RGB = (0.55, 0.53, 0.50)
_PATH_RGB = (0.52, 0.42, 0.38)


class ImportedStreets:
    """Areas of lanes on the ground, by kind.

    Where two overlap, road comes before parking, that before other ground,
    and sidewalks last.

    Attributes:
        junctions: the area of all junctions [m].
        coverings: parts of the carriageway that are not road.
        margins: lanes without a use, which stay free.
    """

    def __init__(
        self, bands: Sequence[LaneBand], kerbless: BaseGeometry = _NOWHERE
    ):
        """Takes the lanes.

        Args:
            bands: the lanes.
            kerbless: area without kerbs [m].
        """
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
            for gap in _gaps(shapely.union_all(level))
            if gap.intersects(junctions) and not gap.intersects(islands)
        ]
        road = _closed([*alike["road"], *gaps])
        parking = _simple(shapely.union_all(alike["parking"]).difference(road))
        paved = road.union(parking)
        path = _simple(shapely.union_all(alike["sidewalk"]).difference(paved))
        paved = paved.union(path)
        other = _simple(
            shapely.union_all(alike["other-ground"]).difference(paved)
        )
        whole = _closed([paved, other])
        tapers = kerb_tapers(whole)
        whole = _closed([whole, *tapers])
        self._carriageway = _cut_at_tiles(_multi(whole))
        self._lanes = _multi(road)
        medians = _simple(shapely.union_all(alike["median"]))
        self._medians = _multi(medians.difference(self._carriageway))
        walks = _simple(shapely.union_all(alike["walk"]))
        taken = self._carriageway.union(self._medians)
        # Where a carriageway has no sidewalk, as in junctions, its kerb takes
        # ground as well.
        kerbs = kerb_area(self._carriageway.difference(self._medians))
        walks = walks.union(snap(kerbs.difference(kerbless)))
        self._sidewalks = _multi(snap(walks.difference(taken)))
        self.junctions = shapely.union_all([junctions, *gaps])
        self.coverings = [
            parking_bays(parking),
            Covering("paths", "sidewalk", snap(path), _PATH_RGB),
            Covering("islands", "other-ground", snap(other), _ISLAND_RGB),
        ]
        taken = taken.union(self._sidewalks)
        margins = shapely.union_all(alike["margins"]).difference(taken)
        self.margins = _multi(snap(margins))

    def carriageway(self) -> MultiPolygon:
        """Returns the area of all lanes at the height of the road."""
        return self._carriageway

    def lane_area(self) -> MultiPolygon:
        """Returns the area of the lanes that are road."""
        return self._lanes

    def sidewalks(self) -> MultiPolygon:
        """Returns the sidewalks, a kerb above the road."""
        return self._sidewalks

    def medians(self) -> MultiPolygon:
        """Returns the medians that have a kerb in the file."""
        return self._medians


def lane_polygon(band: LaneBand) -> BaseGeometry:
    """Returns the area of a lane [m]; empty for one without width."""
    inner, outer = band.inner[:, :2], band.outer[:, :2]
    outline = Polygon(np.concatenate([inner, outer[::-1]]))
    if outline.is_valid:
        return outline if outline.area > _LEAST_AREA else Polygon()
    # In a bend tighter than the lane is wide its edge folds over.
    corners = np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], axis=1)
    pieces = [
        shapely.make_valid(Polygon(four), method="structure")
        for four in corners
    ]
    return shapely.union_all([p for p in pieces if p.area > _LEAST_AREA])


def _gaps(lanes: BaseGeometry) -> list[Polygon]:
    """Returns the gaps that lanes enclose, without islands."""
    # Lanes that only touch enclose ground as well.
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = lanes.buffer(_SEAM, join_style="mitre")
    return [
        Polygon(hole).buffer(2.0 * _SEAM)
        for polygon in polygons_of(grown)
        for hole in polygon.interiors
        if Polygon(hole).area < _LARGEST_GAP
    ]


def _closed(parts: Iterable[BaseGeometry]) -> BaseGeometry:
    """Returns a union without slits between neighbours."""
    # GEOS divides by zero at edges that fold back; the result is right.
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = shapely.union_all(
            [part.buffer(_SEAM, join_style="mitre") for part in parts]
        )
        return _simple(grown.buffer(-_SEAM, join_style="mitre"))


def _simple(area: BaseGeometry) -> BaseGeometry:
    return snap(snap(area).simplify(_SIMPLIFY))


def _cut_at_tiles(area: MultiPolygon) -> MultiPolygon:
    """Returns an area with a corner wherever an edge leaves a tile.

    Tiles of different slopes have meshes of different spacing. An edge across
    two of them would get the wall of a kerb in part only.
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
    return _multi(snap(MultiPolygon(cut_open)))


def _multi(area: BaseGeometry) -> MultiPolygon:
    return MultiPolygon(polygons_of(area))
