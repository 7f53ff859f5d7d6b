"""The supermarket."""

from functools import partial

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    WallFrame,
    Wing,
    around,
    bays,
    foot_band,
    piers,
)
from worlds.shapes import equip_roof

# Depth of the windows behind the wall [m].
_RECESS_M = 0.25
# Greatest number of bays in front.
_MOST_BAYS = 9
# Strip beside and behind the walls [m].
_MARGIN_M = 0.3
# Free ground in front of the canopy [m].
_FORECOURT_M = 1.2
# Depth of a dock beside the hall [m].
_DOCK_M = 4.5
# Least width of a site with a dock [m].
_DOCK_SITE_M = 32.0
# Length of a dock [m].
_DOCK_LENGTH_M = 10.0
# Height of a dock's platform [m].
_PLATFORM_M = 1.1
# Height of the canopy's underside [m].
_CANOPY_M = 3.45
# Half the width of a post [m].
_POST_HALF_M = 0.12
# Distance of a shelter's middle from the end of the front [m].
_SHELTER_END_M = 3.2
# Half the length of a shelter [m].
_SHELTER_HALF_M = 2.2


class Supermarket(Building):
    """The supermarket: a low hall, a glazed front under a canopy, a dock."""

    def draw(self) -> None:
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
        self.pitch = max(self.uniform(5.0, 7.0), site.width / _MOST_BAYS)
        self.dock_left = self.chance(0.5)
        # Depth of the dock beside the hall; 0 for none.
        self.dock_depth = 0.0
        if site.width > _DOCK_SITE_M and self.chance(0.8):
            self.dock_depth = _DOCK_M
        # Number of shelters for trolleys in front.
        self.shelters = self.whole(0, 3)
        self.roof_items = self.draw_roof_items(
            "air_handler air_handler cooling_tower skylight skylight skylight "
            "ac_unit vents",
            low=4,
            high=9,
        )

    def build(self) -> None:
        """Adds all parts of the supermarket, with the entrance in front."""
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        if self.dock_left:
            left += self.dock_depth
        else:
            right -= self.dock_depth
        front = y0 + self.canopy + _FORECOURT_M
        area = (left, front, right, y1 - _MARGIN_M)
        hall = Wing.flat(area, top=self.eaves, parapet=0.9, rim=0.2)
        _add_hall(self, hall)
        _add_canopy(self, hall.wall(0))
        _add_entrance(self, hall)
        if self.dock_depth:
            _add_dock(self, hall)
        _add_shelters(self, hall.wall(0))
        equip_roof(self, hall.outline, hall.floor, self.roof_items, clear=2.0)


def _add_hall(market: Supermarket, hall: Wing) -> None:
    """Adds the hall: glazed in front, with gates behind, between pilasters."""
    openings = Openings(market, hall)
    eaves, pitch = market.eaves, market.pitch
    glazing = bays.window(
        width=pitch - 0.9,
        sill=0.4,
        head=3.3,
        depth=_RECESS_M,
        mullions=2,
        transom=2.4,
    )
    openings.add_bays((0,), z=0.5, pitch=pitch, choices=[glazing], margin=0.6)
    high_window = bays.window(
        width=pitch - 1.4, sill=eaves - 2.3, head=eaves - 1.3, depth=_RECESS_M
    )
    openings.add_bays(
        (1, 3), z=1.0, pitch=1.6 * pitch, choices=[high_window], margin=1.2
    )
    service = [
        bays.gate(width=2.6, height=2.8, depth=0.25),
        bays.window(width=1.1, sill=0.0, head=2.2, depth=_RECESS_M),
    ]
    openings.add_bays((2,), z=0.5, pitch=8.0, choices=service, margin=1.5)
    bands = (
        foot_band(height=0.4, reach=0.06),
        Band(z0=eaves - 0.7, z1=eaves - 0.2, depth=-0.08),
    )
    openings.enclose((_RECESS_M,), bands=bands)
    strips = piers.pilasters(
        hall.outline,
        pitch=pitch,
        margin=0.6,
        every=1,
        reach=0.2,
        z0=0.0,
        z1=eaves - 0.5,
    )
    market.add_to("walls", strips)


def _add_canopy(market: Supermarket, wall: WallFrame) -> None:
    """Adds a flat canopy on posts along the front."""
    z, reach = _CANOPY_M, market.canopy
    lid = wall.box(x=(0.3, wall.length - 0.3), y=(-0.05, reach), z=(z, z + 0.4))
    market.add_to("brand", lid)
    cells = bays.stretches(wall.length - 1.0, pitch=market.pitch, margin=0.5)
    for start, _ in cells:
        post = wall.standing(
            x=around(0.5 + start, _POST_HALF_M),
            y=(reach - 0.5, reach - 0.26),
            z1=z + 0.02,
        )
        market.add_to("steel", post)


def _add_entrance(market: Supermarket, hall: Wing) -> None:
    """Adds a porch with sliding doors, higher than the hall."""
    width, length = market.entrance_width, hall.width
    half = width / 2
    wanted = market.entrance_at * length
    x = float(np.clip(wanted, half + 0.5, length - half - 0.5))
    kind, rise = {
        "tower": ("flat", 0.1),
        "gable": ("gable", 0.22 * width),
        "vault": ("barrel", 0.2 * width),
    }[market.entrance]
    wall_top = max(market.height - rise - 0.2, market.eaves - 0.5)
    roof = Roof(
        kind, along_y=True, eaves=0.0, verge=0.25, thickness=0.2, parapet=0.6
    )
    area = (
        hall.x0 + x - half,
        hall.y0 - market.canopy - 0.3,
        hall.x0 + x + half,
        hall.y0 + 5.0,
    )
    porch = Wing.at(area, wall_top=wall_top, top=market.height, roof=roof)
    openings = Openings(market, porch, (hall,))
    glazing = partial(
        bays.window, width=width - 2.4, depth=_RECESS_M, mullions=3
    )
    doors = glazing(sill=0.05, head=2.6)
    openings.replace_by_bay(0, x=half, width=width - 1.6, bay=doors)
    if wall_top > 5.0:
        light = glazing(sill=2.95, head=wall_top - 1.5)
        openings.add_reliefs(0, light(0.8, width - 0.8))
    openings.enclose((_RECESS_M,), material="brand")
    sign = porch.wall(0).box(
        x=(0.2 * width, 0.8 * width),
        y=(-0.02, 0.22),
        z=(wall_top - 1.2, wall_top - 0.15),
    )
    market.add_to("steel", sign)


def _add_dock(market: Supermarket, hall: Wing) -> None:
    """Adds a loading dock beside the hall, with a roof and a screen wall."""
    wall = hall.wall(3 if market.dock_left else 1)
    reach = market.dock_depth - 0.4
    # At the back end of the side wall, whose direction depends on the side.
    if market.dock_left:
        start, end = 1.0, _DOCK_LENGTH_M
    else:
        start, end = wall.length - _DOCK_LENGTH_M, wall.length - 1
    start, end = max(start, 0.5), min(end, wall.length - 0.5)
    posts = (
        wall.box(
            x=around(x, _POST_HALF_M),
            y=(reach - 0.27, reach - 0.03),
            z=(2.1, 4.05),
            bottom=False,
        )
        for x in (start + 0.2, end - 0.2)
    )
    platform = wall.standing(
        x=(start, end), y=(-0.05, reach - 1.2), z1=_PLATFORM_M, bottom=True
    )
    length = (start - 0.1, end + 0.1)
    roof = wall.box(x=length, y=(-0.05, reach), z=(4.0, 4.3))
    screen = wall.standing(
        x=length, y=(reach - 0.3, reach), z1=2.2, bottom=True
    )
    market.add_to("walls", platform, roof, screen, *posts)
    for x in np.linspace(start + 2.0, end - 2.0, 2).tolist():
        gate = wall.box(x=around(x, 1.3), y=(-0.02, 0.12), z=(_PLATFORM_M, 3.7))
        market.add_to("steel", gate)


def _add_shelters(market: Supermarket, wall: WallFrame) -> None:
    """Adds shelters for trolleys in front of the canopy's ends."""
    y = market.canopy + 0.1
    for k in range(market.shelters):
        x = _SHELTER_END_M if k == 0 else wall.length - _SHELTER_END_M
        start, end = around(x, _SHELTER_HALF_M)
        posts = (
            wall.standing(
                x=around(x_post, 0.06), y=(y + 0.1, y + 0.22), z1=2.15
            )
            for x_post in (start + 0.1, end - 0.1)
        )
        roof = wall.box(x=(start, end), y=(y, y + 0.9), z=(2.1, 2.2))
        rail = wall.box(x=(start, end), y=(y + 0.85, y + 0.9), z=(0.5, 1.1))
        market.add_to("steel", roof, *posts, rail)
