"""The hotel behind its forecourt."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    balconies,
    bays,
    foot_band,
    outlines,
    solids,
    tiers,
    top_band,
)
from cns_drake.city.geometry import Finish

# Depth of the forecourt [m].
_FORECOURT_M = 7.0
_ROOF_ITEMS = ("cooling_tower", "air_handler", "mast", "vents", "ac_unit")


class Hotel(Building):
    """The hotel: balconies along rounded walls, a forecourt, a roof-top bar."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        depth = site.depth - _FORECOURT_M
        self.pitch = max(self.uniform(3.6, 4.6), site.width / 11)
        self.ground_height = self.uniform(5.0, 6.2, digits=2)
        self.storey_height = self.uniform(3.1, 3.4)
        self.round_ends = self.chance(0.5) and site.width > 1.5 * depth
        self.corner = round(self.uniform(0.2, 0.35) * min(depth, site.width), 1)
        self.side_pitch = max(2.7, (site.width + 2 * depth) / 34)
        self.recess = self.uniform(0.2, 0.35, digits=2)
        self.balcony_reach = self.uniform(1.1, 1.45, digits=2)
        self.balcony_width = round(self.uniform(0.6, 0.95) * self.pitch, 2)
        self.rail = self.uniform(0.95, 1.1, digits=2)
        self.bar_height = self.uniform(4.0, 5.0, digits=1)
        self.bar_inset = self.uniform(1.8, 3.0, digits=1)
        self.sign_left = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the hotel, which stands behind a forecourt.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + _FORECOURT_M
        if self.round_ends:
            plan = outlines.stadium(x0, front, x1, y1, step=3.2)
        else:
            block = outlines.rectangle(x0, front, x1, y1)
            plan = outlines.rounded(
                block, {0: self.corner, 1: self.corner}, step=2.8
            )
        top = _add_lobby(self, plan, y0)
        goal = self.height - self.bar_height - 1.2
        top = _add_rooms(self, plan, top, goal)
        edge = Facade(
            1.2,
            bands=(
                foot_band(height=0.3, reach=0.15),
                Band(z0=0.9, z1=1.2, depth=-0.2),
            ),
        )
        roof = tiers.add_crown(self, plan, edge, z0=top, parapet=1.1)
        bar = outlines.inset(plan, self.bar_inset)
        h = round(self.height - roof, 3)
        bands = (
            Band(z0=0.4, z1=h - 1.2, depth=0.3),
            Band(z0=h - 0.9, z1=h - 0.5, depth=-1.3),
        )
        walls = Facade(h, bands=bands, glass=(0.3,))
        items = _ROOF_ITEMS
        tiers.add_crown(
            self, bar, walls, z0=roof, parapet=0.4, part="bar", items=items
        )
        _add_sign(self, plan)


def _add_lobby(hotel: Hotel, plan: np.ndarray, y0: float) -> float:
    h = hotel.ground_height
    pane = bays.ribbon(sill=0.4, head=h - 1.2, depth=0.4, post=0.5)
    glazing = bays.rhythm(hotel.pitch, [pane], margin=0.5)
    layout = bays.with_door(
        glazing, bays.entrance(width=4.4, height=3.4, depth=1.5), width=6.4
    )
    bands = (
        foot_band(height=0.4, reach=0.1),
        Band(z0=h - 0.8, z1=h - 0.3, depth=-0.4),
    )
    # The canopy of the drive stands on four pillars in the forecourt.
    middle = float(np.mean(plan[:2, 0]))
    front = float(plan[0, 1])
    left = middle - 6.0
    right = middle + 6.0
    z = 4.2
    roof = solids.box(
        x=(left, right), y=(y0 + 0.3, front + 0.2), z=(z, z + 0.7)
    )
    pillars = [
        solids.standing(x=(x, x + 0.7), y=(y, y + 0.7), z1=z)
        for x in (left + 0.6, right - 1.3)
        for y in (y0 + 0.8, front - 2.0)
    ]
    drive = solids.standing(
        x=around(middle, 2.8), y=(front - 2.2, front), z1=0.14
    )
    lobby = Facade(h, bands=bands, layout=layout, glass=(0.4,))
    return tiers.add_ground(hotel, plan, lobby, extras=[roof, *pillars, drive])


def _add_rooms(hotel: Hotel, plan: np.ndarray, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.storey_groups(
        goal - z0, storey=hotel.storey_height, most=15
    )
    head = round(storey - 0.45, 2)
    french = bays.window(
        width=hotel.pitch - 1.2,
        sill=0.0,
        head=head,
        depth=hotel.recess,
        mullions=1,
    )
    plain = bays.window(width=1.5, sill=0.8, head=head, depth=hotel.recess)
    front_rooms = {0: bays.rhythm(hotel.pitch, [french], margin=0.4)}
    others = bays.rhythm(hotel.side_pitch, [plain], margin=0.35)
    layout = bays.by_edge(front_rooms, others)
    band = top_band(storey, height=0.12, reach=0.08)
    walls = Facade(storey, bands=(band,), layout=layout, glass=(hotel.recess,))
    front = WallFrame(plan, 0)
    rails = []
    for a, b in bays.stretches(front.length, pitch=hotel.pitch, margin=0.4):
        half = hotel.balcony_width / 2
        x = (a + b) / 2
        ends = round(x - half, 2), round(x + half, 2)
        rail = balconies.balcony(*ends, hotel.balcony_reach, 0.0, hotel.rail)
        rails.append(front.place(rail))
    return tiers.add_storeys(
        hotel,
        plan,
        walls,
        z0=z0,
        groups=groups,
        per_group=per_group,
        extras=rails,
    )


def _add_sign(hotel: Hotel, plan: np.ndarray) -> None:
    """Adds an upright sign to the front, at one end of the balconies."""
    front = WallFrame(plan, 0)
    x = 0.4 if hotel.sign_left else front.length - 0.4
    low, high = hotel.ground_height + 3.0, 0.7 * hotel.height
    blade = front.box(x=around(x, 0.15), y=(0.25, 1.3), z=(low, high))
    arms = (
        front.box(x=around(x, 0.08), y=(0.0, 0.4), z=(z, z + 0.15))
        for z in (low + 0.5, high - 0.7)
    )
    hotel.add("sign", blade, *arms, finish=Finish((0.55, 0.16, 0.14)))
