"""The range of sizes of each kind of building."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Archetype:
    """The range of sizes of a kind of building.

    Attributes:
        heights: least and greatest sensible height [m].
        widths: least and greatest sensible side of the footprint [m].
        overhang: how far eaves, balconies, canopies and pilasters reach
            outside the footprint [m]; near the ground at most
            `GROUND_OVERHANG_M`.
        any_outline: whether it follows any polygon; else rectangles only.
        party_walls: whether it can stand wall to wall with a neighbour;
            else it keeps its overhang clear of blind edges.
    """

    heights: tuple[float, float]
    widths: tuple[float, float]
    overhang: float = 1.5
    any_outline: bool = False
    party_walls: bool = False


# Plinths and pilasters may stand this far outside the footprint; above
# `HEAD_ROOM_M` the archetype's own overhang holds.
GROUND_OVERHANG_M = 0.35
HEAD_ROOM_M = 2.3

# Name of the module that builds the archetype -> its range.
ARCHETYPES = {
    "art_deco_tower": Archetype((50, 180), (18, 60)),
    "balcony_flats": Archetype((9, 33), (11, 70), 0.35),
    "banded_tower": Archetype((25, 100), (16, 60)),
    "barn": Archetype((5, 14), (7, 40), 0.35),
    "brick_block": Archetype(
        (12, 40), (10, 60), any_outline=True, party_walls=True
    ),
    "bungalow": Archetype((3.8, 8), (8, 30), 0.35),
    "car_park": Archetype((12, 36), (20, 70)),
    "chapel": Archetype((10, 30), (9, 40), 0.35),
    "church": Archetype((30, 80), (24, 70)),
    "corner_building": Archetype((20, 45), (14, 50), party_walls=True),
    "corner_store": Archetype((5, 16), (8, 30), 1.0, party_walls=True),
    "court_block": Archetype((14, 36), (22, 70)),
    "detached_house": Archetype((5, 12), (8, 26), 0.35),
    "elevated_station": Archetype((9, 16), (14, 120), 0.6),
    "gallery_flats": Archetype((12, 45), (12, 90), 0.35),
    "garden_flats": Archetype((8, 20), (12, 50), 0.35),
    "gas_station": Archetype((5, 9), (18, 50), 0.35),
    "glass_skyscraper": Archetype((70, 220), (20, 60), any_outline=True),
    "grid_tower": Archetype((28, 120), (16, 60)),
    "hotel": Archetype((25, 80), (20, 70)),
    "kiosk_row": Archetype((3.2, 8), (6, 60), 0.35),
    "mill": Archetype((12, 28), (14, 70), 0.35),
    "museum": Archetype((14, 32), (26, 90)),
    "observation_tower": Archetype((55, 160), (16, 50)),
    "office": Archetype((12, 45), (14, 70), any_outline=True, party_walls=True),
    "park_pavilion": Archetype((4, 10), (5, 24), 0.35),
    "parking_deck": Archetype((9.5, 30), (24, 100), 0.35),
    "podium_tower": Archetype((40, 130), (26, 70)),
    "row_house": Archetype((6.5, 16), (4.5, 16), 0.35, party_walls=True),
    "school": Archetype((7, 18), (20, 90), 0.35),
    "semi_detached": Archetype((6, 12), (9, 26), 0.35),
    "shop_house": Archetype((6, 18), (5.5, 30), 1.0, party_walls=True),
    "shop_strip": Archetype((4, 12), (7, 60), 1.0, party_walls=True),
    "shopping_hall": Archetype((9, 26), (28, 120), 0.35),
    "slab_tower": Archetype((30, 90), (14, 80)),
    "sports_hall": Archetype((7, 18), (18, 80), 0.35),
    "supermarket": Archetype((6, 14), (20, 90), 0.35),
    "terrace": Archetype((6, 13), (8, 50), 0.35, party_walls=True),
    "town_hall": Archetype((18, 45), (18, 60), 0.35),
    "unfinished_tower": Archetype((15, 60), (16, 50), 0.35),
    "walk_up": Archetype((8, 20), (9, 45), 0.35, party_walls=True),
    "waterfront_hall": Archetype((8, 18), (18, 110)),
}
