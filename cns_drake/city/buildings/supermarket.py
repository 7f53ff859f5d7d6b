"""The supermarket."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    WallFrame,
    Wing,
    around,
    bays,
    equip_roof,
    foot_band,
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
        self.canopy = self.uniform(2.2, 3.2, digits=2)
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
            low=4,
            high=9,
        )

    def build(self) -> None:
        """Adds all parts of the supermarket, with the entrance in front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left = x0 + 0.3 + self.dock_depth * self.dock_left
        right = x1 - 0.3 - self.dock_depth * (not self.dock_left)
        area = (left, y0 + self.canopy + 1.2, right, y1 - 0.3)
        hall = Wing.flat(area, top=self.eaves, parapet=0.9, rim=0.2)
        openings = Openings(self, hall)
        glazing = bays.window(
            width=self.pitch - 0.9,
            sill=0.4,
            head=3.3,
            depth=_RECESS_M,
            mullions=2,
            transom=2.4,
        )
        openings.add_bays(
            (0,), z=0.5, pitch=self.pitch, choices=[glazing], margin=0.6
        )
        band = bays.window(
            width=self.pitch - 1.4,
            sill=self.eaves - 2.3,
            head=self.eaves - 1.3,
            depth=_RECESS_M,
        )
        openings.add_bays(
            (1, 3), z=1.0, pitch=1.6 * self.pitch, choices=[band], margin=1.2
        )
        service = [
            bays.gate(width=2.6, height=2.8, depth=0.25),
            bays.window(width=1.1, sill=0.0, head=2.2, depth=_RECESS_M),
        ]
        openings.add_bays((2,), z=0.5, pitch=8.0, choices=service, margin=1.5)
        bands = (
            foot_band(height=0.4, reach=0.06),
            Band(z0=self.eaves - 0.7, z1=self.eaves - 0.2, depth=-0.08),
        )
        openings.enclose((_RECESS_M,), bands=bands)
        strips = piers.pilasters(
            hall.outline,
            pitch=self.pitch,
            margin=0.6,
            every=1,
            width=0.5,
            reach=0.2,
            z0=0.0,
            z1=self.eaves - 0.5,
        )
        self.add_to("walls", strips)
        _add_canopy(self, hall.wall(0))
        _add_entrance(self, hall)
        if self.dock_depth:
            _add_dock(self, hall)
        _add_shelters(self, hall.wall(0))
        equip_roof(self, hall.outline, hall.floor, self.roof_items, clear=2.0)


def _add_canopy(market: Supermarket, wall: WallFrame) -> None:
    """Adds a flat canopy on posts along the front."""
    z = 3.45
    reach = market.canopy
    lid = wall.box(x=(0.3, wall.length - 0.3), y=(-0.05, reach), z=(z, z + 0.4))
    market.add_to("brand", lid)
    for a, _ in bays.stretches(
        wall.length - 1.0, pitch=market.pitch, margin=0.5
    ):
        u = 0.5 + a
        market.add_to(
            "steel",
            wall.standing(
                x=around(u, 0.12),
                y=(reach - 0.5, reach - 0.26),
                z1=z + 0.02,
            ),
        )


def _add_entrance(market: Supermarket, hall: Wing) -> None:
    """Adds a porch with sliding doors, higher than the hall."""
    length = hall.width
    w = market.entrance_width
    x = float(
        np.clip(market.entrance_at * length, w / 2 + 0.5, length - w / 2 - 0.5)
    )
    top = market.height
    y0 = hall.y0 - market.canopy - 0.3
    kind, rise = {
        "tower": ("flat", 0.1),
        "gable": ("gable", 0.22 * w),
        "vault": ("barrel", 0.2 * w),
    }[market.entrance]
    wall_top = max(top - rise - 0.2, market.eaves - 0.5)
    roof = Roof(
        kind, along_y=True, eaves=0.0, verge=0.25, thickness=0.2, parapet=0.6
    )
    area = (hall.x0 + x - w / 2, y0, hall.x0 + x + w / 2, hall.y0 + 5.0)
    porch = Wing.at(area, wall_top=wall_top, top=top, roof=roof)
    openings = Openings(market, porch, (hall,))
    doors = bays.window(
        width=w - 2.4, sill=0.05, head=2.6, depth=_RECESS_M, mullions=3
    )
    openings.replace_by_bay(0, x=w / 2, width=w - 1.6, bay=doors)
    if wall_top > 5.0:
        light = bays.window(
            width=w - 2.4,
            sill=2.95,
            head=wall_top - 1.5,
            depth=_RECESS_M,
            mullions=3,
        )
        openings.add_reliefs(0, light(0.8, w - 0.8))
    openings.enclose((_RECESS_M,), material="brand")
    market.add_to(
        "steel",
        porch.wall(0).box(
            x=(0.2 * w, 0.8 * w),
            y=(-0.02, 0.22),
            z=(wall_top - 1.2, wall_top - 0.15),
        ),
    )


def _add_dock(market: Supermarket, hall: Wing) -> None:
    """Adds a loading dock beside the hall, with a roof and a screen wall."""
    wall = hall.wall(3 if market.dock_left else 1)
    reach = market.dock_depth - 0.4
    # At the back end of the side wall, whose direction depends on the side.
    a, b = (
        (1.0, 10.0)
        if market.dock_left
        else (wall.length - 10.0, wall.length - 1)
    )
    a, b = max(a, 0.5), min(b, wall.length - 0.5)
    posts = (
        wall.box(
            x=around(u, 0.12),
            y=(reach - 0.27, reach - 0.03),
            z=(2.1, 4.05),
            bottom=False,
        )
        for u in (a + 0.2, b - 0.2)
    )
    market.add_to(
        "walls",
        wall.standing(x=(a, b), y=(-0.05, reach - 1.2), z1=1.1, bottom=True),
        wall.box(x=(a - 0.1, b + 0.1), y=(-0.05, reach), z=(4.0, 4.3)),
        wall.standing(
            x=(a - 0.1, b + 0.1), y=(reach - 0.3, reach), z1=2.2, bottom=True
        ),
        *posts,
    )
    for u in np.linspace(a + 2.0, b - 2.0, 2).tolist():
        market.add_to(
            "steel",
            wall.box(x=around(u, 1.3), y=(-0.02, 0.12), z=(1.1, 3.7)),
        )


def _add_shelters(market: Supermarket, wall: WallFrame) -> None:
    """Adds shelters for trolleys in front of the canopy's ends."""
    y = market.canopy + 0.1
    for k in range(market.shelters):
        x = 3.2 if k == 0 else wall.length - 3.2
        a, b = x - 2.2, x + 2.2
        posts = (
            wall.standing(x=around(u, 0.06), y=(y + 0.1, y + 0.22), z1=2.15)
            for u in (a + 0.1, b - 0.1)
        )
        market.add_to(
            "steel",
            wall.box(x=(a, b), y=(y, y + 0.9), z=(2.1, 2.2)),
            *posts,
            wall.box(x=(a, b), y=(y + 0.85, y + 0.9), z=(0.5, 1.1)),
        )
