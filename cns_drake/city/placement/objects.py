"""All kinds of small objects with which a city can be furnished, by name."""

from collections.abc import Mapping

import numpy as np

from cns_drake.city.furniture.fences import FENCES
from cns_drake.city.furniture.object_data import ONE_MESH
from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.furniture.planters import PLANTERS
from cns_drake.city.furniture.site_equipment import SITE_EQUIPMENT
from cns_drake.city.furniture.squares import SQUARES
from cns_drake.city.furniture.street_furniture import STREET_FURNITURE
from cns_drake.city.furniture.street_lights import STREET_LIGHTS
from cns_drake.city.furniture.traffic_signals import TRAFFIC_SIGNALS
from cns_drake.city.furniture.traffic_signs import TRAFFIC_SIGNS
from cns_drake.city.geometry.object_models import Builder
from cns_drake.city.plants import TREES


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
