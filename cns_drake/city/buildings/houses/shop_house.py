"""The shop house: shops on the ground floor, flats above them."""

from __future__ import annotations

from dataclasses import replace

from cns_drake.city.buildings.house_parts import family_house, row_unit
from cns_drake.city.facades import bays, details, house_walls, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Wing

_WALLS = (
    *family_house.BRICKS,
    (0.84, 0.78, 0.66),
    (0.74, 0.66, 0.54),
    (0.70, 0.72, 0.66),
    (0.82, 0.70, 0.60),
)
_SIGNS = ((0.24, 0.26, 0.30), (0.36, 0.20, 0.16), (0.20, 0.32, 0.30))


class Parameters:
    """Parameters of a shop house; lengths in metres.

    Attributes:
        height: of its top.
        unit: of the flats; its floor is the top of the shops.
        shop_width: wanted, of a shop.
        awnings: part of the shops with an awning.
        oriels: bay windows above the shops, at most.
        course: how far the band above the shops sticks out.
    """

    def __init__(self, d: Dice) -> None:
        x0, y0, x1, y1 = d.site.bounds
        roofs = ["flat", "gable", "gambrel"]
        if d.width < 10.0 and d.depth > d.width:
            roofs += ["front", "stepped"]
        if d.depth > 14.0:
            roofs = ["flat"]
        unit = row_unit.draw_unit(d.rng, d.width, roofs, family_house.BRICKS)
        ground = d.uniform(3.5, 4.2, 2)
        if d.height - ground < 3.2:
            ground, unit = (
                min(3.4, d.height - 1.6),
                replace(unit, roof="flat"),
            )
        pitch = max(unit.window_pitch, (x1 - x0 + y1 - y0) / 22)
        self.height = d.height
        self.unit = replace(
            unit, floor=round(ground, 2), stoop=0.35, window_pitch=pitch
        )
        self.shop_width = d.uniform(4.5, 7.5)
        self.awnings = d.uniform(0.2, 0.9)
        self.oriels = d.whole(0, 3)
        self.course = d.uniform(0.08, 0.2, 2)
        self.roof_items = d.some_of("stair_house vents ac_unit skylight", 1, 5)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(family_house.ROOFS)
        self.sign_rgb = d.pick(_SIGNS)
        self.awning_rgb = d.pick(tiers.AWNINGS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the house on a rectangle."""
    out.paint(
        walls=p.rgb,
        glass=out.glass_rgb,
        roof=p.roof_rgb,
        trim=family_house.TRIM,
        accent=family_house.ACCENTS[0],
        sign=p.sign_rgb,
        awning=p.awning_rgb,
    )
    x0, y0, x1, y1 = out.site.bounds
    side = 0.3 * (p.unit.roof == "flat")
    blind = out.site.blind_edges & {1, 3}
    left, right = x0 + side * (3 not in blind), x1 - side * (1 not in blind)
    area = (left, y0 + p.unit.stoop, right, y1 - 0.35)
    wing, storeys = row_unit.unit_box(p.unit, area, p.height, blind)
    openings = Openings(wing)
    ground = p.unit.floor
    room = wing.wall_top - 0.25 - ground
    upper = storeys if room > 2.4 else 0
    step = room / max(upper, 1)
    sides = [k for k in (1, 3) if k not in blind]
    head = min(2.25, step - 0.4)
    for edges, pitch in (((0, 2), p.unit.window_pitch), (sides, 4.0)):
        house_walls.add_rows(
            openings, edges, ground, step, upper, pitch,
            p.unit.window_width, head=head,
        )  # fmt: skip
    _add_ground(out, p, wing, openings)
    _add_oriels(out, p, wing, openings, upper, step)
    house_walls.add_casings(out, wing, openings, (0,), p.unit.casing)
    bands = [Band(round(ground - 0.3, 2), ground, -p.course)]
    if p.unit.roof == "flat" and room > 0.8:
        z = round(wing.wall_top - 0.45, 2)
        bands.append(Band(z, wing.wall_top, -0.25))
    glass = (house_walls.GLASS_M, *house_walls.SHOP_GLASS_M)
    openings.add_walls(out, glass, bands)
    row_unit.add_roof(out, p.unit, wing)
    if p.unit.roof == "flat":
        equip_roof(out, wing.outline, wing.floor, p.roof_items)
    elif p.unit.chimney:
        row_unit.add_stack(out, p.unit, wing, "chimney")


def _add_ground(
    out: Assembly, p: Parameters, wing: Wing, openings: Openings
) -> None:
    """Adds the shops, the door to the flats, service doors at the back."""
    wall = wing.wall(0)
    door, length = 1.7 * (p.unit.floor < p.height - 3.0), wall.length
    left = p.unit.door_left
    start, end = (door, length) if left else (0.0, length - door)
    house_walls.add_shops(
        out, wall, openings, 0, start, end, p.unit.floor,
        width=p.shop_width, awnings=p.awnings,
    )  # fmt: skip
    if door:
        x = 0.9 if left else length - 0.9
        house_walls.add_door(out, wing, openings, 0, x, 0.0, height=2.3)
    back = [house_walls.sash(1.2, 0.0, 1.4, 2.3), bays.gate(2.2, 2.3, 0.2)]
    openings.row((2,), 0.5, 4.5, back, 0.8)


def _add_oriels(
    out: Assembly,
    p: Parameters,
    wing: Wing,
    openings: Openings,
    upper: int,
    step: float,
) -> None:
    if upper < 1 or step < 2.5 or p.oriels == 0:
        return
    wall = wing.wall(0)
    low = round(p.unit.floor + 0.15, 2)
    high = round(p.unit.floor + max(1, upper - 1) * step - 0.15, 2)
    high = min(high, wing.wall_top - 0.7)
    for a, b in bays.stretches(wall.length, wall.length / p.oriels, 0.4):
        width = min(2.4, b - a - 1.2)
        if width < 1.5:
            continue
        x = (a + b) / 2
        openings.clear(
            0, x - width / 2 - 0.15, x + width / 2 + 0.15, low, high + 0.4
        )
        details.add_bay_window(
            out, wall, x, width, 0.6, low, high,
            storeys=max(1, upper - 1), canted=p.unit.bay != "box",
        )  # fmt: skip
