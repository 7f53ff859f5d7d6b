"""Shops of one storey: strips of shops, rows of kiosks and supermarkets."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Patch,
    Roof,
    WallFrame,
    Wing,
    bays,
    boards,
    canopies,
    equip_roof,
    outlines,
    piers,
    roofs,
    solids,
    wing_walls,
)

# Kept free in front for canopies [m].
_FRONT_M = 0.4
# Kept free behind for gutters [m].
_BACK_M = 0.1


class ShopStrip(Building):
    """The strip of shops: low flat-roofed units side by side, all different."""

    def draw(self) -> None:
        """Samples sizes and style."""
        # Height of the shops without their parapets.
        self.ground = round(min(self.uniform(3.6, 4.2), self.height - 0.5), 2)
        self.unit_width = self.uniform(5.5, 9.0)
        # Part of the units with an upper floor, where height allows.
        self.upper = self.uniform(0.2, 0.7)
        # Whether one canopy runs along all shops, else awnings.
        self.canopy = self.chance(0.45)
        self.canopy_reach = self.uniform(0.9, 1.3, 2)
        # Difference between parapets.
        self.steps = self.uniform(0.3, 0.6, 2)
        self.roof_items = self.draw_roof_items(
            "ac_unit ac_unit vents skylight", 1, 5
        )

    def build(self) -> None:
        """Adds all parts of the shops, side by side along the front.

        The building's site must be a rectangle.
        """
        site = self.site
        x0, y0, x1, y1 = site.bounds
        count = max(1, round((x1 - x0) / self.unit_width))
        shares = self.rng.uniform(0.8, 1.2, count)
        bounds = x0 + (x1 - x0) * np.cumsum([0.0, *shares]) / shares.sum()
        highest = self.whole(0, count)
        for k in range(count):
            blind = self.site.blind_in(k, count)
            tall = self.height > self.ground + 3.4 and (
                k == highest or self.chance(self.upper)
            )
            top = self.height if k == highest else _parapet_top(self, tall)
            back = y1 - _BACK_M - self.uniform(0.0, 0.12) * (y1 - y0)
            area = (bounds[k], y0 + _FRONT_M, bounds[k + 1], back)
            roof = Roof("flat", parapet=min(0.5, top - self.ground - 0.1))
            wing = Wing.at(area, top - 0.1, top, roof, blind)
            _add_unit(self, wing, tall)
            if k % 3 == 0:
                part = f"unit_{k}_"
                equip_roof(
                    self, wing.outline, wing.floor, self.roof_items, prefix=part
                )


def _parapet_top(p: ShopStrip, tall: bool) -> float:
    """Returns the parapet's height for a unit that is not the highest [m]."""
    drop = p.steps * p.whole(0, 3)
    if tall or p.height < p.ground + 3.4:
        return round(max(p.height - drop, p.ground + 0.4), 2)
    return round(p.ground + 0.5 + 0.5 * drop, 2)


def _add_unit(p: ShopStrip, wing: Wing, tall: bool) -> None:
    openings = Openings(p, wing)
    wall = wing.wall(0)
    cladding = "walls" if p.chance(0.5) else "facing"
    upper_floors = round((wing.top - p.ground - 0.6) / 3.0) if tall else 0
    storey = (wing.top - 0.5 - p.ground) / max(upper_floors, 1)
    width = p.uniform(1.1, 2.2, 2)
    openings.add_window_storeys(
        (0, 2), p.ground, storey, upper_floors, width + 1.1, width,
        head=min(2.3, storey - 0.4),
    )  # fmt: skip
    openings.add_shops(0, 0.2, wall.length - 0.2, p.ground,
        width=9.0, awnings=0.0 if p.canopy else 0.7, reach=p.canopy_reach,
    )  # fmt: skip
    back = [bays.gate(2.0, 2.2, 0.2), wing_walls.sash(1.0, 0.0, 1.6, 2.3)]
    openings.add_bays((2,), 0.5, 3.6, back, 0.7)
    glass = (wing_walls.GLASS_M, *wing_walls.SHOP_GLASS_M)
    openings.enclose(glass, (Band(0.0, 0.3, -0.05),), cladding)
    if p.canopy:
        z = p.ground - 0.95
        reach = p.canopy_reach
        lid = (0.05, wall.length - 0.05, -0.02, reach, z, z + 0.22)
        p.add_to("awning", wall.box(*lid))
    _add_parapet(p, wing, cladding)


def _add_parapet(p: ShopStrip, wing: Wing, cladding: str) -> None:
    """Adds a coping along the parapet's front, or piers at its ends."""
    wall = wing.wall(0)
    top = wing.top
    length = wall.length
    if p.chance(0.5):
        coping = (0.02, length - 0.02, -0.05, 0.12, top - 0.2, top - 0.02)
        p.add_to("trim", wall.box(*coping))
    else:
        for x in (0.25, length - 0.25):
            pier = (x - 0.22, x + 0.22, -0.05, 0.15, 0.0, top - 0.03)
            p.add_to(cladding, wall.box(*pier))
    visible = top - p.ground - 0.1 > 0.6 and top < p.height - 3.0
    if p.chance(0.4) and visible:
        sign = (0.25 * length, 0.75 * length, -0.15, 0.1, top - 0.3, top + 0.7)
        p.add_to("sign", wall.box(*sign))


_COUNTER = 1.05


class KioskRow(Building):
    """The row of kiosks: small stalls with counters behind a common arcade."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        reach = self.uniform(1.6, 2.4, 2)
        # Wanted width of a stall.
        self.stall = self.uniform(2.8, 4.2)
        self.depth = round(min(self.uniform(2.8, 4.2), site.depth - 3.0), 2)
        # Distance between groups of stalls.
        self.gap = self.uniform(0.8, 1.8, 2)
        # Stalls built wall to wall.
        self.group = self.whole(1, 4)
        self.roof = self.pick(("hip", "gable", "barrel", "shed"))
        # Reach of a roof on posts in front; 0 for awnings.
        self.arcade = reach if self.chance(0.5) else 0.0
        # Whether one stall carries a lantern.
        self.tower = self.height > 4.6 and self.chance(0.6)

    def build(self) -> None:
        """Adds all parts of the kiosks, side by side along the front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + 0.5, x1 - 0.5
        front = y0 + 2.2 if self.arcade == 0.0 else y0 + self.arcade + 0.5
        boxes = _stalls(self, left, right, front)
        tallest = len(boxes) // 2
        for k, wing in enumerate(boxes):
            _add_stall(self, wing, boxes, k)
            if k == tallest and self.tower:
                _add_lantern(self, wing)
        if self.arcade > 0:
            _add_arcade(self, (boxes[0].x0, boxes[-1].x1), front)
        slab = solids.box(left - 0.3, right + 0.3, y0 + 0.1, y1 - 0.1,
                           -solids.FOUNDATION_M, 0.12)  # fmt: skip
        self.add_to("timber", slab)


def _stalls(p: KioskRow, left: float, right: float, front: float) -> list[Wing]:
    """Returns the boxes of the stalls; the middle one is the tallest."""
    unit = p.stall + p.gap / p.group
    count = max(1, int((right - left + p.gap) / unit))
    gaps = p.gap * ((count - 1) // p.group)
    width = (right - left - gaps) / count
    roof = Roof(p.roof, p.roof in ("gable", "barrel"), 0.0, 0.2, 0.15)
    if p.roof == "hip":
        roof = Roof("hip", False, 0.25, 0.0, 0.15)
    if p.roof == "shed":
        roof = Roof("shed", False, 0.25, 0.0, 0.15, falling=True)
    top = p.height - (1.1 if p.tower else 0.0)
    boxes = []
    x = left
    for k in range(count):
        high = top - (0.25 * (k % 2) if k != count // 2 else 0.0)
        wall = max(2.2, high - 0.32 * min(width, p.depth))
        area = (x, front, x + width, front + p.depth)
        boxes.append(Wing.at(area, min(wall, high - 0.35), high, roof))
        x += width + p.gap * ((k + 1) % p.group == 0)
    return boxes


def _add_stall(p: KioskRow, wing: Wing, boxes: list[Wing], k: int) -> None:
    """Adds a stall: a counter under an awning, or closed shutters."""
    openings = Openings(p, wing, boxes)
    wall = wing.wall(0)
    material = ("stalls", "others")[k % 2]
    a, b = 0.3, wall.length - 0.3
    head = min(2.15, wing.wall_top - 0.25)
    if p.chance(0.75):
        openings.add_reliefs(0, [Patch(a, b, _COUNTER, head, 0.7)])
        shelf = wall.box(a, b, -0.3, 0.3, _COUNTER - 0.08, _COUNTER)
        p.add_to("timber", shelf)
        if p.arcade == 0.0:
            shade = canopies.awning(a - 0.1, b + 0.1, 1.3, 1.95, head + 0.1)
            p.add_to("awning", wall.place(shade))
    else:
        shutter = bays.gate(b - a, head, 0.12)
        openings.add_reliefs(0, shutter(a - 0.3, b + 0.3))
    door = bays.window(0.9, 0.05, 2.0, 0.12)
    openings.add_bays((2,), 0.2, wall.length, [door], 0.3)
    sign = boards.board(a, b, head + 0.02, wing.wall_top - 0.02, 0.1)
    p.add_to("awning", wall.place(sign))
    bands = (Band(0.0, 0.25, -0.05),)
    openings.enclose((0.12,), bands, material)


def _add_lantern(p: KioskRow, wing: Wing) -> None:
    """Adds a small square lantern with its own roof."""
    low = wing.wall_top
    top = p.height
    body = outlines.square(*wing.center, 0.6)
    eaves = outlines.inset(body, -0.25)
    p.add_to("others", solids.skirt(body, body, low, top - 0.7))
    p.add_to("roof", solids.tent(eaves, wing.center, top - 0.72, top))


def _add_arcade(p: KioskRow, xs: bays.Span, front: float) -> None:
    """Adds a lean-to roof on posts along the whole row."""
    a, b = xs
    low = 2.35
    y = front - p.arcade
    top = min(2.9, p.height - 0.4)
    line = [(y - 0.15, low + 0.15), (front + 0.05, top)]
    p.add_to("roof", roofs.shell(line, a, b, 0.12))
    for x in np.linspace(a + 0.15, b - 0.15, max(2, round((b - a) / 3.2))):
        post = solids.standing(x - 0.08, x + 0.08, y, y + 0.16, low + 0.1)
        p.add_to("timber", post)
    beam = solids.box(a, b, y, y + 0.16, low - 0.15, low + 0.06)
    p.add_to("timber", beam)


_RECESS = 0.25


class Supermarket(Building):
    """The supermarket: a low hall, a glazed front under a canopy, a dock."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # Width of the entrance.
        self.entrance_width = round(
            min(self.uniform(7.0, 11.0), 0.4 * site.width), 1
        )
        self.eaves = round(min(self.uniform(5.0, 6.5), 0.75 * self.height), 2)
        # `tower` (a box), `gable` or `vault` above the doors.
        self.entrance = self.pick(("tower", "gable", "vault"))
        # Its place along the front, a part of it.
        self.entrance_at = self.uniform(0.25, 0.75)
        # Reach of the canopy along the front.
        self.canopy = self.uniform(2.2, 3.2, 2)
        # Distance between the pilasters.
        self.pitch = max(self.uniform(5.0, 7.0), site.width / 9)
        self.dock_left = self.chance(0.5)
        # Depth of the dock beside the hall; 0 for none.
        self.dock_depth = 4.5 if site.width > 32.0 and self.chance(0.8) else 0.0
        # Roofs for trolleys, in front.
        self.shelters = self.whole(0, 3)
        self.roof_items = self.draw_roof_items(
            "air_handler air_handler cooling_tower skylight skylight skylight "
            "ac_unit vents",
            4,
            9,
        )

    def build(self) -> None:
        """Adds all parts of the supermarket, with the entrance in front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left = x0 + 0.3 + self.dock_depth * self.dock_left
        right = x1 - 0.3 - self.dock_depth * (not self.dock_left)
        area = (left, y0 + self.canopy + 1.2, right, y1 - 0.3)
        hall = Wing.flat(area, self.eaves, 0.9, rim=0.2)
        openings = Openings(self, hall)
        glazing = bays.window(
            self.pitch - 0.9, 0.4, 3.3, _RECESS, mullions=2, transom=2.4
        )
        openings.add_bays((0,), 0.5, self.pitch, [glazing], 0.6)
        band = bays.window(
            self.pitch - 1.4, self.eaves - 2.3, self.eaves - 1.3, _RECESS
        )
        openings.add_bays((1, 3), 1.0, 1.6 * self.pitch, [band], 1.2)
        service = [
            bays.gate(2.6, 2.8, 0.25),
            bays.window(1.1, 0.0, 2.2, _RECESS),
        ]
        openings.add_bays((2,), 0.5, 8.0, service, 1.5)
        bands = (
            Band(0.0, 0.4, -0.06),
            Band(self.eaves - 0.7, self.eaves - 0.2, -0.08),
        )
        openings.enclose((_RECESS,), bands)
        strips = piers.pilasters(
            hall.outline, self.pitch, 0.6, 1, 0.5, 0.2, 0.0, self.eaves - 0.5
        )
        self.add_to("walls", strips)
        _add_canopy(self, hall.wall(0))
        _add_entrance(self, hall)
        if self.dock_depth:
            _add_dock(self, hall)
        _add_shelters(self, hall.wall(0))
        equip_roof(self, hall.outline, hall.floor, self.roof_items, clear=2.0)


def _add_canopy(p: Supermarket, wall: WallFrame) -> None:
    """Adds a flat canopy on posts along the front."""
    z = 3.45
    reach = p.canopy
    lid = wall.box(0.3, wall.length - 0.3, -0.05, reach, z, z + 0.4)
    p.add_to("brand", lid)
    for a, _ in bays.stretches(wall.length - 1.0, p.pitch, 0.5):
        u = 0.5 + a
        post = (u - 0.12, u + 0.12, reach - 0.5, reach - 0.26, z + 0.02)
        p.add_to("steel", wall.standing(*post))


def _add_entrance(p: Supermarket, hall: Wing) -> None:
    """Adds a porch with sliding doors, higher than the hall."""
    length = hall.width
    w = p.entrance_width
    x = float(
        np.clip(p.entrance_at * length, w / 2 + 0.5, length - w / 2 - 0.5)
    )
    top = p.height
    y0 = hall.y0 - p.canopy - 0.3
    kind, rise = {
        "tower": ("flat", 0.1),
        "gable": ("gable", 0.22 * w),
        "vault": ("barrel", 0.2 * w),
    }[p.entrance]
    wall_top = max(top - rise - 0.2, p.eaves - 0.5)
    roof = Roof(kind, True, 0.0, 0.25, 0.2, parapet=0.6)
    area = (hall.x0 + x - w / 2, y0, hall.x0 + x + w / 2, hall.y0 + 5.0)
    porch = Wing.at(area, wall_top, top, roof)
    openings = Openings(p, porch, (hall,))
    doors = bays.window(w - 2.4, 0.05, 2.6, _RECESS, mullions=3)
    openings.replace_by_bay(0, w / 2, w - 1.6, doors)
    if wall_top > 5.0:
        light = bays.window(w - 2.4, 2.95, wall_top - 1.5, _RECESS, mullions=3)
        openings.add_reliefs(0, light(0.8, w - 0.8))
    openings.enclose((_RECESS,), material="brand")
    sign = (0.2 * w, 0.8 * w, -0.02, 0.22, wall_top - 1.2, wall_top - 0.15)
    p.add_to("steel", porch.wall(0).box(*sign))


def _add_dock(p: Supermarket, hall: Wing) -> None:
    """Adds a loading dock with its roof and a wall beside the hall."""
    wall = hall.wall(3 if p.dock_left else 1)
    reach = p.dock_depth - 0.4
    # At the back end of the side wall, whose direction depends on the side.
    a, b = (1.0, 10.0) if p.dock_left else (wall.length - 10.0, wall.length - 1)
    a, b = max(a, 0.5), min(b, wall.length - 0.5)
    posts = (
        wall.box(
            u - 0.12, u + 0.12, reach - 0.27, reach - 0.03, 2.1, 4.05,
            bottom=False,
        )
        for u in (a + 0.2, b - 0.2)
    )  # fmt: skip
    screen = (a - 0.1, b + 0.1, reach - 0.3, reach, 2.2)
    p.add_to(
        "walls",
        wall.standing(a, b, -0.05, reach - 1.2, 1.1, bottom=True),
        wall.box(a - 0.1, b + 0.1, -0.05, reach, 4.0, 4.3),
        wall.standing(*screen, bottom=True),
        *posts,
    )
    for u in np.linspace(a + 2.0, b - 2.0, 2).tolist():
        p.add_to("steel", wall.box(u - 1.3, u + 1.3, -0.02, 0.12, 1.1, 3.7))


def _add_shelters(p: Supermarket, wall: WallFrame) -> None:
    """Adds curved shelters for trolleys in front of the canopy's ends."""
    y = p.canopy + 0.1
    for k in range(p.shelters):
        x = 3.2 if k == 0 else wall.length - 3.2
        a, b = x - 2.2, x + 2.2
        posts = (
            wall.standing(u - 0.06, u + 0.06, y + 0.1, y + 0.22, 2.15)
            for u in (a + 0.1, b - 0.1)
        )
        p.add_to(
            "steel",
            wall.box(a, b, y, y + 0.9, 2.1, 2.2),
            *posts,
            wall.box(a, b, y + 0.85, y + 0.9, 0.5, 1.1),
        )
