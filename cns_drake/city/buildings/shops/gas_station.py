"""The gas station: pumps under a canopy, a shop, a car wash, a price sign."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import bays, massing, wings
from cns_drake.city.buildings.parts.facades import Band
from cns_drake.city.buildings.parts.materials import Materials
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.buildings.parts.wings import Roof, Wing
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_BRANDS = (
    (0.74, 0.20, 0.16),
    (0.16, 0.40, 0.30),
    (0.18, 0.30, 0.52),
    (0.84, 0.62, 0.18),
)
_WALLS = ((0.86, 0.85, 0.82), (0.70, 0.68, 0.64), (0.60, 0.42, 0.34))
_STEEL = (0.80, 0.80, 0.80)
_CONCRETE = (0.62, 0.61, 0.58)
_RECESS = 0.18


class Parameters:
    """Parameters of a gas station; lengths in metres.

    Attributes:
        height: of the price sign, the highest thing.
        canopy_top: of the canopy.
        fascia: height of its edge.
        sloped: whether the canopy is a pair of raised wings.
        lanes: rows of pumps.
        pumps: in each row.
        shop_depth, shop_height: of the shop behind.
        wash: whether a car wash stands beside the shop.
        mirrored: whether the car wash and the sign are on the left.
    """

    def __init__(self, d: Dice):
        width, depth = d.width, d.depth
        self.height = d.height
        self.canopy_top = round(min(d.height, d.uniform(5.0, 5.8)), 2)
        self.fascia = d.uniform(0.6, 1.0, 2)
        self.sloped = d.chance(0.35)
        self.lanes = 2 if depth > 24.0 else 1
        self.pumps = int(np.clip((width - 8.0) / 6.5, 1, 4))
        self.shop_depth = round(min(d.uniform(6.0, 9.0), 0.36 * depth), 2)
        self.shop_height = d.uniform(3.6, 4.3, 2)
        self.wash = width > 26.0 and d.chance(0.7)
        self.mirrored = d.chance(0.5)
        self.roof_items = d.some_of("ac_unit vents ac_unit", 1, 4)
        self.rgb = d.pick(_WALLS)
        self.brand_rgb = d.pick(_BRANDS)


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the station on a rectangle, its forecourt in front."""
    materials = Materials(
        walls=p.rgb,
        glass=assembly.glass_rgb,
        brand=p.brand_rgb,
        steel=_STEEL,
        concrete=_CONCRETE,
    )
    x0, y0, x1, y1 = assembly.site.bounds
    shop_front = y1 - p.shop_depth - 0.3
    room = shop_front - 3.0 - (y0 + 1.5)
    deep = min(room, 7.0 * p.lanes + 1.5)
    middle = y0 + 1.5 + room / 2
    wide = min(x1 - x0 - 3.0, 6.5 * p.pumps + 4.0)
    x = (x0 + x1) / 2
    canopy = massing.rectangle(
        x - wide / 2, middle - deep / 2, x + wide / 2, middle + deep / 2
    )
    _add_canopy(materials, p, canopy)
    _add_islands(materials, p, canopy)
    _add_shop(assembly, materials, p, (x0, x1), (shop_front, y1 - 0.3))
    _add_sign(materials, p, (x0, x1), y0)
    materials.finish(assembly)


def _rows(p: Parameters, canopy) -> list[float]:
    """Returns where the rows of pumps lie, in y [m]."""
    (_, y0), (_, y1) = canopy[0], canopy[2]
    return [y0 + (k + 0.5) * (y1 - y0) / p.lanes for k in range(p.lanes)]


def _add_canopy(materials, p: Parameters, canopy) -> None:
    """Adds the roof on its columns, lights on its underside."""
    (x0, y0), (x1, y1) = canopy[0], canopy[2]
    top, low = p.canopy_top, p.canopy_top - p.fascia
    if p.sloped:
        middle = (y0 + y1) / 2
        line = [(y0, top - 0.3), (middle, top - 0.9), (y1, top - 0.3)]
        vertices = [
            (x, y, z - lower)
            for x in (x0, x1)
            for lower in (0.0, 0.35)
            for y, z in line
        ]
        faces = []
        for k in range(2):
            faces += [
                (k, 6 + k, 7 + k, 1 + k), (3 + k, 4 + k, 10 + k, 9 + k),
                (k, 1 + k, 4 + k, 3 + k), (6 + k, 9 + k, 10 + k, 7 + k),
            ]  # fmt: skip
        faces += [(0, 3, 9, 6), (2, 8, 11, 5)]
        materials.add("brand", Mesh(np.array(vertices), tuple(faces)))
        low = top - 1.2
        rim = massing.box(x0 + 0.5, x1 - 0.5, middle - 0.4, middle + 0.4,
                          low, top - 0.6)  # fmt: skip
        materials.add("steel", rim)
    else:
        materials.add(
            "brand",
            massing.skirt(canopy, canopy, low, top),
            massing.roof_pan(canopy, top - 0.4, top, 0.25),
        )
        soffit = massing.flat(canopy, low, up=False)
        materials.add("steel", soffit)
    count = max(2, p.pumps)
    for y in _rows(p, canopy):
        for x in np.linspace(x0 + 2.2, x1 - 2.2, count).tolist():
            materials.add("steel", massing.post(x, y, 0.22, low + 0.1))


def _add_islands(materials, p: Parameters, canopy) -> None:
    """Adds kerbed islands with their pumps and bollards."""
    (x0, _), (x1, _) = canopy[0], canopy[2]
    step = (x1 - x0 - 3.0) / p.pumps
    for y in _rows(p, canopy):
        for k in range(p.pumps):
            x = x0 + 1.5 + (k + 0.5) * step
            half = min(2.2, 0.4 * step)
            island = (x - half, x + half, y - 0.55, y + 0.55)
            kerb = massing.box(
                *island, -massing.FOUNDATION_M, 0.18, bottom=False
            )
            materials.add("concrete", kerb)
            materials.add("steel", _pump().moved((x, y, 0.15)))
            head = massing.box(x - 0.42, x + 0.42, y - 0.27, y + 0.27, 1.75,
                               2.1)  # fmt: skip
            materials.add("brand", head)
            for u in (x - half + 0.15, x + half - 0.15):
                post = massing.regular_polygon(0.08, 6, (u, y))
                materials.add("brand", massing.prism(post, 0.15, 0.95))


def _pump() -> Mesh:
    """A double-sided pump with its screen and nozzles, on z = 0."""
    pieces = [massing.box(-0.38, 0.38, -0.22, 0.22, 0.0, 1.65, bottom=False)]
    for side in (-1.0, 1.0):
        y0, y1 = sorted((side * 0.2, side * 0.3))
        pieces.append(massing.box(-0.3, 0.3, y0, y1, 1.0, 1.45))
        for x in (-0.34, 0.26):
            pieces.append(massing.box(x, x + 0.1, y0, y1, 0.55, 0.95))
    return merge_meshes(*pieces)


def _add_shop(assembly, materials, p: Parameters, xs, ys) -> None:
    x0, x1 = xs[0] + 0.4, xs[1] - 0.4
    wash = 5.2 if p.wash else 0.0
    wide = min(x1 - x0 - wash - (0.6 if wash else 0.0), 18.0)
    start = x1 - wide if p.mirrored else x0
    shop = Wing.at(
        start, *ys[:1], start + wide, ys[1], p.shop_height - 0.1,
        p.shop_height, Roof("flat", parapet=0.5),
    )  # fmt: skip
    openings = Openings(shop)
    glazing = bays.shop_front(2.7, _RECESS, door=False)
    openings.row((0,), 1.0, 3.4, [glazing], 0.4)
    openings.put(
        0, 0.55 * wide, 2.6, bays.window(2.0, 0.0, 2.5, _RECESS, mullions=1)
    )
    openings.row((1, 2, 3), 1.0, 4.5, [bays.window(1.0, 1.6, 2.3, _RECESS)])
    openings.add_walls(materials, (_RECESS,), (Band(0.0, 0.25, -0.05),))
    wings.add_roof(materials, shop)
    wall = shop.wall(0)
    sign = massing.box(0.3, wide - 0.3, -0.02, 0.3, 2.85, p.shop_height + 0.02)
    materials.add("brand", wall.place(sign))
    z = shop.top - shop.roof.parapet
    equip_roof(assembly, shop.outline, z, p.roof_items)
    if wash:
        a = x0 if p.mirrored else x1 - wash
        _add_wash(materials, p, (a, a + wash), ys)


def _add_wash(materials, p: Parameters, xs, ys) -> None:
    """Adds a car wash: a gate in front and one behind."""
    box = Wing.at(
        xs[0], ys[0], xs[1], ys[1], p.shop_height - 0.3, p.shop_height - 0.2,
        Roof("flat", parapet=0.3),
    )  # fmt: skip
    openings = Openings(box)
    for edge in (0, 2):
        openings.put(edge, (xs[1] - xs[0]) / 2, 4.4, bays.gate(3.4, 2.9, 0.5))
    openings.row((1, 3), 1.0, 3.0, [bays.window(2.2, 1.0, 2.4, _RECESS)])
    openings.add_walls(materials, (_RECESS,))
    wings.add_roof(materials, box)


def _add_sign(materials, p: Parameters, xs, y0: float) -> None:
    """Adds the price sign at a front corner."""
    x = xs[0] + 1.2 if p.mirrored else xs[1] - 1.2
    y, top = y0 + 0.9, p.height
    for u in (x - 0.7, x + 0.7):
        materials.add("steel", massing.post(u, y, 0.1, top - 0.5))
    for k, z in enumerate(np.arange(top - 1.2, 1.9, -0.75).tolist()):
        board = massing.box(x - 0.85, x + 0.85, y - 0.16, y + 0.16, z, z + 0.65)
        materials.add("steel" if k % 2 else "brand", board)
    crown = massing.box(x - 0.95, x + 0.95, y - 0.2, y + 0.2, top - 0.5, top)
    materials.add("brand", crown)
