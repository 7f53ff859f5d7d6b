"""Which archetypes each map is built of."""

from __future__ import annotations

from cns_drake.city.buildings.art_deco_tower import ART_DECO_TOWER
from cns_drake.city.buildings.brick_block import BRICK_BLOCK
from cns_drake.city.buildings.car_park import CAR_PARK
from cns_drake.city.buildings.church import CHURCH
from cns_drake.city.buildings.corner_building import CORNER_BUILDING
from cns_drake.city.buildings.court_block import COURT_BLOCK
from cns_drake.city.buildings.detached_house import DETACHED_HOUSE
from cns_drake.city.buildings.glass_skyscraper import GLASS_SKYSCRAPER
from cns_drake.city.buildings.hotel import HOTEL
from cns_drake.city.buildings.museum import MUSEUM
from cns_drake.city.buildings.observation_tower import OBSERVATION_TOWER
from cns_drake.city.buildings.office import OFFICE
from cns_drake.city.buildings.podium_tower import PODIUM_TOWER
from cns_drake.city.buildings.provisional import plain_house
from cns_drake.city.buildings.row_house import ROW_HOUSE
from cns_drake.city.buildings.shop_house import SHOP_HOUSE
from cns_drake.city.buildings.slab_tower import SLAB_TOWER
from cns_drake.city.buildings.terrace import TERRACE
from cns_drake.city.buildings.waterfront_hall import WATERFRONT_HALL

WALK_UP = plain_house("walk_up", (8.0, 20.0), (9.0, 45.0), True)
BALCONY_FLATS = plain_house("balcony_flats", (9.0, 33.0), (11.0, 70.0))
MILL = plain_house("mill", (12.0, 28.0), (14.0, 70.0))
TOWN_HALL = plain_house("town_hall", (18.0, 45.0), (18.0, 60.0))
CHAPEL = plain_house("chapel", (10.0, 30.0), (9.0, 40.0))
BARN = plain_house("barn", (5.0, 14.0), (7.0, 40.0))
SCHOOL = plain_house("school", (7.0, 18.0), (20.0, 90.0))
KIOSK_ROW = plain_house("kiosk_row", (3.2, 8.0), (6.0, 60.0))
BUNGALOW = plain_house("bungalow", (3.8, 8.0), (8.0, 30.0))
SEMI_DETACHED = plain_house("semi_detached", (6.0, 12.0), (9.0, 26.0))
SHOP_STRIP = plain_house("shop_strip", (4.0, 12.0), (7.0, 60.0), True)
CORNER_STORE = plain_house("corner_store", (5.0, 16.0), (8.0, 30.0), True)
GARDEN_FLATS = plain_house("garden_flats", (8.0, 20.0), (12.0, 60.0))
GAS_STATION = plain_house("gas_station", (5.0, 8.0), (18.0, 50.0))
SUPERMARKET = plain_house("supermarket", (6.0, 14.0), (20.0, 90.0))
SPORTS_HALL = plain_house("sports_hall", (7.0, 18.0), (18.0, 80.0))
PARK_PAVILION = plain_house("park_pavilion", (4.0, 10.0), (5.0, 24.0))
GRID_TOWER = plain_house("grid_tower", (30.0, 120.0), (16.0, 60.0))
BANDED_TOWER = plain_house("banded_tower", (25.0, 100.0), (16.0, 60.0))
PARKING_DECK = plain_house("parking_deck", (8.0, 30.0), (24.0, 100.0))
UNFINISHED_TOWER = plain_house("unfinished_tower", (15.0, 90.0), (16.0, 60.0))
SHOPPING_HALL = plain_house("shopping_hall", (9.0, 26.0), (28.0, 120.0))
GALLERY_FLATS = plain_house("gallery_flats", (12.0, 45.0), (12.0, 90.0))
ELEVATED_STATION = plain_house("elevated_station", (9.0, 16.0), (14.0, 120.0))

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
