"""The gas station: pumps under a canopy, a shop, a car wash, a price sign."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, massing, roofs
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Wing
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

    def __init__(self, d: Dice) -> None:
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


def build(p: Parameters, out: Assembly) -> None:
    """Builds the station on a rectangle, its forecourt in front."""
    out.paint(
        walls=p.rgb,
        glass=out.glass_rgb,
        brand=p.brand_rgb,
        steel=_STEEL,
        concrete=_CONCRETE,
    )
    x0, y0, x1, y1 = out.site.bounds
    shop_front = y1 - p.shop_depth - 0.3
    room = shop_front - 3.0 - (y0 + 1.5)
    deep = min(room, 7.0 * p.lanes + 1.5)
    middle = y0 + 1.5 + room / 2
    wide = min(x1 - x0 - 3.0, 6.5 * p.pumps + 4.0)
    x = (x0 + x1) / 2
    canopy = massing.rectangle(
        x - wide / 2, middle - deep / 2, x + wide / 2, middle + deep / 2
    )
    _add_canopy(out, p, canopy)
    _add_islands(out, p, canopy)
    _add_shop(out, p, (x0, x1), (shop_front, y1 - 0.3))
    _add_sign(out, p, (x0, x1), y0)


def _rows(p: Parameters, canopy: np.ndarray) -> list[float]:
    """Returns where the rows of pumps lie, in y [m]."""
    (_, y0), (_, y1) = canopy[0], canopy[2]
    return [y0 + (k + 0.5) * (y1 - y0) / p.lanes for k in range(p.lanes)]


def _add_canopy(out: Assembly, p: Parameters, canopy: np.ndarray) -> None:
    """Adds the roof on its columns, lights on its underside."""
    x0, y0, x1, y1 = massing.extent(canopy)
    top, low = p.canopy_top, p.canopy_top - p.fascia
    if p.sloped:
        middle = (y0 + y1) / 2
        line = [(y0, top - 0.3), (middle, top - 0.9), (y1, top - 0.3)]
        out.add_to("brand", roofs.shell(line, x0, x1, 0.35))
        low = top - 1.2
        rim = (x0 + 0.5, x1 - 0.5, middle - 0.4, middle + 0.4, low, top - 0.6)
        out.add_to("steel", massing.box(*rim))
    else:
        out.add_to(
            "brand",
            massing.skirt(canopy, canopy, low, top),
            massing.roof_pan(canopy, top - 0.4, top, 0.25),
        )
        out.add_to("steel", massing.flat(canopy, low, up=False))
    count = max(2, p.pumps)
    for y in _rows(p, canopy):
        for x in np.linspace(x0 + 2.2, x1 - 2.2, count).tolist():
            out.add_to("steel", massing.post(x, y, 0.22, low + 0.1))


def _add_islands(out: Assembly, p: Parameters, canopy: np.ndarray) -> None:
    """Adds kerbed islands with their pumps and bollards."""
    (x0, _), (x1, _) = canopy[0], canopy[2]
    step = (x1 - x0 - 3.0) / p.pumps
    half = min(2.2, 0.4 * step)
    for y in _rows(p, canopy):
        for k in range(p.pumps):
            x = x0 + 1.5 + (k + 0.5) * step
            kerb = (x - half, x + half, y - 0.55, y + 0.55, 0.18)
            out.add_to("concrete", massing.standing(*kerb))
            out.add_to("steel", _pump().moved((x, y, 0.15)))
            head = (x - 0.42, x + 0.42, y - 0.27, y + 0.27, 1.75, 2.1)
            out.add_to("brand", massing.box(*head))
            for u in (x - half + 0.15, x + half - 0.15):
                post = massing.regular_polygon(0.08, 6, (u, y))
                out.add_to("brand", massing.prism(post, 0.15, 0.95))


def _pump() -> Mesh:
    """A double-sided pump with its screen and nozzles, on z = 0."""
    pieces = [massing.box(-0.38, 0.38, -0.22, 0.22, 0.0, 1.65, bottom=False)]
    for side in (-1.0, 1.0):
        y0, y1 = sorted((side * 0.2, side * 0.3))
        pieces.append(massing.box(-0.3, 0.3, y0, y1, 1.0, 1.45))
        for x in (-0.34, 0.26):
            pieces.append(massing.box(x, x + 0.1, y0, y1, 0.55, 0.95))
    return merge_meshes(*pieces)


def _add_shop(
    out: Assembly, p: Parameters, xs: bays.Span, ys: bays.Span
) -> None:
    x0, x1 = xs[0] + 0.4, xs[1] - 0.4
    wash = 5.2 if p.wash else 0.0
    wide = min(x1 - x0 - wash - (0.6 if wash else 0.0), 18.0)
    start = x1 - wide if p.mirrored else x0
    shop = Wing.flat(start, ys[0], start + wide, ys[1], p.shop_height, 0.5)
    openings = Openings(shop)
    glazing = bays.shop_front(2.7, _RECESS, door=False)
    openings.row((0,), 1.0, 3.4, [glazing], 0.4)
    doors = bays.window(2.0, 0.0, 2.5, _RECESS, mullions=1)
    openings.put(0, 0.55 * wide, 2.6, doors)
    openings.row((1, 2, 3), 1.0, 4.5, [bays.window(1.0, 1.6, 2.3, _RECESS)])
    openings.enclose(out, (_RECESS,), (Band(0.0, 0.25, -0.05),))
    sign = (0.3, wide - 0.3, -0.02, 0.3, 2.85, p.shop_height + 0.02)
    out.add_to("brand", shop.wall(0).box(*sign))
    equip_roof(out, shop.outline, shop.floor, p.roof_items)
    if wash:
        a = x0 if p.mirrored else x1 - wash
        _add_wash(out, p, (a, a + wash), ys)


def _add_wash(
    out: Assembly, p: Parameters, xs: bays.Span, ys: bays.Span
) -> None:
    """Adds a car wash: a gate in front and one behind."""
    box = Wing.flat(xs[0], ys[0], xs[1], ys[1], p.shop_height - 0.2, 0.3)
    openings = Openings(box)
    for edge in (0, 2):
        openings.put(edge, (xs[1] - xs[0]) / 2, 4.4, bays.gate(3.4, 2.9, 0.5))
    openings.row((1, 3), 1.0, 3.0, [bays.window(2.2, 1.0, 2.4, _RECESS)])
    openings.enclose(out, (_RECESS,))


def _add_sign(out: Assembly, p: Parameters, xs: bays.Span, y0: float) -> None:
    """Adds the price sign at a front corner."""
    x = xs[0] + 1.2 if p.mirrored else xs[1] - 1.2
    y, top = y0 + 0.9, p.height
    for u in (x - 0.7, x + 0.7):
        out.add_to("steel", massing.post(u, y, 0.1, top - 0.5))
    for k, z in enumerate(np.arange(top - 1.2, 1.9, -0.75).tolist()):
        board = massing.box(x - 0.85, x + 0.85, y - 0.16, y + 0.16, z, z + 0.65)
        out.add_to("steel" if k % 2 else "brand", board)
    crown = massing.box(x - 0.95, x + 0.95, y - 0.2, y + 0.2, top - 0.5, top)
    out.add_to("brand", crown)
