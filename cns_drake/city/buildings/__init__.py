"""Buildings of every archetype, random or fixed (landmarks).

An archetype is a kind of building. `archetypes.yaml` contains the limits of
size and the colours of each archetype, and a subclass of `Building` samples and
builds its buildings. To add an archetype, write an entry of `archetypes.yaml`
and a subclass, and add the subclass to `BUILDERS`. `sample` returns one
building:

    footprint = shapely.box(-12, -9, 12, 9)     # front: the edge of least y
    model = sample("brick_block", footprint, 24.0, rng, name="block_003")
"""

from collections.abc import Collection
from pathlib import Path

import numpy as np
from shapely.geometry import Polygon

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.city.buildings import (
    family_houses,
    flats,
    halls,
    markets,
    office_towers,
    open_roofs,
    public_buildings,
    row_houses,
    slabs,
    street_blocks,
    towers,
    unfinished_tower,
)
from cns_drake.city.buildings.landmarks import LANDMARKS, Landmark
from cns_drake.city.facades.assembly import Archetype, Building, Site
from cns_drake.city.geometry.models import Model

__all__ = ["ARCHETYPES", "sample"]

# Name of an archetype -> its description.
ARCHETYPES = {
    name: Archetype(name=name, **values)
    for name, values in parse_yaml(
        Path(__file__).with_name("archetypes.yaml").read_bytes()
    ).items()
    if name != "shared"
}
# Name of an archetype -> its class.
BUILDERS: dict[str, type[Building]] = {
    "art_deco_tower": towers.ArtDecoTower,
    "balcony_flats": slabs.BalconyFlats,
    "banded_tower": office_towers.BandedTower,
    "barn": halls.Barn,
    "brick_block": street_blocks.BrickBlock,
    "bungalow": family_houses.Bungalow,
    "chapel": public_buildings.Chapel,
    "corner_building": street_blocks.CornerBuilding,
    "corner_store": street_blocks.CornerStore,
    "court_block": flats.CourtBlock,
    "detached_house": family_houses.DetachedHouse,
    "gallery_flats": slabs.GalleryFlats,
    "garden_flats": flats.GardenFlats,
    "gas_station": open_roofs.GasStation,
    "glass_skyscraper": towers.GlassSkyscraper,
    "grid_tower": office_towers.GridTower,
    "hotel": towers.Hotel,
    "kiosk_row": markets.KioskRow,
    "office": street_blocks.Office,
    "park_pavilion": open_roofs.ParkPavilion,
    "podium_tower": towers.PodiumTower,
    "row_house": row_houses.RowHouse,
    "school": public_buildings.School,
    "semi_detached": family_houses.SemiDetached,
    "shop_house": row_houses.ShopHouse,
    "shop_strip": markets.ShopStrip,
    "slab_tower": slabs.SlabTower,
    "sports_hall": halls.SportsHall,
    "supermarket": markets.Supermarket,
    "terrace": row_houses.Terrace,
    "unfinished_tower": unfinished_tower.UnfinishedTower,
    "walk_up": flats.WalkUp,
    "waterfront_hall": halls.WaterfrontHall,
    **dict.fromkeys(LANDMARKS, Landmark),
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
    building = BUILDERS[archetype](kind, site, height, rng)
    building.build()
    return building.finish(footprint)
