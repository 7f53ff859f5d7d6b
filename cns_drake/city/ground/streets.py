"""The surfaces of streets: carriageway, kerbs, sidewalks, medians, paint."""

from collections.abc import Iterator, Sequence
import itertools
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import MultiPolygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from cns_drake.city.geometry import (
    HeightMap,
    Mesh,
    MeshShape,
    Model,
    Part,
    Structure,
    merge_meshes,
    polygons_of,
    snap,
    surface_mesh,
    tiles,
    wall_mesh,
)
from cns_drake.roads import street_areas
from cns_drake.roads.carriageway import Areas
from cns_drake.roads.centreline import sample_stations
from cns_drake.roads.network import RoadNetwork
from cns_drake.roads.road import ENDS, Direction, End, Road

# Tag of structures that are ground. No stage may lack them.
GROUND_TAG = "ground"
# The ground is divided into squares of this size, so that each part has small
# bounds [m].
TILE = 64.0
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
# A tile whose heights differ by less than this is level [m].
_LEVEL = 1e-4
# Edges that two polygons share are found within this distance [m].
_NEAR = 0.01
_ROAD_RGB = (0.30, 0.30, 0.32)
_BAY_RGB = (0.38, 0.37, 0.38)
_KERB_RGB = (0.78, 0.77, 0.74)
_SIDEWALK_RGB = (0.66, 0.64, 0.61)
_MEDIAN_RGB = (0.47, 0.55, 0.34)


class Covering(NamedTuple):
    """A kind of ground, such as parking bays, and the area that it covers.

    Attributes:
        name: name of the structure of this ground.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        area: the area in W [m].
        rgb: colour.
        material: name of the material; by default the usual one of the class.
    """

    name: str
    semantic_class: str
    area: BaseGeometry
    rgb: tuple[float, float, float]
    material: str | None = None

    def tiles(self) -> Iterator[tuple[str, MultiPolygon]]:
        """Yields the name and the polygons of each square tile of the area."""
        for k, piece in enumerate(tiles(self.area, TILE)):
            yield f"tile_{k:02d}", piece

    def surface(
        self, height: HeightMap | float, spacing: float = 0.0
    ) -> Structure:
        """Returns the surface as a structure with one part per tile.

        `height` is one height or a height map [m]. To follow a height map, give
        the distance between vertices as `spacing` [m]; with 0, the surface has
        only the vertices of the area's outline.
        """
        return self.structure(
            {
                part: surface_mesh(piece, height, spacing)
                for part, piece in self.tiles()
            }
        )

    def structure(self, pieces: dict[str, Mesh]) -> Structure:
        """Returns a structure of this kind, made of meshes given in W.

        `pieces` maps the name of a part to its mesh. Meshes without faces,
        which come from slivers, are left out.
        """
        pieces = {part: mesh for part, mesh in pieces.items() if mesh.faces}
        meshes = {f"{self.name}_{part}": mesh for part, mesh in pieces.items()}
        parts = tuple(
            Part(part, MeshShape(mesh), rgb=self.rgb, material=self.material)
            for part, mesh in zip(pieces, meshes, strict=True)
        )
        model = Model(parts, meshes, self.area)
        origin = (0.0, 0.0, 0.0)
        return Structure(
            self.name, self.semantic_class, model, origin, tags=(GROUND_TAG,)
        )


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
        street_areas.RoadSurface(network),
        kerb_height(network),
        [parking_bays(bays)],
    )


def street_surfaces(
    areas: Areas,
    surface: street_areas.SurfaceHeights,
    kerb: float | street_areas.KerbMap,
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
        _surface(Covering("carriageway", "road", road_part, _ROAD_RGB), road),
        *(_surface(one, road) for one in coverings),
        _kerb_structure(kerbs, paved, road, walk),
        _surface(walks, walk, outer),
        _surface(Covering("medians", "terrain", green, _MEDIAN_RGB), walk),
    ]
    return [structure for structure in structures if structure.model.parts]


def kerb_area(paved: BaseGeometry) -> MultiPolygon:
    """Returns the area of the kerb stones along a carriageway, in W [m].

    `paved` is the area of the carriageway.
    """
    grown = paved.buffer(_KERB_WIDTH, join_style="mitre")
    return MultiPolygon(polygons_of(snap(grown.difference(paved))))


def _street_heights(
    surface: street_areas.SurfaceHeights, kerb: float | street_areas.KerbMap
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


def _surface(
    ground: Covering,
    height: HeightMap | float,
    edge: BaseGeometry | None = None,
) -> Structure:
    """Returns the upper side of streets, with edging stones on slopes.

    The stones stand along the line `edge` in W [m].
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
    """Returns the edging stones along the part of `edge` beside a piece."""
    rim = piece.buffer(1.0, join_style="mitre").difference(piece)
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
    """Yields the name, polygons, height and mesh spacing [m] of each tile."""
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
    """Returns by how much a widely spaced mesh misses the slope [m]."""
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


_RGB = (0.80, 0.79, 0.74)
# Paint lies this high above the road, so that they are not in one plane [m].
_THICKNESS = 0.004
_LINE_WIDTH = 0.14
# Length of a dash of a lane line [m].
_DASH = 3.0
# Length of the gap behind a dash [m].
_GAP = 6.0
# Lane lines are divided into pieces of at most this length, to follow curves
# [m].
_PIECE = 4.0
# On slopes all paint is divided into pieces of this length [m].
_SLOPE_PIECE = 1.0
# From a junction's edge to both sides of its crossing [m].
_CROSSING = (0.8, 3.8)
# From a junction's edge to both sides of the stop line behind its crossing [m].
_STOP_LINE = (4.8, 5.2)
# Width of a bar of a crossing [m].
_BAR = 0.5
# Distance from bar to bar [m].
_BAR_STEP = 1.1
# Roads that are shorter than this between their junctions get no markings [m].
_LEAST_LENGTH = 2 * _STOP_LINE[1] + 4.0


def marking_structure(network: RoadNetwork) -> Structure:
    """Returns the painted markings of all roads, with one part per road."""
    pieces = {}
    for name, road in network.roads.items():
        strips = list(_lane_lines(road))
        for end in ENDS:
            if _is_junction(network, road, end):
                strips += _end_marks(road, end)
        if road.length > _LEAST_LENGTH and strips:
            pieces[name] = merge_meshes(
                *(_painted_strip(road, *s) for s in strips)
            )
    lanes = network.areas.lane_area
    ground = Covering("markings", "road", lanes, _RGB, "markings")
    return ground.structure(pieces)


def _is_junction(network: RoadNetwork, road: Road, end: End) -> bool:
    """Returns whether the road ends in a junction, not just in another road."""
    return len(network.junctions[getattr(road, end)].arms) > 2


def _lane_lines(road: Road) -> Iterator[tuple[float, float, float, float]]:
    """Yields the strips of lane lines: two stations, right and left offset [m].

    The stations are where the strip begins and ends along the road.
    """
    first = road.first_station + _STOP_LINE[1]
    last = road.last_station - _STOP_LINE[1]
    for direction, count in road.lanes.items():
        for lane in range(1, count):
            inner = road.lane_offset(direction, lane)
            outer = road.lane_offset(direction, lane + 1)
            for s in np.arange(first, last - _DASH, _DASH + _GAP).tolist():
                yield s, s + _DASH, *_across((inner + outer) / 2)
    if all(road.lanes.values()) and road.median == 0:
        between = (
            road.lane_offset("forward", 1) + road.lane_offset("backward", 1)
        ) / 2
        stations = np.arange(first, last, _PIECE).tolist()
        for side in (-1, 1):
            offset = between + side * _LINE_WIDTH
            for s in stations:
                yield s, min(s + _PIECE, last), *_across(offset)


def _end_marks(
    road: Road, end: End
) -> Iterator[tuple[float, float, float, float]]:
    """Yields the strips of a crossing and of the stop line behind it [m].

    They have the same form as in `_lane_lines`.
    """
    edge = road.half_width
    for right in np.arange(-edge + 0.4, edge - _BAR, _BAR_STEP).tolist():
        # Where a median reaches into the crossing, bars are left out.
        if not road.median or abs(right + _BAR / 2) > road.median / 2 + _BAR:
            yield *_from_end(road, end, _CROSSING), right, right + _BAR
    incoming: Direction = "forward" if end == "end" else "backward"
    count = road.lanes[incoming]
    if count:
        lanes = range(1, count + 1)
        offsets = [road.lane_offset(incoming, lane) for lane in lanes]
        half = road.lane_width / 2
        yield (
            *_from_end(road, end, _STOP_LINE),
            min(offsets) - half + 0.1,
            max(offsets) + half - 0.1,
        )


def _across(offset: float) -> tuple[float, float]:
    return offset - _LINE_WIDTH / 2, offset + _LINE_WIDTH / 2


def _from_end(
    road: Road, end: End, distances: tuple[float, float]
) -> tuple[float, float]:
    near, far = distances
    if end == "start":
        return road.first_station + near, road.first_station + far
    return road.last_station - far, road.last_station - near


def _painted_strip(
    road: Road, first: float, last: float, right: float, left: float
) -> Mesh:
    """Returns a strip of paint between two stations and two offsets [m]."""
    if np.ptp(road.height([first, (first + last) / 2, last])) > 0:
        ends = sample_stations(first, last, _SLOPE_PIECE)
        pairs = itertools.pairwise(ends)
        faces = (_painted_face(road, *pair, right, left) for pair in pairs)
        return merge_meshes(*faces)
    return _painted_face(road, first, last, right, left)


def _painted_face(
    road: Road, first: float, last: float, right: float, left: float
) -> Mesh:
    """Returns one plane face between two stations and two offsets [m].

    The face lies above the road by the thickness of the paint.
    """
    corners = np.concatenate(
        [
            road.evaluate([first, last], right)[:, :3],
            road.evaluate([last, first], left)[:, :3],
        ]
    )
    corners[:, 2] += _THICKNESS
    return Mesh(corners, ((0, 1, 2, 3),))
