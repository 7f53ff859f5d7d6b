"""The supermarket: a low hall, a glazed front under a canopy, a dock."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Roof, Wing

_WALLS = (
    (0.82, 0.80, 0.76),
    (0.66, 0.50, 0.40),
    (0.74, 0.74, 0.72),
    (0.58, 0.40, 0.33),
)
_BRANDS = ((0.70, 0.20, 0.17), (0.20, 0.42, 0.28), (0.20, 0.32, 0.52),
           (0.80, 0.56, 0.20))  # fmt: skip
_STEEL = (0.72, 0.73, 0.74)
_RECESS = 0.25


class Parameters:
    """Parameters of a supermarket; lengths in metres.

    Attributes:
        height: of the entrance's gable or sign.
        eaves: of the hall.
        entrance: `tower` (a box), `gable` or `vault` above the doors.
        entrance_at: its place along the front, a part of it.
        entrance_width: [m].
        canopy: reach of the canopy along the front.
        pitch: of the pilasters.
        dock_left: side of the loading dock.
        dock_depth: of the dock beside the hall; 0 for none.
        shelters: for trolleys, in front.
    """

    def __init__(self, d: Dice) -> None:
        width = d.width
        entrance = min(d.uniform(7.0, 11.0), 0.4 * width)
        self.height = d.height
        self.eaves = round(min(d.uniform(5.0, 6.5), 0.75 * d.height), 2)
        self.entrance = d.pick(("tower", "gable", "vault"))
        self.entrance_at = d.uniform(0.25, 0.75)
        self.entrance_width = round(entrance, 1)
        self.canopy = d.uniform(2.2, 3.2, 2)
        self.pitch = max(d.uniform(5.0, 7.0), width / 9)
        self.dock_left = d.chance(0.5)
        self.dock_depth = 4.5 if width > 32.0 and d.chance(0.8) else 0.0
        self.shelters = d.whole(0, 3)
        self.roof_items = d.some_of(
            "air_handler air_handler cooling_tower skylight skylight skylight "
            "ac_unit vents",
            4,
            9,
        )
        self.rgb = d.pick(_WALLS)
        self.brand_rgb = d.pick(_BRANDS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the hall on a rectangle, its entrance in front."""
    out.paint(
        walls=p.rgb,
        glass=out.glass_rgb,
        brand=p.brand_rgb,
        roof=p.brand_rgb,
        steel=_STEEL,
    )
    x0, y0, x1, y1 = out.site.bounds
    left = x0 + 0.3 + p.dock_depth * p.dock_left
    right = x1 - 0.3 - p.dock_depth * (not p.dock_left)
    area = (left, y0 + p.canopy + 1.2, right, y1 - 0.3)
    hall = Wing.flat(*area, p.eaves, 0.9, rim=0.2)
    openings = Openings(hall)
    glazing = bays.window(
        p.pitch - 0.9, 0.4, 3.3, _RECESS, mullions=2, transom=2.4
    )
    openings.row((0,), 0.5, p.pitch, [glazing], 0.6)
    band = bays.window(p.pitch - 1.4, p.eaves - 2.3, p.eaves - 1.3, _RECESS)
    openings.row((1, 3), 1.0, 1.6 * p.pitch, [band], 1.2)
    service = [bays.gate(2.6, 2.8, 0.25), bays.window(1.1, 0.0, 2.2, _RECESS)]
    openings.row((2,), 0.5, 8.0, service, 1.5)
    bands = (Band(0.0, 0.4, -0.06), Band(p.eaves - 0.7, p.eaves - 0.2, -0.08))
    openings.enclose(out, (_RECESS,), bands)
    piers = details.pilasters(
        hall.outline, p.pitch, 0.6, 1, 0.5, 0.2, 0.0, p.eaves - 0.5
    )
    out.add_to("walls", piers)
    _add_canopy(out, p, hall.wall(0))
    _add_entrance(out, p, hall)
    if p.dock_depth:
        _add_dock(out, p, hall)
    _add_shelters(out, p, hall.wall(0))
    equip_roof(out, hall.outline, hall.floor, p.roof_items, clear=2.0)


def _add_canopy(out: Assembly, p: Parameters, wall: details.WallFrame) -> None:
    """Adds a flat canopy on posts along the front."""
    z, reach = 3.45, p.canopy
    lid = wall.box(0.3, wall.length - 0.3, -0.05, reach, z, z + 0.4)
    out.add_to("brand", lid)
    for a, _ in bays.stretches(wall.length - 1.0, p.pitch, 0.5):
        u = 0.5 + a
        post = (u - 0.12, u + 0.12, reach - 0.5, reach - 0.26, z + 0.02)
        out.add_to("steel", wall.standing(*post))


def _add_entrance(out: Assembly, p: Parameters, hall: Wing) -> None:
    """Adds a porch with sliding doors, higher than the hall."""
    length, w = hall.width, p.entrance_width
    x = float(
        np.clip(p.entrance_at * length, w / 2 + 0.5, length - w / 2 - 0.5)
    )
    top, y0 = p.height, hall.y0 - p.canopy - 0.3
    kind, rise = {
        "tower": ("flat", 0.1),
        "gable": ("gable", 0.22 * w),
        "vault": ("barrel", 0.2 * w),
    }[p.entrance]
    wall_top = max(top - rise - 0.2, p.eaves - 0.5)
    roof = Roof(kind, True, 0.0, 0.25, 0.2, parapet=0.6)
    area = (hall.x0 + x - w / 2, y0, hall.x0 + x + w / 2, hall.y0 + 5.0)
    porch = Wing.at(*area, wall_top, top, roof)
    openings = Openings(porch, (hall,))
    doors = bays.window(w - 2.4, 0.05, 2.6, _RECESS, mullions=3)
    openings.put(0, w / 2, w - 1.6, doors)
    if wall_top > 5.0:
        light = bays.window(w - 2.4, 2.95, wall_top - 1.5, _RECESS, mullions=3)
        openings.add(0, light(0.8, w - 0.8))
    openings.enclose(out, (_RECESS,), material="brand")
    sign = (0.2 * w, 0.8 * w, -0.02, 0.22, wall_top - 1.2, wall_top - 0.15)
    out.add_to("steel", porch.wall(0).box(*sign))


def _add_dock(out: Assembly, p: Parameters, hall: Wing) -> None:
    """Adds a loading dock with its roof and a wall beside the hall."""
    wall = hall.wall(3 if p.dock_left else 1)
    reach = p.dock_depth - 0.4
    # Near the back, whichever way the wall runs.
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
    out.add_to(
        "walls",
        wall.standing(a, b, -0.05, reach - 1.2, 1.1, bottom=True),
        wall.box(a - 0.1, b + 0.1, -0.05, reach, 4.0, 4.3),
        wall.standing(*screen, bottom=True),
        *posts,
    )
    for u in np.linspace(a + 2.0, b - 2.0, 2).tolist():
        out.add_to("steel", wall.box(u - 1.3, u + 1.3, -0.02, 0.12, 1.1, 3.7))


def _add_shelters(
    out: Assembly, p: Parameters, wall: details.WallFrame
) -> None:
    """Adds bent roofs for trolleys in front of the canopy's ends."""
    y = p.canopy + 0.1
    for k in range(p.shelters):
        x = 3.2 if k == 0 else wall.length - 3.2
        a, b = x - 2.2, x + 2.2
        posts = (
            wall.standing(u - 0.06, u + 0.06, y + 0.1, y + 0.22, 2.15)
            for u in (a + 0.1, b - 0.1)
        )
        out.add_to(
            "steel",
            wall.box(a, b, y, y + 0.9, 2.1, 2.2),
            *posts,
            wall.box(a, b, y + 0.85, y + 0.9, 0.5, 1.1),
        )
