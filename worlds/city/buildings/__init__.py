"""Buildings of every archetype, random or fixed (landmarks).

An archetype is a kind of building. `archetypes.yaml` contains the limits of
size and the colours of each archetype, and a subclass of `Building` samples and
builds its buildings. The module of this subclass has the archetype's name; only
landmarks share a module, since their models come from files. To add an
archetype, write an entry of `archetypes.yaml` and a subclass. `sample` returns
one building:

    footprint = shapely.box(-12, -9, 12, 9)     # front: the edge of least y
    model = sample("brick_block", footprint, 24.0, rng, name="block_003")
"""

from collections.abc import Collection
import importlib
from pathlib import Path

import numpy as np
from shapely.geometry import Polygon

from evaluation.base import parse_yaml
from worlds.city.buildings.landmarks import LANDMARKS, Landmark
from worlds.city.facades.building import Archetype, Building
from worlds.shapes import Model, Site

__all__ = ["ARCHETYPES", "sample"]

# Name of an archetype -> its description.
ARCHETYPES = {
    name: Archetype(name=name, **values)
    for name, values in parse_yaml(
        Path(__file__).with_name("archetypes.yaml").read_bytes()
    ).items()
    if name != "shared"
}


def sample(
    archetype: str,
    footprint: Polygon,
    height: float,
    rng: np.random.Generator,
    name: str = "building",
    blind_edges: Collection[int] = (),
) -> Model:
    """Returns a building of an archetype, with random parameters.

    Args:
        archetype: key of `ARCHETYPES`.
        footprint: ground of the building, in the building's frame S [m]. The
            front is the edge between its first two corners; for a rectangle,
            the edge of least y. Eaves, balconies and canopies extend beyond the
            footprint by at most the archetype's `overhang`.
        height: height of the parapet, ridge or spire [m]. Only roof equipment
            and chimneys may rise above it.
        rng: random generator for all parameters.
        name: name of the structure, with which the names of the building's own
            meshes begin.
        blind_edges: edges of the footprint towards neighbours, numbered
            counter-clockwise from the front. No part crosses these edges: along
            these edges, the building has plain walls or keeps a distance.

    Raises:
        ValueError: the archetype needs a rectangular footprint, or cannot be
            built with this footprint or height.
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
    building = _class_of(archetype)(kind, site, height, rng)
    building.build()
    return building.to_model(footprint)


def _class_of(archetype: str) -> type[Building]:
    """Returns the class of an archetype, such as `RowHouse` of `row_house`."""
    if archetype in LANDMARKS:
        return Landmark
    module = importlib.import_module(f"{__name__}.{archetype}")
    return getattr(module, archetype.title().replace("_", ""))
