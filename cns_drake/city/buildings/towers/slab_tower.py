"""The concrete slab: loggias, a stair tower, pilotis, a low pavilion."""

from __future__ import annotations

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import Band, Facade
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice

_CONCRETES = ((0.66, 0.65, 0.62), (0.74, 0.71, 0.66), (0.58, 0.58, 0.58))

_PARAPET = 1.2
_STAIR_RISE = 2.4


_ROOF_ITEMS = ("tank", "tank", "mast", "vents", "stair_house", "dish")


class Parameters:
    """Parameters of a slab; lengths in metres."""

    def __init__(self, d: Dice):
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


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the slab along x on a rectangle."""
    x0, y0, x1, y1 = assembly.site.bounds
    front = y1 - p.depth if p.at_back else y0
    back = front + p.depth
    if p.stair_left:
        stair, ends = (x0, x0 + p.stair_width), (x0 + p.stair_width, x1)
    else:
        stair, ends = (x1 - p.stair_width, x1), (x0, x1 - p.stair_width)
    slab = massing.rectangle(ends[0], front, ends[1], back)
    top = _add_hall(assembly, p, slab)
    goal = p.height - _STAIR_RISE - _PARAPET
    groups, per_group, storey = tiers.divided(goal - top, p.storey_height, 7)
    walls = _storey(p, storey)
    top = tiers.add_storeys(assembly, slab, walls, top, groups, per_group)
    edge = Facade(
        _PARAPET, (Band(0.0, 0.25, -0.12), Band(1.0, _PARAPET, -0.12))
    )
    roof = tiers.add_crown(assembly, slab, edge, top, 0.9)
    equip_roof(assembly, slab, roof, _ROOF_ITEMS)
    shaft = massing.rectangle(stair[0], front + 1.2, stair[1], back - 1.2)
    _add_stair(assembly, p, shaft, storey)
    room = front - y0 if p.at_back else y1 - back
    if room > 9.0:
        ys = (y0, front - 1.0) if p.at_back else (back + 1.0, y1)
        _add_pavilion(assembly, p, (x0, x1), ys)


def _add_hall(assembly, p: Parameters, slab) -> float:
    """A glazed hall behind rows of pillars that carry the slab."""
    h = p.ground_height
    hall = massing.inset(slab, (2.4, 0.4, 2.4, 0.4))
    glazing = bays.rhythm(
        p.pitch, [bays.ribbon(0.5, h - 0.6, 0.25, 0.3)], margin=0.6
    )
    door = bays.with_middle(glazing, bays.entrance(2.2, 2.8, 0.6), 4.0)
    walls = Facade(
        h,
        (Band(0.0, 0.5, -0.1),),
        bays.by_edge({0: door, 2: door}, glazing),
        glass=(0.25,),
    )
    pieces = [massing.flat(slab, h, up=False)]
    for edge in (0, 2):
        wall = details.WallFrame(slab, edge)
        for a, b in bays.stretches(wall.length, 1.2 * p.pitch, 0.3):
            x = round((a + b) / 2, 2)
            pillar = massing.box(
                x - 0.3,
                x + 0.3,
                -1.5,
                -0.2,
                -massing.FOUNDATION_M,
                h,
                bottom=False,
            )
            pieces.append(wall.place(pillar))
    return tiers.add_ground(assembly, hall, walls, pieces)


def _storey(p: Parameters, storey: float) -> Facade:
    head = round(storey - 0.3, 2)
    loggia = bays.loggia(p.pitch - 0.3, p.loggia_depth, p.rail, head)
    window = bays.window(1.9, 0.9, head - 0.2, p.window_recess)
    slit = bays.window(1.4, 0.2, head, p.window_recess)
    layouts = {
        0: bays.rhythm(p.pitch, [loggia], margin=0.4),
        2: bays.rhythm(p.pitch / 1.4, [window], margin=0.5),
        1: bays.with_middle(bays.plain, slit, 2.4),
        3: bays.with_middle(bays.plain, slit, 2.4),
    }
    return Facade(
        storey,
        (Band(0.0, 0.15, -0.06),),
        bays.by_edge(layouts, bays.plain),
        glass=(p.loggia_depth + 0.15, p.window_recess),
    )


def _add_stair(assembly, p: Parameters, shaft, storey) -> None:
    """A shaft beside the slab, lit by a slit from the ground to its top."""
    slit = bays.with_middle(
        bays.plain, bays.window(1.2, 1.0, p.height - 2.0, 0.3), 2.0
    )
    layouts = bays.by_edge({0: slit, 2: slit}, bays.plain)
    bands = (Band(p.height - 0.5, p.height, -0.15),)
    walls = Facade(p.height, bands, layouts)
    base = massing.foundation(shaft)
    assembly.add("stairs", base, tiers.block(shaft, walls, 0.0))


def _add_pavilion(assembly, p: Parameters, xs, ys) -> None:
    """A low glazed pavilion in the open part of the site."""
    width = 0.55 * (xs[1] - xs[0])
    left = xs[0] if p.stair_left else xs[1] - width
    depth = min(ys[1] - ys[0], 14.0)
    plan = massing.rectangle(left, ys[0], left + width, ys[0] + depth)
    h = p.pavilion_height
    glazing = bays.rhythm(
        2.8, [bays.ribbon(0.4, h - 1.3, 0.5, 0.35)], margin=0.5
    )
    door = bays.with_middle(glazing, bays.entrance(2.4, 2.6, 0.8), 4.2)
    walls = Facade(
        h,
        (Band(h - 0.9, h - 0.4, -0.9), Band(h - 0.4, h, 0.0)),
        bays.by_edge({0: door}, glazing),
        glass=(0.5,),
    )
    tiers.add_ground(assembly, plan, walls, part="pavilion")
    lid = massing.roof_pan(plan, h - 0.4, h, 0.25)
    assembly.add("pavilion_roof", lid)
