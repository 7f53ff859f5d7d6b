"""The strip of shops: low flat-roofed units side by side, each its own."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts import family_house
from cns_drake.city.facades import bays, house_walls
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Roof, Wing

_WALLS = (
    (0.78, 0.74, 0.66),
    (0.70, 0.66, 0.62),
    (0.62, 0.44, 0.35),
    (0.84, 0.82, 0.78),
    (0.66, 0.70, 0.66),
)
_SIGNS = (
    (0.60, 0.20, 0.18),
    (0.20, 0.34, 0.46),
    (0.80, 0.66, 0.26),
    (0.26, 0.42, 0.30),
)
_AWNINGS = ((0.75, 0.72, 0.62), (0.40, 0.20, 0.20), (0.24, 0.36, 0.34))

# Kept free in front for canopies and behind for gutters [m].
_FRONT_M, _BACK_M = 0.4, 0.1


class Parameters:
    """Parameters of a strip; lengths in metres.

    Attributes:
        height: of the highest parapet.
        unit_width: wanted, of a shop.
        ground: height of the shops without their parapets.
        upper: part of the units with an upper floor, where height allows.
        canopy: whether one canopy runs along all shops, else awnings.
        canopy_reach: of the canopy.
        steps: by how much parapets differ.
        roof_items: on the roofs.
    """

    def __init__(self, d: Dice) -> None:
        ground = round(min(d.uniform(3.6, 4.2), d.height - 0.5), 2)
        self.height = d.height
        self.unit_width = d.uniform(5.5, 9.0)
        self.ground = ground
        self.upper = d.uniform(0.2, 0.7)
        self.canopy = d.chance(0.45)
        self.canopy_reach = d.uniform(0.9, 1.3, 2)
        self.steps = d.uniform(0.3, 0.6, 2)
        self.roof_items = d.some_of("ac_unit ac_unit vents skylight", 1, 5)
        self.rgb = d.pick(_WALLS)
        self.second_rgb = d.pick(_WALLS)
        self.accent_rgb = d.pick(family_house.ACCENTS)
        self.sign_rgb = d.pick(_SIGNS)
        self.awning_rgb = d.pick(_AWNINGS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the strip along the front of a rectangle."""
    site = out.site
    out.paint(
        walls=p.rgb,
        facing=p.second_rgb,
        glass=out.glass_rgb,
        trim=family_house.TRIM,
        accent=p.accent_rgb,
        sign=p.sign_rgb,
        awning=p.awning_rgb,
    )
    x0, y0, x1, y1 = site.bounds
    count = max(1, round((x1 - x0) / p.unit_width))
    shares = out.rng.uniform(0.8, 1.2, count)
    bounds = x0 + (x1 - x0) * np.cumsum([0.0, *shares]) / shares.sum()
    highest = int(out.rng.integers(count))
    for k in range(count):
        blind = out.site.blind_in(k, count)
        tall = p.height > p.ground + 3.4 and (
            k == highest or out.rng.random() < p.upper
        )
        top = p.height if k == highest else _top(p, tall, out.rng)
        back = y1 - _BACK_M - float(out.rng.uniform(0.0, 0.12)) * (y1 - y0)
        area = (bounds[k], y0 + _FRONT_M, bounds[k + 1], back)
        roof = Roof("flat", parapet=min(0.5, top - p.ground - 0.1))
        wing = Wing.at(*area, top - 0.1, top, roof, blind)
        _add_unit(out, p, wing, tall)
        if k % 3 == 0:
            part = f"unit_{k}_"
            equip_roof(out, wing.outline, wing.floor, p.roof_items, prefix=part)


def _top(p: Parameters, tall: bool, rng: np.random.Generator) -> float:
    """Returns the parapet of a unit that is not the highest [m]."""
    drop = p.steps * int(rng.integers(0, 3))
    if tall or p.height < p.ground + 3.4:
        return round(max(p.height - drop, p.ground + 0.4), 2)
    return round(p.ground + 0.5 + 0.5 * drop, 2)


def _add_unit(out: Assembly, p: Parameters, wing: Wing, tall: bool) -> None:
    openings, rng = Openings(wing), out.rng
    wall = wing.wall(0)
    cladding = "walls" if rng.random() < 0.5 else "facing"
    upper_floors = round((wing.top - p.ground - 0.6) / 3.0) if tall else 0
    storey = (wing.top - 0.5 - p.ground) / max(upper_floors, 1)
    width = round(float(rng.uniform(1.1, 2.2)), 2)
    house_walls.add_rows(
        openings, (0, 2), p.ground, storey, upper_floors, width + 1.1, width,
        head=min(2.3, storey - 0.4),
    )  # fmt: skip
    house_walls.add_shops(
        out, wall, openings, 0, 0.2, wall.length - 0.2, p.ground,
        width=9.0, awnings=0.0 if p.canopy else 0.7, reach=p.canopy_reach,
    )  # fmt: skip
    back = [bays.gate(2.0, 2.2, 0.2), house_walls.sash(1.0, 0.0, 1.6, 2.3)]
    openings.row((2,), 0.5, 3.6, back, 0.7)
    glass = (house_walls.GLASS_M, *house_walls.SHOP_GLASS_M)
    openings.enclose(out, glass, (Band(0.0, 0.3, -0.05),), cladding)
    if p.canopy:
        z, reach = p.ground - 0.95, p.canopy_reach
        lid = (0.05, wall.length - 0.05, -0.02, reach, z, z + 0.22)
        out.add_to("awning", wall.box(*lid))
    _add_parapet(out, p, wing, cladding)


def _add_parapet(
    out: Assembly, p: Parameters, wing: Wing, cladding: str
) -> None:
    """Frames the parapet's front: a coping, or piers at its ends."""
    wall, top, rng = wing.wall(0), wing.top, out.rng
    length = wall.length
    if rng.random() < 0.5:
        coping = (0.02, length - 0.02, -0.05, 0.12, top - 0.2, top - 0.02)
        out.add_to("trim", wall.box(*coping))
    else:
        for x in (0.25, length - 0.25):
            pier = (x - 0.22, x + 0.22, -0.05, 0.15, 0.0, top - 0.03)
            out.add_to(cladding, wall.box(*pier))
    visible = top - p.ground - 0.1 > 0.6 and top < p.height - 3.0
    if rng.random() < 0.4 and visible:
        sign = (0.25 * length, 0.75 * length, -0.15, 0.1, top - 0.3, top + 0.7)
        out.add_to("sign", wall.box(*sign))
