"""All kinds of small objects with which a city can be furnished, by name."""

from collections.abc import Mapping

import numpy as np

from worlds.shapes.object_models import Builder
from worlds.shapes.objects.fences import FENCES
from worlds.shapes.objects.object_data import ONE_MESH
from worlds.shapes.objects.parked_cars import PARKED_CARS
from worlds.shapes.objects.planters import PLANTERS
from worlds.shapes.objects.plants import TREES
from worlds.shapes.objects.site_equipment import SITE_EQUIPMENT
from worlds.shapes.objects.squares import SQUARES
from worlds.shapes.objects.street_furniture import STREET_FURNITURE
from worlds.shapes.objects.street_lights import STREET_LIGHTS
from worlds.shapes.objects.traffic_signals import TRAFFIC_SIGNALS
from worlds.shapes.objects.traffic_signs import TRAFFIC_SIGNS


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
