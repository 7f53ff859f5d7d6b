"""The mid-rise office: shops and a lobby below, window bands, a penthouse."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade

_PANELS = (
    (0.78, 0.77, 0.74),
    (0.66, 0.60, 0.52),
    (0.50, 0.53, 0.56),
    (0.73, 0.62, 0.50),
)


class Parameters:
    """Parameters of an office; lengths in metres.

    `style` is `ribbon` (bands of glass), `frame` (deep square frames) or
    `grooves` (piers from the first floor to the top).
    """

    def __init__(self, d: Dice) -> None:
        run = d.site.open_length
        tall = d.height > 18.0
        self.height = d.height
        self.ground_height = d.uniform(4.4, 5.4, 2)
        self.storey_height = d.uniform(3.4, 3.9)
        self.style = d.pick(("ribbon", "frame", "grooves"))
        self.pitch = max(d.uniform(3.0, 4.4), run / 42)
        self.recess = d.uniform(0.25, 0.5, 2)
        self.sill = d.uniform(0.75, 1.05, 2)
        self.pier_reach = d.uniform(0.15, 0.32, 2)
        self.penthouse_height = d.uniform(3.4, 4.4, 1) * tall
        self.penthouse_inset = d.uniform(2.2, 4.0, 1)
        self.parapet = d.uniform(0.6, 1.2, 2)
        self.awnings = d.uniform(0.0, 0.7)
        self.roof_items = d.some_of(
            "air_handler lift_house ac_unit ac_unit vents dish", 3, 7
        )
        self.rgb = d.pick(_PANELS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the office on any outline."""
    outline, blind = out.site.outline, out.site.blind_edges
    top = _add_ground(out, p)
    goal = p.height - p.penthouse_height - p.parapet - 0.5
    if p.style == "grooves":
        wall = tiers.Grooves(
            p.storey_height, p.sill, 0.0, p.recess, p.pitch, 0.5,
            p.pier_reach, 0.8,
        )  # fmt: skip
        top = tiers.add_grooved(
            out, outline, wall, top, goal, "storey", 0.2, 8, blind
        )
    else:
        top = _add_windows(out, p, top, goal)
    rim = round(p.height - p.penthouse_height - top, 3)
    bands = (
        Band(0.1, 0.4, -0.2 if p.style == "ribbon" else 0.0),
        Band(rim - 0.3, rim, -0.35),
    )
    edge = Facade(rim, bands, plain=blind)
    roof = tiers.add_crown(out, outline, edge, top, p.parapet)
    if p.penthouse_height > 0:
        inset = min(p.penthouse_inset, massing.inset_limit(outline))
        outline = massing.inset(outline, inset)
        roof = _add_penthouse(out, p, outline, roof)
    equip_roof(out, outline, roof, p.roof_items)


def _add_ground(out: Assembly, p: Parameters) -> float:
    outline, h = out.site.outline, p.ground_height
    front = details.WallFrame(outline, 0)
    pitch = 1.6 * p.pitch
    shop = bays.shop_front(h - 1.1, 0.5, door=False)
    shops = bays.rhythm(pitch, [shop], margin=0.7)
    window = bays.window(2.2, 1.2, h - 1.2, 0.5)
    sides = bays.rhythm(1.5 * p.pitch, [window], margin=0.9)
    lobby = bays.with_middle(shops, bays.entrance(3.2, 3.2, 1.8), 5.0)
    layout = bays.by_edge({0: lobby}, shops if len(outline) > 4 else sides)
    bands = (Band(0.0, 0.35, -0.06), Band(h - 0.9, h - 0.1, -0.15))
    ground = Facade(h, bands, layout, (0.5,), out.site.blind_edges)
    cells = bays.stretches(front.length, pitch, 0.7)
    shape = (0.3, 1.3, 2.7, h - 1.1)
    shades = details.awnings(front, cells, out.rng, p.awnings, shape, 2.6)
    tiers.add_awnings(out, shades)
    roof = details.front_canopy(outline, 2.6, 1.45, 3.4)
    return tiers.add_ground(out, outline, ground, [roof])


def _add_windows(out: Assembly, p: Parameters, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.divided(goal - z0, p.storey_height)
    head = round(storey - 0.4, 2)
    bands: tuple[Band, ...] = ()
    if p.style == "ribbon":
        pane = bays.ribbon(p.sill, head, p.recess, 0.12)
        cells = bays.rhythm(p.pitch, [pane], margin=0.8)
        bands = (Band(p.sill - 0.15, p.sill, -0.08),)
    else:
        frame = bays.window(
            p.pitch - 0.5, 0.45, head, p.recess, pier=0.22, mullions=1
        )
        cells = bays.rhythm(p.pitch, [frame], margin=0.6)
    site = out.site
    walls = Facade(storey, bands, cells, (p.recess,), site.blind_edges)
    return tiers.add_storeys(out, site.outline, walls, z0, groups, per_group)


def _add_penthouse(
    out: Assembly, p: Parameters, outline: np.ndarray, roof: float
) -> float:
    # It starts on the roof; its own parapet ends at the full height.
    height = round(p.height - roof, 3)
    eaves = height - 0.9
    bands = (Band(0.9, eaves - 0.3, 0.3), Band(eaves, eaves + 0.3, -0.7))
    walls = Facade(height, bands, glass=(0.3,))
    return tiers.add_crown(out, outline, walls, roof, 0.6, part="penthouse")
