"""Bridges: where streets or patches of land cross water."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry import (
    HeightMap,
    Structure,
    polygons_of,
    snap,
    surface_mesh,
    wall_mesh,
)
from cns_drake.city.ground.coverings import Covering, water
from cns_drake.city.ground.districts import District

# From the upper side of a bridge to its lower side [m].
_DEPTH = 1.0
# Distance of the piers from the banks [m].
_SPAN = 10.5
# Thickness of the piers [m].
_PIER = 1.2
# Edges that two polygons share are found within this distance [m].
_NEAR = 0.3
_BRIDGE_RGB = (0.62, 0.57, 0.50)


def _water_area(district: District, streets: BaseGeometry) -> BaseGeometry:
    """Returns a water district's area in W, with water below bridges [m]."""
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

    There is a bridge wherever a street crosses a district of water, and
    wherever such a district has a patch of land. The street or the patch is the
    upper side of the bridge.

    Args:
        districts: all districts of the city.
        streets: area of the streets in W [m].
        shape: function that returns the heights of the ground at x and y in W
            [m].
        water_level: height of the water [m].
    """
    structures = []
    for district in districts:
        if district.plan.ground != "water":
            continue
        river = _water_area(district, streets)
        banks = river.boundary.buffer(_NEAR)
        inner = river.buffer(-_SPAN, join_style="mitre")
        ring = inner.difference(inner.buffer(-_PIER, join_style="mitre"))
        open_water = district.grounds["water"]
        decks = polygons_of(snap(river.difference(open_water)))
        for number, deck in enumerate(decks, start=1):
            name = f"bridge_{district.plan.name}_{number:02d}"
            middle = np.array([deck.centroid.coords[0]])
            bottom = float(shape(*middle.T)[0]) - _DEPTH
            low = water_level
            beside = deck.buffer(_NEAR)
            piers = snap(deck.intersection(ring))
            pieces = {
                "sides": wall_mesh(open_water, bottom, shape, along=beside),
                "underside": surface_mesh(deck, bottom).inside_out(),
                "abutments": wall_mesh(deck, low, bottom, along=banks),
                "piers": wall_mesh(piers, low, bottom).inside_out(),
            }
            area = MultiPolygon([deck])
            bridge = Covering(name, "other-structure", area, _BRIDGE_RGB)
            below = water(f"{name}_water", area)
            structures += [
                bridge.structure(pieces),
                below.structure({"surface": surface_mesh(deck, low)}),
            ]
    return structures
