"""The hotel: balconies along rounded walls, a forecourt, a rooftop bar."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade

_PAINTS = ((0.86, 0.83, 0.77), (0.80, 0.72, 0.62), (0.72, 0.75, 0.76))
_FORECOURT_M = 7.0

_ROOF_ITEMS = ("cooling_tower", "air_handler", "mast", "vents", "ac_unit")


class Parameters:
    """Parameters of a hotel; lengths in metres."""

    def __init__(self, d: Dice) -> None:
        depth = d.depth - _FORECOURT_M
        pitch = max(d.uniform(3.6, 4.6), d.width / 11)
        self.height = d.height
        self.ground_height = d.uniform(5.0, 6.2, 2)
        self.storey_height = d.uniform(3.1, 3.4)
        self.round_ends = bool(d.chance(0.5) and d.width > 1.5 * depth)
        self.corner = round(d.uniform(0.2, 0.35) * min(depth, d.width), 1)
        self.pitch = pitch
        self.side_pitch = max(2.7, (d.width + 2 * depth) / 34)
        self.recess = d.uniform(0.2, 0.35, 2)
        self.balcony_reach = d.uniform(1.1, 1.45, 2)
        self.balcony_width = round(d.uniform(0.6, 0.95) * pitch, 2)
        self.rail = d.uniform(0.95, 1.1, 2)
        self.bar_height = d.uniform(4.0, 5.0, 1)
        self.bar_inset = d.uniform(1.8, 3.0, 1)
        self.sign_left = d.chance(0.5)
        self.rgb = d.pick(_PAINTS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the hotel on a rectangle, behind a forecourt."""
    x0, y0, x1, y1 = out.site.bounds
    front = y0 + _FORECOURT_M
    if p.round_ends:
        plan = massing.stadium(x0, front, x1, y1, 3.2)
    else:
        block = massing.rectangle(x0, front, x1, y1)
        plan = massing.rounded(block, {0: p.corner, 1: p.corner}, 2.8)
    top = _add_lobby(out, p, plan, y0)
    goal = p.height - p.bar_height - 1.2
    top = _add_rooms(out, p, plan, top, goal)
    edge = Facade(1.2, (Band(0.0, 0.3, -0.15), Band(0.9, 1.2, -0.2)))
    roof = tiers.add_crown(out, plan, edge, top, 1.1)
    bar = massing.inset(plan, p.bar_inset)
    h = round(p.height - roof, 3)
    bands = (Band(0.4, h - 1.2, 0.3), Band(h - 0.9, h - 0.5, -1.3))
    walls = Facade(h, bands, glass=(0.3,))
    roof = tiers.add_crown(out, bar, walls, roof, 0.4, part="bar")
    equip_roof(out, bar, roof, _ROOF_ITEMS)
    _add_sign(out, p, plan)


def _add_lobby(
    out: Assembly, p: Parameters, plan: np.ndarray, y0: float
) -> float:
    h = p.ground_height
    pane = bays.ribbon(0.4, h - 1.2, 0.4, 0.5)
    glazing = bays.rhythm(p.pitch, [pane], margin=0.5)
    layout = bays.with_door(glazing, bays.entrance(4.4, 3.4, 1.5), 6.4)
    bands = (Band(0.0, 0.4, -0.1), Band(h - 0.8, h - 0.3, -0.4))
    # The drive-in roof stands on four pillars in the forecourt.
    middle = float(np.mean(plan[:2, 0]))
    front = float(plan[0, 1])
    left, right, z = middle - 6.0, middle + 6.0, 4.2
    roof = massing.box(left, right, y0 + 0.3, front + 0.2, z, z + 0.7)
    pillars = [
        massing.standing(x, x + 0.7, y, y + 0.7, z)
        for x in (left + 0.6, right - 1.3)
        for y in (y0 + 0.8, front - 2.0)
    ]
    drive = massing.standing(
        middle - 2.8, middle + 2.8, front - 2.2, front, 0.14
    )
    lobby = Facade(h, bands, layout, (0.4,))
    return tiers.add_ground(out, plan, lobby, [roof, *pillars, drive])


def _add_rooms(
    out: Assembly, p: Parameters, plan: np.ndarray, z0: float, goal: float
) -> float:
    groups, per_group, storey = tiers.divided(goal - z0, p.storey_height, 15)
    head = round(storey - 0.45, 2)
    french = bays.window(p.pitch - 1.2, 0.0, head, p.recess, mullions=1)
    plain = bays.window(1.5, 0.8, head, p.recess)
    front_rooms = {0: bays.rhythm(p.pitch, [french], margin=0.4)}
    others = bays.rhythm(p.side_pitch, [plain], margin=0.35)
    layout = bays.by_edge(front_rooms, others)
    band = Band(storey - 0.12, storey, -0.08)
    walls = Facade(storey, (band,), layout, (p.recess,))
    front, balconies = details.WallFrame(plan, 0), []
    for a, b in bays.stretches(front.length, p.pitch, 0.4):
        half, x = p.balcony_width / 2, (a + b) / 2
        ends = round(x - half, 2), round(x + half, 2)
        rail = details.balcony(*ends, p.balcony_reach, 0.0, p.rail)
        balconies.append(front.place(rail))
    return tiers.add_storeys(out, plan, walls, z0, groups, per_group, balconies)


def _add_sign(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """A blade sign up the front, at one end of the balconies."""
    front = details.WallFrame(plan, 0)
    x = 0.4 if p.sign_left else front.length - 0.4
    low, high = p.ground_height + 3.0, 0.7 * p.height
    blade = front.box(x - 0.15, x + 0.15, 0.25, 1.3, low, high)
    arms = (
        front.box(x - 0.08, x + 0.08, 0.0, 0.4, z, z + 0.15)
        for z in (low + 0.5, high - 0.7)
    )
    out.add("sign", blade, *arms, rgb=(0.55, 0.16, 0.14))
