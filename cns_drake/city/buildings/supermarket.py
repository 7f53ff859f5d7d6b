"""The supermarket."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    WallFrame,
    Wing,
    bays,
    equip_roof,
    piers,
)

# Depth of the windows behind the wall [m].
_RECESS_M = 0.25


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
        # Place of the entrance along the front, as a share of the front.
        self.entrance_at = self.uniform(0.25, 0.75)
        # Reach of the canopy along the front.
        self.canopy = self.uniform(2.2, 3.2, 2)
        # Distance between the pilasters.
        self.pitch = max(self.uniform(5.0, 7.0), site.width / 9)
        self.dock_left = self.chance(0.5)
        # Depth of the dock beside the hall; 0 for none.
        self.dock_depth = 4.5 if site.width > 32.0 and self.chance(0.8) else 0.0
        # Number of shelters for trolleys in front.
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
            self.pitch - 0.9, 0.4, 3.3, _RECESS_M, mullions=2, transom=2.4
        )
        openings.add_bays((0,), 0.5, self.pitch, [glazing], 0.6)
        band = bays.window(
            self.pitch - 1.4, self.eaves - 2.3, self.eaves - 1.3, _RECESS_M
        )
        openings.add_bays((1, 3), 1.0, 1.6 * self.pitch, [band], 1.2)
        service = [
            bays.gate(2.6, 2.8, 0.25),
            bays.window(1.1, 0.0, 2.2, _RECESS_M),
        ]
        openings.add_bays((2,), 0.5, 8.0, service, 1.5)
        bands = (
            Band(0.0, 0.4, -0.06),
            Band(self.eaves - 0.7, self.eaves - 0.2, -0.08),
        )
        openings.enclose((_RECESS_M,), bands)
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
    doors = bays.window(w - 2.4, 0.05, 2.6, _RECESS_M, mullions=3)
    openings.replace_by_bay(0, w / 2, w - 1.6, doors)
    if wall_top > 5.0:
        light = bays.window(
            w - 2.4, 2.95, wall_top - 1.5, _RECESS_M, mullions=3
        )
        openings.add_reliefs(0, light(0.8, w - 0.8))
    openings.enclose((_RECESS_M,), material="brand")
    sign = (0.2 * w, 0.8 * w, -0.02, 0.22, wall_top - 1.2, wall_top - 0.15)
    p.add_to("steel", porch.wall(0).box(*sign))


def _add_dock(p: Supermarket, hall: Wing) -> None:
    """Adds a loading dock beside the hall, with a roof and a screen wall."""
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
    """Adds shelters for trolleys in front of the canopy's ends."""
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
