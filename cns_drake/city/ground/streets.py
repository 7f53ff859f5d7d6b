"""The surfaces of streets: carriageway, bays, kerbs, sidewalks, medians."""

from __future__ import annotations

from shapely.geometry import MultiPolygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.polygons import (
    polygons_of,
    snap,
    surface_mesh,
    tiles,
    wall_mesh,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part, Structure
from cns_drake.city.roads.network import RoadNetwork

# Marks the structures that are ground: no stage lacks them.
GROUND_TAG = "ground"
# The ground is cut into squares of this size, so that no part is so large
# that its bounds say nothing about where it is [m].
TILE = 64.0
# Width of the kerb stones [m].
_KERB_WIDTH = 0.15

_ROAD_RGB = (0.30, 0.30, 0.32)
_BAY_RGB = (0.38, 0.37, 0.38)
_KERB_RGB = (0.78, 0.77, 0.74)
_SIDEWALK_RGB = (0.66, 0.64, 0.61)
_MEDIAN_RGB = (0.47, 0.55, 0.34)


def street_structures(network: RoadNetwork) -> list[Structure]:
    """Returns the ground of all streets, the carriageway at z = 0.

    Kinds of ground that these streets do not have are left out.
    """
    height = kerb_height(network)
    medians = snap(network.medians())
    paved = snap(network.carriageway()).difference(medians)
    bays = snap(unary_union(list(network.parking_bays().values())))
    kerbs = MultiPolygon(
        polygons_of(
            snap(
                paved.buffer(_KERB_WIDTH, join_style="mitre").difference(paved)
            )
        )
    )
    sidewalks = snap(network.sidewalks()).difference(kerbs)
    structures = [
        ground_structure(
            "carriageway", "road", paved.difference(bays), 0.0, _ROAD_RGB
        ),
        ground_structure("parking_bays", "parking", bays, 0.0, _BAY_RGB),
        _kerb_structure(kerbs, paved, height),
        ground_structure(
            "sidewalks", "sidewalk", sidewalks, height, _SIDEWALK_RGB
        ),
        ground_structure(
            "medians",
            "terrain",
            medians.difference(kerbs),
            height,
            _MEDIAN_RGB,
        ),
    ]
    return [structure for structure in structures if structure.model.parts]


def kerb_height(network: RoadNetwork) -> float:
    """Returns how far kerbs stand above the carriageway [m]."""
    return max(road.kerb_height for road in network.roads.values())


def ground_structure(
    name: str,
    semantic_class: str,
    area: BaseGeometry,
    height,
    rgb: tuple[float, float, float],
    spacing: float = 0.0,
) -> Structure:
    """Returns the upper side of an area, one part a tile.

    Args:
        name: of the structure; also stem of its mesh names.
        semantic_class: of the structure.
        area: polygons in W [m].
        height: in W [m], or a height map.
        rgb: colour.
        spacing: of the mesh that follows a height map [m]; 0: only the
            polygons' own vertices.
    """
    pieces = {
        f"tile_{k:02d}": surface_mesh(piece, height, spacing)
        for k, (_, _, piece) in enumerate(tiles(area, TILE))
    }
    return as_structure(name, semantic_class, pieces, area, rgb)


def as_structure(
    name: str,
    semantic_class: str,
    pieces: dict[str, Mesh],
    area: BaseGeometry,
    rgb: tuple[float, float, float],
) -> Structure:
    """Returns a structure of meshes that are given in W already."""
    meshes = {f"{name}_{part}": mesh for part, mesh in pieces.items()}
    parts = tuple(
        Part(part, MeshShape(f"{name}_{part}"), rgb=rgb) for part in pieces
    )
    model = Model(parts, meshes, area)
    origin = (0.0, 0.0, 0.0)
    return Structure(name, semantic_class, model, origin, tags=(GROUND_TAG,))


def _kerb_structure(
    kerbs: BaseGeometry, paved: BaseGeometry, height: float
) -> Structure:
    pieces = {}
    for k, (_, _, piece) in enumerate(tiles(kerbs, TILE)):
        top = surface_mesh(piece, height)
        # The upstand faces the carriageway, so it is the carriageway's rim
        # seen from inside, where this tile's kerb stones border on it.
        near = piece.buffer(0.01)
        upstand = wall_mesh(paved, 0.0, height, along=near)
        pieces[f"tile_{k:02d}"] = merge_meshes([top, upstand])
    return as_structure("kerbs", "sidewalk", pieces, kerbs, _KERB_RGB)
