"""The surfaces of streets: carriageway, kerbs, sidewalks and medians."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import MultiPolygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from worlds.city.ground.coverings import Covering
from worlds.roads import (
    Areas,
    KerbMap,
    RoadNetwork,
    RoadSurface,
    SurfaceHeights,
)
from worlds.shapes import (
    HeightMap,
    Mesh,
    Structure,
    merge_meshes,
    polygons_of,
    snap,
    surface_mesh,
    wall_mesh,
)

# Width of the kerb stones [m].
_KERB_WIDTH = 0.15
# On slopes, the vertices of meshes are this far apart [m]. The sharpest bend of
# a ramp (10 % over 1 m) is then exact to 13 mm, and most of it to 2 mm.
_SPACING = 1.0
# Spacing of vertices where the mesh hardly deviates with it [m].
_WIDE_SPACING = 4.0
# This spacing is used where the mesh deviates by less than this [m].
_LEAST_SAG = 0.004
# On slopes, edging stones of sidewalks reach this deep, so that no gap opens
# towards the coarser mesh of the ground beside them [m].
_EDGING = 0.4
# Edging stones stand on the inner edges of a rim of this width around a tile's
# polygons, whatever the width [m].
_RIM = 1.0
# A tile whose heights differ by less than this is level [m].
_LEVEL = 1e-4
# Edges that two polygons share are found within this distance [m].
_NEAR = 0.01
_ROAD_RGB = (0.30, 0.30, 0.32)
_BAY_RGB = (0.38, 0.37, 0.38)
_KERB_RGB = (0.78, 0.77, 0.74)
_SIDEWALK_RGB = (0.66, 0.64, 0.61)
_MEDIAN_RGB = (0.47, 0.55, 0.34)


def parking_bays(area: BaseGeometry) -> Covering:
    """Returns the surface of parking bays that cover an area in W [m]."""
    return Covering("parking_bays", "parking", snap(area), _BAY_RGB)


def street_structures(network: RoadNetwork) -> list[Structure]:
    """Returns the ground of a road network's streets, as structures.

    These are the carriageway, parking bays, kerbs, sidewalks and medians, at
    the heights of the roads.
    """
    bays = unary_union(list(network.areas.parking_bays.values()))
    return street_surfaces(
        network.areas,
        RoadSurface(network),
        kerb_height(network),
        [parking_bays(bays)],
    )


def street_surfaces(
    areas: Areas,
    surface: SurfaceHeights,
    kerb: float | KerbMap,
    coverings: Sequence[Covering],
    kerbless: BaseGeometry | None = None,
) -> list[Structure]:
    """Returns the structures of the ground of streets.

    These are the carriageway, its coverings, kerbs, sidewalks and medians.
    Structures without any area are left out.

    Args:
        areas: the areas of the streets in W [m].
        surface: heights of the carriageway.
        kerb: height of sidewalks and medians above the carriageway [m]: one
            number, or a function that returns the heights (N,) at places (N,
            2).
        coverings: parts of the carriageway with a surface of their own, such as
            parking bays.
        kerbless: area in W without kerbs, where streets lead onto bridges; None
            for kerbs everywhere.
    """
    road, walk = _street_heights(surface, kerb)
    medians = snap(areas.medians)
    paved = snap(areas.carriageway).difference(medians)
    covered = unary_union([one.area for one in coverings])
    kerbs = kerb_area(paved)
    if kerbless is not None:
        kerbs = MultiPolygon(polygons_of(snap(kerbs.difference(kerbless))))
    sidewalks = snap(areas.sidewalks).difference(kerbs)
    outer = unary_union([paved, kerbs, sidewalks, medians]).boundary
    road_part, green = paved.difference(covered), medians.difference(kerbs)
    walks = Covering("sidewalks", "sidewalk", sidewalks, _SIDEWALK_RGB)
    structures = [
        _surface_with_edging(
            Covering("carriageway", "road", road_part, _ROAD_RGB), road
        ),
        *(_surface_with_edging(one, road) for one in coverings),
        _kerb_structure(kerbs, paved, road, walk),
        _surface_with_edging(walks, walk, outer),
        _surface_with_edging(
            Covering("medians", "terrain", green, _MEDIAN_RGB), walk
        ),
    ]
    return [structure for structure in structures if structure.model.parts]


def kerb_area(paved: BaseGeometry) -> MultiPolygon:
    """Returns the area of the kerb stones along a carriageway, in W [m].

    `paved` is the area of the carriageway.
    """
    grown = paved.buffer(_KERB_WIDTH, join_style="mitre")
    return MultiPolygon(polygons_of(snap(grown.difference(paved))))


def _street_heights(
    surface: SurfaceHeights,
    kerb: float | KerbMap,
) -> tuple[HeightMap | float, HeightMap | float]:
    """Returns the heights of the roads and of the sidewalks beside them."""

    def road(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return surface.heights(np.column_stack([x, y]))

    if callable(kerb):
        return 0.0 if surface.is_level else road, (
            lambda x, y: road(x, y) + kerb(np.column_stack([x, y]))
        )
    if surface.is_level:
        return 0.0, kerb
    return road, lambda x, y: road(x, y) + kerb


def kerb_height(network: RoadNetwork) -> float:
    """Returns the height of the highest kerb above the carriageway [m]."""
    return max(road.kerb_height for road in network.roads.values())


def _surface_with_edging(
    ground: Covering,
    height: HeightMap | float,
    edge: BaseGeometry | None = None,
) -> Structure:
    """Returns the upper side of streets, with edging stones on slopes.

    Args:
        ground: the area of the streets.
        height: height of the upper side [m], or a function of x and y.
        edge: line in W along which the stones stand [m]; None for no stones.
    """
    pieces = {}
    for part, piece, top, spacing in _street_tiles(ground, height):
        pieces[part] = surface_mesh(piece, top, spacing)
        if edge is not None and callable(top):
            stones = _edging(piece, top, spacing, edge)
            pieces[part] = merge_meshes(pieces[part], stones)
    return ground.structure(pieces)


def _edging(
    piece: BaseGeometry, top: HeightMap, spacing: float, edge: BaseGeometry
) -> Mesh:
    """Returns the outer sides of the edging stones around a piece of a tile.

    Args:
        piece: the polygons in W [m].
        top: height of the upper side, as a function of x and y [m].
        spacing: distance between vertices along the stones [m].
        edge: line in W [m]; only outlines of the polygons on this line have
            stones.
    """
    # Walls face into their polygons. Those of the rim therefore face away from
    # the piece; `along` leaves out the walls on the rim's outer edges.
    rim = piece.buffer(_RIM, join_style="mitre").difference(piece)
    return wall_mesh(
        shapely.segmentize(rim, spacing),
        lambda x, y: top(x, y) - _EDGING,
        top,
        along=edge.intersection(piece.buffer(_NEAR)).buffer(_NEAR),
    )


def _kerb_structure(
    kerbs: BaseGeometry,
    paved: BaseGeometry,
    road: HeightMap | float,
    walk: HeightMap | float,
) -> Structure:
    ground = Covering("kerbs", "sidewalk", kerbs, _KERB_RGB, "kerb")
    pieces = {}
    for part, piece, top, spacing in _street_tiles(ground, walk):
        # The upstand faces the carriageway. It is therefore the carriageway's
        # rim, seen from inside, where the kerb stones of this tile border on
        # it.
        near = piece.buffer(_NEAR)
        rim = shapely.segmentize(paved, spacing) if spacing > 0 else paved
        upstand = wall_mesh(rim, road, top, along=near)
        pieces[part] = merge_meshes(surface_mesh(piece, top, spacing), upstand)
    return ground.structure(pieces)


def _street_tiles(
    ground: Covering, height: HeightMap | float
) -> Iterator[tuple[str, BaseGeometry, HeightMap | float, float]]:
    """Yields the name, polygons, height and mesh spacing of each tile.

    The height is one number for a level tile, and otherwise `height` itself
    [m]. The spacing is the distance between the vertices of the mesh [m]; 0, on
    level tiles, means the vertices of the outline alone.
    """
    for name, piece in ground.tiles():
        if not callable(height):
            yield name, piece, height, 0.0
            continue
        corners = shapely.get_coordinates(shapely.segmentize(piece, 2.0))
        z = height(*corners.T)
        if np.ptp(z) < _LEVEL:
            yield name, piece, float(z[0]), 0.0
        elif _sag(piece, height) < _LEAST_SAG:
            yield name, piece, height, _WIDE_SPACING
        else:
            yield name, piece, height, _SPACING


def _sag(area: BaseGeometry, height: HeightMap) -> float:
    """Returns the greatest height error of a widely spaced mesh [m]."""
    x0, y0, x1, y1 = area.buffer(1.0).bounds
    y, x = np.mgrid[y0:y1:_SPACING, x0:x1:_SPACING]
    near = shapely.dwithin(area, shapely.points(x, y), _WIDE_SPACING)
    z = np.full(x.shape, np.nan)
    z[near] = height(x[near], y[near])
    half = round(_WIDE_SPACING / _SPACING / 2)
    sags = [
        np.abs(z[: -2 * half] + z[2 * half :] - 2 * z[half:-half]) / 2
        for z in (z, z.T)
    ]
    return max(float(np.nanmax(sag, initial=0.0)) for sag in sags)
