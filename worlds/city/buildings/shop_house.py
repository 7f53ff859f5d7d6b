"""The shop house: flats above shops."""

from worlds.city.buildings.house_in_row import (
    HouseInRow,
    add_roof,
    add_roof_chimney,
    front_of_site,
    wing_and_storeys,
)
from worlds.city.facades import (
    Band,
    Openings,
    Wing,
    bay_windows,
    bays,
    wing_openings,
)
from worlds.shapes import equip_roof

_ROOFS = ("flat", "gable", "gambrel")
# A narrow house can also have a roof with a gable to the street.
_NARROW_ROOFS = (*_ROOFS, "front", "stepped")

# Deeper houses have a flat roof [m].
_MOST_ROOF_DEPTH_M = 14.0
# A house narrower than this can have a gable to the street [m].
_NARROW_M = 10.0
# Greatest number of windows of the front and one side together.
_MOST_BAYS = 22
# Strip in front of the house, for awnings and signs [m].
_STOOP_M = 0.35
# Strip behind the house, for eaves [m].
_BACK_M = 0.35
# Lower houses contain nothing but shops: height above the shops [m].
_LEAST_FLATS_M = 3.2
# Least height of the walls above the shops for a storey of flats [m].
_LEAST_STOREY_M = 2.4
# Height of the wall above the ceiling of the topmost storey [m].
_WALL_ABOVE_M = 0.25
# Distance between the windows of a free side [m].
_SIDE_PITCH_M = 4.0
# Width of the stretch of the front for the door to the flats [m].
_DOOR_BAY_M = 1.7
# Distance of this door's middle from the end of the front [m].
_DOOR_END_M = 0.9
# Least width of a bay window [m].
_LEAST_ORIEL_M = 1.5
# Greatest width of a bay window [m].
_MOST_ORIEL_M = 2.4


class ShopHouse(HouseInRow):
    """The shop house: shops on the ground floor, flats above them."""

    def draw(self) -> None:
        width, depth = self.site.width, self.site.depth
        roofs = _NARROW_ROOFS if width < min(_NARROW_M, depth) else _ROOFS
        self.draw_house(
            width, roofs if depth <= _MOST_ROOF_DEPTH_M else ("flat",)
        )
        self.window_pitch = max(self.window_pitch, (width + depth) / _MOST_BAYS)
        self.stoop = _STOOP_M
        # Height of the shops. A low house contains nothing but shops.
        self.floor = self.uniform(3.5, 4.2, digits=2)
        if self.height - self.floor < _LEAST_FLATS_M:
            self.roof = "flat"
            self.floor = round(min(3.4, self.height - 1.6), 2)
        self.shop_width = self.uniform(4.5, 7.5)
        # Share of the shops with an awning.
        self.awnings = self.uniform(0.2, 0.9)
        # Greatest number of bay windows above the shops.
        self.oriels = self.whole(0, 3)
        # How far the band above the shops sticks out.
        self.course = self.uniform(0.08, 0.2, digits=2)
        self.roof_items = self.draw_roof_items(
            "stair_house vents ac_unit skylight", low=1, high=5
        )

    def build(self) -> None:
        _, y0, _, y1 = self.site.bounds
        left, right, blind = front_of_site(self)
        area = (left, y0 + self.stoop, right, y1 - _BACK_M)
        wing, storeys = wing_and_storeys(self, area, blind)
        openings = Openings(self, wing)
        ground = self.floor
        room = wing.wall_top - _WALL_ABOVE_M - ground
        upper = storeys if room > _LEAST_STOREY_M else 0
        step = room / max(upper, 1)
        sides = [k for k in (1, 3) if k not in blind]
        wing_openings.add_window_storeys(
            openings,
            [((0, 2), self.window_pitch), (sides, _SIDE_PITCH_M)],
            floor=ground,
            storey=step,
            count=upper,
            width=self.window_width,
            head=min(2.25, step - 0.4),
        )
        _add_ground(self, wing, openings)
        _add_oriels(self, wing, openings, upper, step)
        wing_openings.add_casings(openings, self.casing)
        bands = [Band(z0=round(ground - 0.3, 2), z1=ground, depth=-self.course)]
        if self.roof == "flat" and room > 0.8:
            z = round(wing.wall_top - 0.45, 2)
            bands.append(Band(z0=z, z1=wing.wall_top, depth=-0.25))
        glass = (wing_openings.GLASS_M, *wing_openings.SHOP_GLASS_M)
        openings.add_walls(glass, bands)
        add_roof(self, wing)
        if self.roof == "flat":
            equip_roof(self, wing.outline, wing.floor, self.roof_items)
        elif self.chimney:
            add_roof_chimney(self, wing, "chimney")


def _add_ground(house: ShopHouse, wing: Wing, openings: Openings) -> None:
    """Adds the shops, the door to the flats, service doors at the back."""
    length = wing.wall(0).length
    start, end = 0.0, length
    has_flats = house.floor < house.height - 3.0
    if has_flats and house.door_left:
        start = _DOOR_BAY_M
    elif has_flats:
        end = length - _DOOR_BAY_M
    wing_openings.add_shops(
        openings,
        start=start,
        end=end,
        height=house.floor,
        width=house.shop_width,
        awnings=house.awnings,
    )
    if has_flats:
        x = _DOOR_END_M if house.door_left else length - _DOOR_END_M
        wing_openings.add_door(openings, x=x, floor=0.0, height=2.3)
    back = [
        wing_openings.sash(width=1.2, z=0.0, sill=1.4, head=2.3),
        bays.gate(width=2.2, height=2.3, depth=0.2),
    ]
    openings.add_bays((2,), z=0.5, pitch=4.5, choices=back, margin=0.8)


def _add_oriels(
    house: ShopHouse, wing: Wing, openings: Openings, upper: int, step: float
) -> None:
    """Adds bay windows above the shops, in place of the windows there.

    Args:
        openings: openings of the wing.
        step: height of such a storey [m].
    """
    if upper < 1 or step < 2.5 or house.oriels == 0:
        return
    wall = wing.wall(0)
    storeys = max(1, upper - 1)
    low = round(house.floor + 0.15, 2)
    high = round(house.floor + storeys * step - 0.15, 2)
    high = min(high, wing.wall_top - 0.7)
    cells = bays.stretches(
        wall.length, pitch=wall.length / house.oriels, margin=0.4
    )
    for start, end in cells:
        width = min(_MOST_ORIEL_M, end - start - 1.2)
        if width < _LEAST_ORIEL_M:
            continue
        x = (start + end) / 2
        openings.clear(
            0,
            x0=x - width / 2 - 0.15,
            x1=x + width / 2 + 0.15,
            z0=low,
            z1=high + 0.4,
        )
        bay_windows.add_bay_window(
            house,
            wall,
            x=x,
            width=width,
            reach=0.6,
            z0=low,
            z1=high,
            storeys=storeys,
            canted=house.bay != "box",
        )
