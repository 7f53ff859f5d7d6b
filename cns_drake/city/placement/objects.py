"""Every kind of small object that a city can place, by name."""

from collections.abc import Mapping

import numpy as np

from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.furniture.pavilions import (
    FENCES,
    MONUMENTS,
    PAVILIONS,
    PLAYGROUND,
)
from cns_drake.city.furniture.site_equipment import CRANES, SITE_EQUIPMENT
from cns_drake.city.furniture.street_furniture import (
    STREET_FURNITURE,
    STREET_LIGHTS,
    TRAFFIC_SIGNALS,
)
from cns_drake.city.geometry.structures import Builder
from cns_drake.city.plants.vegetation import SHRUBS, TREES


def pick(weights: Mapping[str, float], rng: np.random.Generator) -> str:
    """Returns a key, drawn with the given weights in their order."""
    names = list(weights)
    p = np.array([weights[name] for name in names])
    return names[int(rng.choice(len(names), p=p / p.sum()))]


OBJECTS: dict[str, Builder] = {
    **TREES,
    **SHRUBS,
    **FENCES,
    **STREET_LIGHTS,
    **TRAFFIC_SIGNALS,
    **STREET_FURNITURE,
    **PAVILIONS,
    **MONUMENTS,
    **PLAYGROUND,
    **PARKED_CARS,
    **SITE_EQUIPMENT,
    **CRANES,
}
