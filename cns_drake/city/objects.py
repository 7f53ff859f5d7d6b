"""Every kind of small object that a city can place, by name."""

from cns_drake.city.fences import FENCES
from cns_drake.city.monuments import MONUMENTS
from cns_drake.city.object_parts import Builder
from cns_drake.city.parked_cars import PARKED_CARS
from cns_drake.city.pavilions import PAVILIONS
from cns_drake.city.playground import PLAYGROUND
from cns_drake.city.shrubs import SHRUBS
from cns_drake.city.site_equipment import SITE_EQUIPMENT
from cns_drake.city.street_furniture import STREET_FURNITURE
from cns_drake.city.street_lights import STREET_LIGHTS
from cns_drake.city.tower_crane import CRANES
from cns_drake.city.traffic_signals import TRAFFIC_SIGNALS
from cns_drake.city.vegetation import TREES

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
