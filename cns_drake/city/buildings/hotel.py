"""The hotel: balconies along rounded walls, a forecourt, a rooftop bar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.buildings import bays, details, massing, outlines, tiers
from cns_drake.city.buildings.facades import Band, Facade
from cns_drake.city.buildings.roof_equipment import equip_roof
from cns_drake.city.buildings.site import (
    FOUNDATION_M,
    Archetype,
    Assembly,
    Site,
)
from cns_drake.city.geometry.mesh import merge_meshes
from cns_drake.city.geometry.structures import Model

_PAINTS = ((0.86, 0.83, 0.77), (0.80, 0.72, 0.62), (0.72, 0.75, 0.76))
_FORECOURT_M = 7.0


@dataclass(frozen=True)
class Hotel:
    """Parameters of a hotel; lengths in metres."""

    height: float
    ground_height: float
    storey_height: float
    round_ends: bool
    corner: float
    pitch: float
    side_pitch: float
    recess: float
    balcony_reach: float
    balcony_width: float
    rail: float
    bar_height: float
    bar_inset: float
    sign_left: bool
    roof_items: tuple[str, ...]
    rgb: tuple[float, float, float]


def draw(site: Site, height: float, rng: np.random.Generator) -> Hotel:
    """Draws the parameters of one hotel."""
    x0, y0, x1, y1 = site.bounds
    depth = y1 - y0 - _FORECOURT_M
    pitch = max(float(rng.uniform(3.6, 4.6)), (x1 - x0) / 11)
    return Hotel(
        height=height,
        ground_height=round(float(rng.uniform(5.0, 6.2)), 2),
        storey_height=float(rng.uniform(3.1, 3.4)),
        round_ends=bool(rng.random() < 0.5 and x1 - x0 > 1.5 * depth),
        corner=round(float(rng.uniform(0.2, 0.35)) * min(depth, x1 - x0), 1),
        pitch=pitch,
        side_pitch=max(2.7, (x1 - x0 + 2 * depth) / 34),
        recess=round(float(rng.uniform(0.2, 0.35)), 2),
        balcony_reach=round(float(rng.uniform(1.1, 1.45)), 2),
        balcony_width=round(float(rng.uniform(0.6, 0.95)) * pitch, 2),
        rail=round(float(rng.uniform(0.95, 1.1)), 2),
        bar_height=round(float(rng.uniform(4.0, 5.0)), 1),
        bar_inset=round(float(rng.uniform(1.8, 3.0)), 1),
        sign_left=bool(rng.random() < 0.5),
        roof_items=(
            "roof_cooling_tower",
            "roof_air_handler",
            "roof_mast",
            "roof_vents",
            "roof_ac_unit",
        ),
        rgb=_PAINTS[int(rng.integers(len(_PAINTS)))],
    )


def build(p: Hotel, site: Site, rng: np.random.Generator) -> Model:
    """Builds the hotel on a rectangle, behind a forecourt."""
    assembly = Assembly(site.name, p.rgb)
    x0, y0, x1, y1 = site.bounds
    front = y0 + _FORECOURT_M
    if p.round_ends:
        plan = outlines.stadium(x0, front, x1, y1, 3.2)
    else:
        block = massing.rectangle(x0, front, x1, y1)
        corners = {0: p.corner, 1: p.corner}
        plan = massing.rounded(block, corners, 2.8)
    top = _add_lobby(assembly, p, plan, y0)
    goal = p.height - p.bar_height - 1.2
    top = _add_rooms(assembly, p, plan, top, goal)
    edge = Facade(1.2, (Band(0.0, 0.3, -0.15), Band(0.9, 1.2, -0.2)))
    roof = tiers.add_crown(assembly, plan, edge, top, 1.1)
    bar = massing.inset(plan, p.bar_inset)
    height = round(p.height - roof, 3)
    walls = Facade(
        height,
        (Band(0.4, height - 1.2, 0.3), Band(height - 0.9, height - 0.5, -1.3)),
        glass=(0.3,),
    )
    roof = tiers.add_crown(assembly, bar, walls, roof, 0.4, part="bar")
    equip_roof(assembly, bar, roof, p.roof_items, rng)
    _add_sign(assembly, p, plan)
    return assembly.model(site)


def _add_lobby(assembly, p: Hotel, plan, y0) -> float:
    h = p.ground_height
    glazing = bays.rhythm(
        p.pitch, [bays.ribbon(0.4, h - 1.2, 0.4, 0.5)], margin=0.5
    )
    door = bays.with_middle(glazing, bays.entrance(4.4, 3.4, 1.5), 6.4)
    lobby = Facade(
        h,
        (Band(0.0, 0.4, -0.1), Band(h - 0.8, h - 0.3, -0.4)),
        bays.by_edge({0: door}, glazing),
        glass=(0.4,),
    )
    # The drive-in roof stands on four pillars in the forecourt.
    middle = float(np.mean(plan[:2, 0]))
    front = float(plan[0, 1])
    left, right, z = middle - 6.0, middle + 6.0, 4.2
    roof = massing.box(left, right, y0 + 0.3, front + 0.2, z, z + 0.7)
    pillars = [
        massing.box(x, x + 0.7, y, y + 0.7, -FOUNDATION_M, z, bottom=False)
        for x in (left + 0.6, right - 1.3)
        for y in (y0 + 0.8, front - 2.0)
    ]
    drive = massing.prism(
        massing.rectangle(middle - 2.8, front - 2.2, middle + 2.8, front),
        -FOUNDATION_M,
        0.14,
    )
    return tiers.add_ground(assembly, plan, lobby, [roof, *pillars, drive])


def _add_rooms(assembly, p: Hotel, plan, z0, goal) -> float:
    groups, per_group, storey = tiers.divided(goal - z0, p.storey_height, 15)
    head = round(storey - 0.45, 2)
    french = bays.window(p.pitch - 1.2, 0.0, head, p.recess, mullions=1)
    plain = bays.window(1.5, 0.8, head, p.recess)
    layout = {0: bays.rhythm(p.pitch, [french], margin=0.4)}
    others = bays.rhythm(p.side_pitch, [plain], margin=0.35)
    walls = Facade(
        storey,
        (Band(storey - 0.12, storey, -0.08),),
        bays.by_edge(layout, others),
        glass=(p.recess,),
    )
    front = details.WallFrame(plan, 0)
    balconies = []
    for a, b in bays.stretches(front.length, p.pitch, 0.4):
        half, x = p.balcony_width / 2, (a + b) / 2
        rail = details.balcony(
            round(x - half, 2), round(x + half, 2), p.balcony_reach, 0.0, p.rail
        )
        balconies.append(front.place(rail))
    return tiers.add_storeys(
        assembly, plan, walls, z0, groups, per_group, balconies
    )


def _add_sign(assembly, p: Hotel, plan) -> None:
    """A blade sign up the front, at one end of the balconies."""
    front = details.WallFrame(plan, 0)
    x = 0.4 if p.sign_left else front.length - 0.4
    low, high = p.ground_height + 3.0, 0.7 * p.height
    blade = massing.box(x - 0.15, x + 0.15, 0.25, 1.3, low, high)
    arms = [
        massing.box(x - 0.08, x + 0.08, 0.0, 0.4, z, z + 0.15)
        for z in (low + 0.5, high - 0.7)
    ]
    sign = front.place(merge_meshes([blade, *arms]))
    assembly.add("sign", sign, rgb=(0.55, 0.16, 0.14))


HOTEL = Archetype(
    name="hotel",
    draw=draw,
    build=build,
    heights=(25.0, 80.0),
    widths=(20.0, 70.0),
)
