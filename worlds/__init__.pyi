from .city import generate_city as generate_city
from .imports import ImportOptions as ImportOptions
from .imports import import_city as import_city
from .maps import MapFolder as MapFolder
from .maps import shipped_maps as shipped_maps
from .roads import load_road_network as load_road_network
