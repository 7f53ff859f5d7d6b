"""The concrete slab: loggias, a stair tower, pilotis, a low pavilion."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade

_CONCRETES = ((0.66, 0.65, 0.62), (0.74, 0.71, 0.66), (0.58, 0.58, 0.58))

_PARAPET = 1.2
_STAIR_RISE = 2.4

_ROOF_ITEMS = ("tank", "tank", "mast", "vents", "stair_house", "dish")


class Parameters:
    """Parameters of a slab; lengths in metres."""

    def __init__(self, d: Dice) -> None:
        self.height = d.height
        self.ground_height = d.uniform(4.2, 5.2, 2)
        self.storey_height = d.uniform(2.9, 3.2)
        self.depth = round(min(d.depth, d.uniform(13.0, 17.0)), 1)
        self.at_back = d.chance(0.5)
        self.stair_width = d.uniform(4.0, 6.0, 1)
        self.stair_left = d.chance(0.5)
        self.pitch = max(d.uniform(3.4, 5.0), d.width / 11)
        self.loggia_depth = d.uniform(1.2, 1.7, 2)
        self.rail = d.uniform(0.9, 1.1, 2)
        self.window_recess = d.uniform(0.15, 0.3, 2)
        self.pavilion_height = d.uniform(4.0, 5.5, 1)
        self.rgb = d.pick(_CONCRETES)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the slab along x on a rectangle."""
    x0, y0, x1, y1 = out.site.bounds
    front = y1 - p.depth if p.at_back else y0
    back = front + p.depth
    split = x0 + p.stair_width if p.stair_left else x1 - p.stair_width
    stair, ends = (split, x1), (x0, split)
    if p.stair_left:
        stair, ends = ends, stair
    slab = massing.rectangle(ends[0], front, ends[1], back)
    top = _add_hall(out, p, slab)
    goal = p.height - _STAIR_RISE - _PARAPET
    groups, per_group, storey = tiers.divided(goal - top, p.storey_height, 7)
    walls = _storey(p, storey)
    top = tiers.add_storeys(out, slab, walls, top, groups, per_group)
    bands = (Band(0.0, 0.25, -0.12), Band(1.0, _PARAPET, -0.12))
    roof = tiers.add_crown(out, slab, Facade(_PARAPET, bands), top, 0.9)
    equip_roof(out, slab, roof, _ROOF_ITEMS)
    shaft = massing.rectangle(stair[0], front + 1.2, stair[1], back - 1.2)
    _add_stair(out, p, shaft)
    room = front - y0 if p.at_back else y1 - back
    if room > 9.0:
        ys = (y0, front - 1.0) if p.at_back else (back + 1.0, y1)
        _add_pavilion(out, p, (x0, x1), ys)


def _add_hall(out: Assembly, p: Parameters, slab: np.ndarray) -> float:
    """A glazed hall behind rows of pillars that carry the slab."""
    h = p.ground_height
    hall = massing.inset(slab, (2.4, 0.4, 2.4, 0.4))
    pane = bays.ribbon(0.5, h - 0.6, 0.25, 0.3)
    glazing = bays.rhythm(p.pitch, [pane], margin=0.6)
    door = bays.with_middle(glazing, bays.entrance(2.2, 2.8, 0.6), 4.0)
    layout = bays.by_edge({0: door, 2: door}, glazing)
    walls = Facade(h, (Band(0.0, 0.5, -0.1),), layout, (0.25,))
    pieces = [massing.flat(slab, h, up=False)]
    for edge in (0, 2):
        wall = details.WallFrame(slab, edge)
        for a, b in bays.stretches(wall.length, 1.2 * p.pitch, 0.3):
            x = round((a + b) / 2, 2)
            pieces.append(wall.standing(x - 0.3, x + 0.3, -1.5, -0.2, h))
    return tiers.add_ground(out, hall, walls, pieces)


def _storey(p: Parameters, storey: float) -> Facade:
    head = round(storey - 0.3, 2)
    loggia = bays.loggia(p.pitch - 0.3, p.loggia_depth, p.rail, head)
    window = bays.window(1.9, 0.9, head - 0.2, p.window_recess)
    slit = bays.alone(bays.window(1.4, 0.2, head, p.window_recess), 2.4)
    layouts = {
        0: bays.rhythm(p.pitch, [loggia], margin=0.4),
        2: bays.rhythm(p.pitch / 1.4, [window], margin=0.5),
    }
    glass = (p.loggia_depth + 0.15, p.window_recess)
    layout = bays.by_edge(layouts, slit)
    return Facade(storey, (Band(0.0, 0.15, -0.06),), layout, glass)


def _add_stair(out: Assembly, p: Parameters, shaft: np.ndarray) -> None:
    """A shaft beside the slab, lit by a slit from the ground to its top."""
    slit = bays.window(1.2, 1.0, p.height - 2.0, 0.3)
    walls = tiers.shaft_walls(p.height, slit, slit, 2.0, (0.5, 0.15))
    out.add("stairs", massing.foundation(shaft), tiers.block(shaft, walls, 0.0))


def _add_pavilion(
    out: Assembly, p: Parameters, xs: bays.Span, ys: bays.Span
) -> None:
    """A low glazed pavilion in the open part of the site."""
    width = 0.55 * (xs[1] - xs[0])
    left = xs[0] if p.stair_left else xs[1] - width
    depth = min(ys[1] - ys[0], 14.0)
    plan = massing.rectangle(left, ys[0], left + width, ys[0] + depth)
    h = p.pavilion_height
    pane = bays.ribbon(0.4, h - 1.3, 0.5, 0.35)
    glazing = bays.rhythm(2.8, [pane], margin=0.5)
    layout = bays.with_door(glazing, bays.entrance(2.4, 2.6, 0.8), 4.2)
    bands = (Band(h - 0.9, h - 0.4, -0.9), Band(h - 0.4, h, 0.0))
    walls = Facade(h, bands, layout, (0.5,))
    tiers.add_ground(out, plan, walls, part="pavilion")
    out.add("pavilion_roof", massing.roof_pan(plan, h - 0.4, h, 0.25))
