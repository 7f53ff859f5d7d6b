"""Bridges: the structure below streets and paths that cross water."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.polygons import (
    HeightMap,
    polygons_of,
    snap,
    surface_mesh,
    wall_mesh,
)
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.ground.districts import District
from cns_drake.city.ground.streets import as_structure

# From the upper side of a bridge to its lower side [m].
_DEPTH = 1.0
# Distance of the piers from the banks, and how thick they are [m].
_SPAN = 10.5
_PIER = 1.2
# Edges that two polygons share are found within this distance [m].
_NEAR = 0.3
_BRIDGE_RGB = (0.62, 0.57, 0.50)
_WATER_RGB = (0.25, 0.38, 0.45)


def water_area(district: District, streets: BaseGeometry) -> BaseGeometry:
    """Returns all of a district's water, also that below bridges, in W [m].

    Args:
        district: a district whose ground is water.
        streets: the area of all streets in W [m].
    """
    if district.plan.area is None:
        return district.area
    below = Polygon(district.plan.area).intersection(streets)
    return snap(shapely.union(district.area, below))


def bridge_structures(
    districts: Sequence[District],
    streets: BaseGeometry,
    shape: HeightMap,
    water_level: float,
) -> list[Structure]:
    """Returns the sides, undersides and piers of all bridges.

    Where a street crosses the area of a district of water, and where such a
    district has a patch of land, there is a bridge. Its upper side is that
    of the street or patch.

    Args:
        districts: with their ground.
        streets: the area of all streets in W [m].
        shape: height of everything but water.
        water_level: height of water [m].
    """
    structures = []
    for district in districts:
        if district.plan.ground != "water":
            continue
        water = water_area(district, streets)
        decks = polygons_of(snap(water.difference(district.grounds["water"])))
        for number, deck in enumerate(decks, start=1):
            name = f"bridge_{district.plan.name}_{number:02d}"
            structures += _bridge(
                name, deck, district, water, shape, water_level
            )
    return structures


def _bridge(
    name: str,
    deck: Polygon,
    district: District,
    water: BaseGeometry,
    shape: HeightMap,
    water_level: float,
) -> list[Structure]:
    """Returns a bridge and the water below it."""
    bottom = float(shape(*np.array([deck.centroid.coords[0]]).T)[0]) - _DEPTH
    inner = water.buffer(-_SPAN, join_style="mitre")
    piers = deck.intersection(
        inner.difference(inner.buffer(-_PIER, join_style="mitre"))
    )
    banks = water.boundary.buffer(_NEAR)
    surface = {"surface": surface_mesh(deck, water_level)}
    pieces = {
        "sides": wall_mesh(
            district.grounds["water"], bottom, shape, along=deck.buffer(_NEAR)
        ),
        "underside": _turned(surface_mesh(deck, bottom)),
        "abutments": wall_mesh(deck, water_level, bottom, along=banks),
        "piers": _turned(wall_mesh(snap(piers), water_level, bottom)),
    }
    pieces = {part: mesh for part, mesh in pieces.items() if mesh.faces}
    area = MultiPolygon([deck])
    return [
        as_structure(name, "other-structure", pieces, area, _BRIDGE_RGB),
        as_structure(
            f"{name}_water", "other-ground", surface, area, _WATER_RGB
        ),
    ]


def _turned(mesh: Mesh) -> Mesh:
    """Returns a mesh whose faces look to the other side."""
    return Mesh(mesh.vertices, tuple(face[::-1] for face in mesh.faces))
