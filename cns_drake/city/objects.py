"""Every kind of small object that a city can place, by name."""

from cns_drake.city.fences import FENCES
from cns_drake.city.object_parts import Builder
from cns_drake.city.street_lights import STREET_LIGHTS
from cns_drake.city.traffic_signals import TRAFFIC_SIGNALS
from cns_drake.city.vegetation import TREES

OBJECTS: dict[str, Builder] = {
    **TREES,
    **FENCES,
    **STREET_LIGHTS,
    **TRAFFIC_SIGNALS,
}
