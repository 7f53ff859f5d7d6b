"""The hotel behind its forecourt."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    balconies,
    bays,
    outlines,
    solids,
    tiers,
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
        self.ground_height = self.uniform(5.0, 6.2, 2)
        self.storey_height = self.uniform(3.1, 3.4)
        self.round_ends = self.chance(0.5) and site.width > 1.5 * depth
        self.corner = round(self.uniform(0.2, 0.35) * min(depth, site.width), 1)
        self.side_pitch = max(2.7, (site.width + 2 * depth) / 34)
        self.recess = self.uniform(0.2, 0.35, 2)
        self.balcony_reach = self.uniform(1.1, 1.45, 2)
        self.balcony_width = round(self.uniform(0.6, 0.95) * self.pitch, 2)
        self.rail = self.uniform(0.95, 1.1, 2)
        self.bar_height = self.uniform(4.0, 5.0, 1)
        self.bar_inset = self.uniform(1.8, 3.0, 1)
        self.sign_left = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the hotel, which stands behind a forecourt.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + _FORECOURT_M
        if self.round_ends:
            plan = outlines.stadium(x0, front, x1, y1, 3.2)
        else:
            block = outlines.rectangle(x0, front, x1, y1)
            plan = outlines.rounded(
                block, {0: self.corner, 1: self.corner}, 2.8
            )
        top = _add_lobby(self, plan, y0)
        goal = self.height - self.bar_height - 1.2
        top = _add_rooms(self, plan, top, goal)
        edge = Facade(1.2, (Band(0.0, 0.3, -0.15), Band(0.9, 1.2, -0.2)))
        roof = tiers.add_crown(self, plan, edge, top, 1.1)
        bar = outlines.inset(plan, self.bar_inset)
        h = round(self.height - roof, 3)
        bands = (Band(0.4, h - 1.2, 0.3), Band(h - 0.9, h - 0.5, -1.3))
        walls = Facade(h, bands, glass=(0.3,))
        items = _ROOF_ITEMS
        tiers.add_crown(self, bar, walls, roof, 0.4, part="bar", items=items)
        _add_sign(self, plan)


def _add_lobby(p: Hotel, plan: np.ndarray, y0: float) -> float:
    h = p.ground_height
    pane = bays.ribbon(0.4, h - 1.2, 0.4, 0.5)
    glazing = bays.rhythm(p.pitch, [pane], margin=0.5)
    layout = bays.with_door(glazing, bays.entrance(4.4, 3.4, 1.5), 6.4)
    bands = (Band(0.0, 0.4, -0.1), Band(h - 0.8, h - 0.3, -0.4))
    # The canopy of the drive stands on four pillars in the forecourt.
    middle = float(np.mean(plan[:2, 0]))
    front = float(plan[0, 1])
    left = middle - 6.0
    right = middle + 6.0
    z = 4.2
    roof = solids.box(left, right, y0 + 0.3, front + 0.2, z, z + 0.7)
    pillars = [
        solids.standing(x, x + 0.7, y, y + 0.7, z)
        for x in (left + 0.6, right - 1.3)
        for y in (y0 + 0.8, front - 2.0)
    ]
    drive = solids.standing(
        middle - 2.8, middle + 2.8, front - 2.2, front, 0.14
    )
    lobby = Facade(h, bands, layout, (0.4,))
    return tiers.add_ground(p, plan, lobby, [roof, *pillars, drive])


def _add_rooms(p: Hotel, plan: np.ndarray, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.storey_groups(
        goal - z0, p.storey_height, 15
    )
    head = round(storey - 0.45, 2)
    french = bays.window(p.pitch - 1.2, 0.0, head, p.recess, mullions=1)
    plain = bays.window(1.5, 0.8, head, p.recess)
    front_rooms = {0: bays.rhythm(p.pitch, [french], margin=0.4)}
    others = bays.rhythm(p.side_pitch, [plain], margin=0.35)
    layout = bays.by_edge(front_rooms, others)
    band = Band(storey - 0.12, storey, -0.08)
    walls = Facade(storey, (band,), layout, (p.recess,))
    front = WallFrame(plan, 0)
    rails = []
    for a, b in bays.stretches(front.length, p.pitch, 0.4):
        half = p.balcony_width / 2
        x = (a + b) / 2
        ends = round(x - half, 2), round(x + half, 2)
        rail = balconies.balcony(*ends, p.balcony_reach, 0.0, p.rail)
        rails.append(front.place(rail))
    return tiers.add_storeys(p, plan, walls, z0, groups, per_group, rails)


def _add_sign(p: Hotel, plan: np.ndarray) -> None:
    """Adds an upright sign to the front, at one end of the balconies."""
    front = WallFrame(plan, 0)
    x = 0.4 if p.sign_left else front.length - 0.4
    low, high = p.ground_height + 3.0, 0.7 * p.height
    blade = front.box(x - 0.15, x + 0.15, 0.25, 1.3, low, high)
    arms = (
        front.box(x - 0.08, x + 0.08, 0.0, 0.4, z, z + 0.15)
        for z in (low + 0.5, high - 0.7)
    )
    p.add("sign", blade, *arms, finish=Finish((0.55, 0.16, 0.14)))
