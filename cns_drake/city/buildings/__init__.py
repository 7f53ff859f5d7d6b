"""The building stock: parametric buildings, one archetype a module; landmarks.

`sample` draws an archetype's parameters and builds it:

    footprint = shapely.box(-12, -9, 12, 9)     # front: the edge of least y
    model = sample("brick_block", footprint, 24.0, rng, name="block_003")
"""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
import pkgutil

import numpy as np
from shapely.geometry import Polygon

from cns_drake.city.buildings import blocks, houses, public, shops, towers
from cns_drake.city.buildings.archetypes import ARCHETYPES
from cns_drake.city.buildings.landmarks import LANDMARKS, add_landmark
from cns_drake.city.facades.assembly import Assembly, Dice, Site
from cns_drake.city.geometry.structures import Model

__all__ = ["ARCHETYPES", "sample"]

# Name -> module, which draws the `Parameters` of its archetype and builds it.
_MODULES = {
    module.name: import_module(f"{room.__name__}.{module.name}")
    for room in (blocks, houses, public, shops, towers)
    for module in pkgutil.iter_modules(room.__path__)
}


def sample(
    archetype: str,
    footprint: Polygon,
    height: float,
    rng: np.random.Generator,
    name: str = "building",
    blind_edges: Collection[int] = (),
) -> Model:
    """Draws one building of an archetype and builds it.

    Args:
        archetype: key of `ARCHETYPES`.
        footprint: the ground it gets, in the building's frame S [m]. Its front
            is the edge between its first two corners; for a rectangle, the edge
            of least y. Eaves, balconies and canopies reach out of it by at most
            the archetype's `overhang`.
        height: top of the building: parapet, ridge or spire; only roof
            equipment and chimneys may rise above it [m].
        rng: the only source of variation.
        name: the structure's name, which its own meshes carry.
        blind_edges: edges that nothing may cross, counter-clockwise from the
            front. The building has plain walls there, or keeps a distance.

    Raises:
        ValueError: the archetype needs a rectangle and gets none, or the
            footprint or the height is outside what it can fill.
    """
    kind = ARCHETYPES[archetype]
    height = round(height, 3)
    x0, y0, x1, y1 = footprint.bounds
    low, high = kind.widths
    sides = np.round((x1 - x0, y1 - y0), 6)
    if sides.min() < low or sides.max() > high:
        raise ValueError(f"{name}: {archetype} has sides of {low} to {high} m")
    low, high = kind.heights
    if not low <= height <= high:
        raise ValueError(f"{name}: {archetype} is {low} to {high} m high")
    site = Site(footprint, name, frozenset(blind_edges))
    if not kind.party_walls:
        site = site.detached(kind.overhang)
    if archetype in LANDMARKS:
        assembly = Assembly(site, rng)
        add_landmark(assembly, archetype, height)
        return assembly.finish(footprint)
    module = _MODULES[archetype]
    parameters = module.Parameters(Dice(site, height, rng))
    assembly = Assembly(site, rng, parameters.rgb)
    module.build(parameters, assembly)
    return assembly.finish(footprint)
