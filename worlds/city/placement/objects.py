"""All kinds of small objects with which a city can be furnished, by name."""

from collections.abc import Mapping

import numpy as np

from worlds.city.furniture.fences import FENCES
from worlds.city.furniture.object_data import ONE_MESH
from worlds.city.furniture.parked_cars import PARKED_CARS
from worlds.city.furniture.planters import PLANTERS
from worlds.city.furniture.site_equipment import SITE_EQUIPMENT
from worlds.city.furniture.squares import SQUARES
from worlds.city.furniture.street_furniture import STREET_FURNITURE
from worlds.city.furniture.street_lights import STREET_LIGHTS
from worlds.city.furniture.traffic_signals import TRAFFIC_SIGNALS
from worlds.city.furniture.traffic_signs import TRAFFIC_SIGNS
from worlds.city.plants import TREES
from worlds.shapes import (
    Builder,
)


def pick_key(weights: Mapping[str, float], rng: np.random.Generator) -> str:
    """Returns a random key of `weights`, which maps keys to weights."""
    names = list(weights)
    p = np.array([weights[name] for name in names])
    return names[int(rng.choice(len(names), p=p / p.sum()))]


OBJECTS: dict[str, Builder] = {
    **TREES,
    **FENCES,
    **PARKED_CARS,
    **ONE_MESH,
    **STREET_FURNITURE,
    **STREET_LIGHTS,
    **TRAFFIC_SIGNALS,
    **TRAFFIC_SIGNS,
    **SQUARES,
    **SITE_EQUIPMENT,
    **PLANTERS,
}
