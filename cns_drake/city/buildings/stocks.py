"""Which archetypes each map is built of."""

from __future__ import annotations

from cns_drake.city.buildings.art_deco_tower import ART_DECO_TOWER
from cns_drake.city.buildings.balcony_flats import BALCONY_FLATS
from cns_drake.city.buildings.banded_tower import BANDED_TOWER
from cns_drake.city.buildings.barn import BARN
from cns_drake.city.buildings.brick_block import BRICK_BLOCK
from cns_drake.city.buildings.bungalow import BUNGALOW
from cns_drake.city.buildings.car_park import CAR_PARK
from cns_drake.city.buildings.chapel import CHAPEL
from cns_drake.city.buildings.church import CHURCH
from cns_drake.city.buildings.corner_building import CORNER_BUILDING
from cns_drake.city.buildings.corner_store import CORNER_STORE
from cns_drake.city.buildings.court_block import COURT_BLOCK
from cns_drake.city.buildings.detached_house import DETACHED_HOUSE
from cns_drake.city.buildings.elevated_station import ELEVATED_STATION
from cns_drake.city.buildings.gallery_flats import GALLERY_FLATS
from cns_drake.city.buildings.garden_flats import GARDEN_FLATS
from cns_drake.city.buildings.gas_station import GAS_STATION
from cns_drake.city.buildings.glass_skyscraper import GLASS_SKYSCRAPER
from cns_drake.city.buildings.grid_tower import GRID_TOWER
from cns_drake.city.buildings.hotel import HOTEL
from cns_drake.city.buildings.kiosk_row import KIOSK_ROW
from cns_drake.city.buildings.mill import MILL
from cns_drake.city.buildings.museum import MUSEUM
from cns_drake.city.buildings.observation_tower import OBSERVATION_TOWER
from cns_drake.city.buildings.office import OFFICE
from cns_drake.city.buildings.park_pavilion import PARK_PAVILION
from cns_drake.city.buildings.parking_deck import PARKING_DECK
from cns_drake.city.buildings.podium_tower import PODIUM_TOWER
from cns_drake.city.buildings.row_house import ROW_HOUSE
from cns_drake.city.buildings.school import SCHOOL
from cns_drake.city.buildings.semi_detached import SEMI_DETACHED
from cns_drake.city.buildings.shop_house import SHOP_HOUSE
from cns_drake.city.buildings.shop_strip import SHOP_STRIP
from cns_drake.city.buildings.shopping_hall import SHOPPING_HALL
from cns_drake.city.buildings.slab_tower import SLAB_TOWER
from cns_drake.city.buildings.sports_hall import SPORTS_HALL
from cns_drake.city.buildings.supermarket import SUPERMARKET
from cns_drake.city.buildings.terrace import TERRACE
from cns_drake.city.buildings.town_hall import TOWN_HALL
from cns_drake.city.buildings.unfinished_tower import UNFINISHED_TOWER
from cns_drake.city.buildings.walk_up import WALK_UP
from cns_drake.city.buildings.waterfront_hall import WATERFRONT_HALL

METROPOLIS = (
    ART_DECO_TOWER,
    BRICK_BLOCK,
    CAR_PARK,
    CHURCH,
    CORNER_BUILDING,
    COURT_BLOCK,
    GLASS_SKYSCRAPER,
    HOTEL,
    MUSEUM,
    OBSERVATION_TOWER,
    OFFICE,
    PODIUM_TOWER,
    SLAB_TOWER,
    WATERFRONT_HALL,
)

# A small town at a river.
RIVERSIDE = (
    ROW_HOUSE,
    WALK_UP,
    BALCONY_FLATS,
    SHOP_HOUSE,
    MILL,
    TOWN_HALL,
    CHAPEL,
    BARN,
    SCHOOL,
    KIOSK_ROW,
    BRICK_BLOCK,
    CORNER_STORE,
    WATERFRONT_HALL,
)

# Houses with gardens around a commercial street.
SUBURBIA = (
    DETACHED_HOUSE,
    BUNGALOW,
    SEMI_DETACHED,
    TERRACE,
    SHOP_STRIP,
    CORNER_STORE,
    GARDEN_FLATS,
    GAS_STATION,
    SUPERMARKET,
    SPORTS_HALL,
    PARK_PAVILION,
    BALCONY_FLATS,
    CHAPEL,
    CHURCH,
    SCHOOL,
    SHOP_HOUSE,
    WALK_UP,
)

# An office district, and houses at its south-eastern edge.
DOWNTOWN = (
    GRID_TOWER,
    BANDED_TOWER,
    PARKING_DECK,
    UNFINISHED_TOWER,
    SHOPPING_HALL,
    GALLERY_FLATS,
    ELEVATED_STATION,
    BALCONY_FLATS,
    BRICK_BLOCK,
    BUNGALOW,
    CORNER_BUILDING,
    COURT_BLOCK,
    DETACHED_HOUSE,
    GAS_STATION,
    HOTEL,
    OFFICE,
    PODIUM_TOWER,
    SEMI_DETACHED,
    SLAB_TOWER,
    SUPERMARKET,
    TERRACE,
)
