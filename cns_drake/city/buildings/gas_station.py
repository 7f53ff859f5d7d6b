"""The gas station."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Wing,
    bays,
    equip_roof,
    outlines,
    roofs,
    solids,
)
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

# Depth of the windows behind the wall [m].
_RECESS_M = 0.18


class GasStation(Building):
    """The gas station: pumps under a canopy, shop, car wash and price sign."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.canopy_top = round(min(self.height, self.uniform(5.0, 5.8)), 2)
        # Height of the canopy's edge.
        self.fascia = self.uniform(0.6, 1.0, 2)
        # Whether the canopy is a pair of raised wings.
        self.sloped = self.chance(0.35)
        # Number of rows of pumps, and of pumps in each row.
        self.lanes = 2 if site.depth > 24.0 else 1
        self.pumps = int(min(max((site.width - 8.0) / 6.5, 1), 4))
        self.shop_depth = round(
            min(self.uniform(6.0, 9.0), 0.36 * site.depth), 2
        )
        self.shop_height = self.uniform(3.6, 4.3, 2)
        # Whether a car wash stands beside the shop.
        self.wash = site.width > 26.0 and self.chance(0.7)
        # Whether the car wash and the sign are on the left.
        self.mirrored = self.chance(0.5)
        self.roof_items = self.draw_roof_items("ac_unit vents ac_unit", 1, 4)

    def build(self) -> None:
        """Adds all parts of the gas station: a shop behind a canopy with pumps.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        shop_front = y1 - self.shop_depth - 0.3
        room = shop_front - 3.0 - (y0 + 1.5)
        deep = min(room, 7.0 * self.lanes + 1.5)
        middle = y0 + 1.5 + room / 2
        wide = min(x1 - x0 - 3.0, 6.5 * self.pumps + 4.0)
        x = (x0 + x1) / 2
        canopy = outlines.rectangle(
            x - wide / 2, middle - deep / 2, x + wide / 2, middle + deep / 2
        )
        _add_canopy(self, canopy)
        _add_islands(self, canopy)
        _add_shop(self, (x0, x1), (shop_front, y1 - 0.3))
        _add_sign(self, (x0, x1), y0)


def _pump_rows(p: GasStation, canopy: np.ndarray) -> list[float]:
    """Returns the y of each row of pumps [m]."""
    (_, y0), (_, y1) = canopy[0], canopy[2]
    return [y0 + (k + 0.5) * (y1 - y0) / p.lanes for k in range(p.lanes)]


def _add_canopy(p: GasStation, canopy: np.ndarray) -> None:
    """Adds the roof on its columns, lights on its underside."""
    x0, y0, x1, y1 = outlines.extent(canopy)
    top = p.canopy_top
    low = p.canopy_top - p.fascia
    if p.sloped:
        middle = (y0 + y1) / 2
        line = [(y0, top - 0.3), (middle, top - 0.9), (y1, top - 0.3)]
        p.add_to("brand", roofs.shell(line, x0, x1, 0.35))
        low = top - 1.2
        rim = (x0 + 0.5, x1 - 0.5, middle - 0.4, middle + 0.4, low, top - 0.6)
        p.add_to("steel", solids.box(*rim))
    else:
        p.add_to(
            "brand",
            solids.skirt(canopy, canopy, low, top),
            solids.roof_pan(canopy, top - 0.4, top, 0.25),
        )
        p.add_to("steel", solids.flat(canopy, low, up=False))
    count = max(2, p.pumps)
    for y in _pump_rows(p, canopy):
        for x in np.linspace(x0 + 2.2, x1 - 2.2, count).tolist():
            p.add_to("steel", solids.post(x, y, 0.22, low + 0.1))


def _add_islands(p: GasStation, canopy: np.ndarray) -> None:
    """Adds kerbed islands with their pumps and bollards."""
    (x0, _), (x1, _) = canopy[0], canopy[2]
    step = (x1 - x0 - 3.0) / p.pumps
    half = min(2.2, 0.4 * step)
    for y in _pump_rows(p, canopy):
        for k in range(p.pumps):
            x = x0 + 1.5 + (k + 0.5) * step
            kerb = (x - half, x + half, y - 0.55, y + 0.55, 0.18)
            p.add_to("concrete", solids.standing(*kerb))
            p.add_to("steel", _pump().moved((x, y, 0.15)))
            head = (x - 0.42, x + 0.42, y - 0.27, y + 0.27, 1.75, 2.1)
            p.add_to("brand", solids.box(*head))
            for u in (x - half + 0.15, x + half - 0.15):
                post = outlines.regular_polygon(0.08, 6, (u, y))
                p.add_to("brand", solids.prism(post, 0.15, 0.95))


def _add_shop(p: GasStation, xs: bays.Span, ys: bays.Span) -> None:
    x0, x1 = xs[0] + 0.4, xs[1] - 0.4
    wash = 5.2 if p.wash else 0.0
    wide = min(x1 - x0 - wash - (0.6 if wash else 0.0), 18.0)
    start = x1 - wide if p.mirrored else x0
    shop = Wing.flat((start, ys[0], start + wide, ys[1]), p.shop_height, 0.5)
    openings = Openings(p, shop)
    glazing = bays.shop_front(2.7, _RECESS_M, door=False)
    openings.add_bays((0,), 1.0, 3.4, [glazing], 0.4)
    doors = bays.window(2.0, 0.0, 2.5, _RECESS_M, mullions=1)
    openings.replace_by_bay(0, 0.55 * wide, 2.6, doors)
    openings.add_bays(
        (1, 2, 3), 1.0, 4.5, [bays.window(1.0, 1.6, 2.3, _RECESS_M)]
    )
    openings.enclose((_RECESS_M,), (Band(0.0, 0.25, -0.05),))
    sign = (0.3, wide - 0.3, -0.02, 0.3, 2.85, p.shop_height + 0.02)
    p.add_to("brand", shop.wall(0).box(*sign))
    equip_roof(p, shop.outline, shop.floor, p.roof_items)
    if wash:
        a = x0 if p.mirrored else x1 - wash
        _add_wash(p, (a, a + wash), ys)


def _add_wash(p: GasStation, xs: bays.Span, ys: bays.Span) -> None:
    """Adds a car wash: a gate in front and one behind."""
    box = Wing.flat((xs[0], ys[0], xs[1], ys[1]), p.shop_height - 0.2, 0.3)
    openings = Openings(p, box)
    for edge in (0, 2):
        openings.replace_by_bay(
            edge, (xs[1] - xs[0]) / 2, 4.4, bays.gate(3.4, 2.9, 0.5)
        )
    openings.add_bays((1, 3), 1.0, 3.0, [bays.window(2.2, 1.0, 2.4, _RECESS_M)])
    openings.enclose((_RECESS_M,))


def _add_sign(p: GasStation, xs: bays.Span, y0: float) -> None:
    """Adds the price sign at a front corner."""
    x = xs[0] + 1.2 if p.mirrored else xs[1] - 1.2
    y = y0 + 0.9
    top = p.height
    for u in (x - 0.7, x + 0.7):
        p.add_to("steel", solids.post(u, y, 0.1, top - 0.5))
    for k, z in enumerate(np.arange(top - 1.2, 1.9, -0.75).tolist()):
        board = solids.box(x - 0.85, x + 0.85, y - 0.16, y + 0.16, z, z + 0.65)
        p.add_to("steel" if k % 2 else "brand", board)
    crown = solids.box(x - 0.95, x + 0.95, y - 0.2, y + 0.2, top - 0.5, top)
    p.add_to("brand", crown)


def _pump() -> Mesh:
    """Returns a double-sided pump with screens and nozzles, on z = 0."""
    pieces = [solids.box(-0.38, 0.38, -0.22, 0.22, 0.0, 1.65, bottom=False)]
    for side in (-1.0, 1.0):
        y0, y1 = sorted((side * 0.2, side * 0.3))
        pieces.append(solids.box(-0.3, 0.3, y0, y1, 1.0, 1.45))
        for x in (-0.34, 0.26):
            pieces.append(solids.box(x, x + 0.1, y0, y1, 0.55, 0.95))
    return merge_meshes(*pieces)
