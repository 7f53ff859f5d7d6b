"""Every kind of small object that a city can place, by name."""

from cns_drake.city.furniture.fences import FENCES
from cns_drake.city.furniture.monuments import MONUMENTS
from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.furniture.pavilions import PAVILIONS
from cns_drake.city.furniture.playground import PLAYGROUND
from cns_drake.city.furniture.site_equipment import SITE_EQUIPMENT
from cns_drake.city.furniture.street_furniture import STREET_FURNITURE
from cns_drake.city.furniture.street_lights import STREET_LIGHTS
from cns_drake.city.furniture.tower_crane import CRANES
from cns_drake.city.furniture.traffic_signals import TRAFFIC_SIGNALS
from cns_drake.city.geometry.object_parts import Builder
from cns_drake.city.plants.shrubs import SHRUBS
from cns_drake.city.plants.vegetation import TREES

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
