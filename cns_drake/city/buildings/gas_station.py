"""The gas station."""

import numpy as np

from cns_drake.city.facades import (
    Building,
    Openings,
    Wing,
    around,
    bays,
    equip_roof,
    foot_band,
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
        self.fascia = self.uniform(0.6, 1.0, digits=2)
        # Whether the canopy is a pair of raised wings.
        self.sloped = self.chance(0.35)
        # Number of rows of pumps, and of pumps in each row.
        self.lanes = 2 if site.depth > 24.0 else 1
        self.pumps = int(min(max((site.width - 8.0) / 6.5, 1), 4))
        self.shop_depth = round(
            min(self.uniform(6.0, 9.0), 0.36 * site.depth), 2
        )
        self.shop_height = self.uniform(3.6, 4.3, digits=2)
        # Whether a car wash stands beside the shop.
        self.wash = site.width > 26.0 and self.chance(0.7)
        # Whether the car wash and the sign are on the left.
        self.mirrored = self.chance(0.5)
        self.roof_items = self.draw_roof_items(
            "ac_unit vents ac_unit", low=1, high=4
        )

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


def _pump_rows(station: GasStation, canopy: np.ndarray) -> list[float]:
    """Returns the y of each row of pumps [m]."""
    (_, y0), (_, y1) = canopy[0], canopy[2]
    return [
        y0 + (k + 0.5) * (y1 - y0) / station.lanes for k in range(station.lanes)
    ]


def _add_canopy(station: GasStation, canopy: np.ndarray) -> None:
    """Adds the roof on its columns, lights on its underside."""
    x0, y0, x1, y1 = outlines.extent(canopy)
    top = station.canopy_top
    low = station.canopy_top - station.fascia
    if station.sloped:
        middle = (y0 + y1) / 2
        line = [(y0, top - 0.3), (middle, top - 0.9), (y1, top - 0.3)]
        station.add_to(
            "brand", roofs.shell(line, start=x0, end=x1, thickness=0.35)
        )
        low = top - 1.2
        station.add_to(
            "steel",
            solids.box(
                x=(x0 + 0.5, x1 - 0.5),
                y=around(middle, 0.4),
                z=(low, top - 0.6),
            ),
        )
    else:
        station.add_to(
            "brand",
            solids.skirt(canopy, canopy, z0=low, z1=top),
            solids.roof_pan(
                canopy, z_floor=top - 0.4, z_top=top, thickness=0.25
            ),
        )
        station.add_to("steel", solids.flat(canopy, low, up=False))
    count = max(2, station.pumps)
    for y in _pump_rows(station, canopy):
        for x in np.linspace(x0 + 2.2, x1 - 2.2, count).tolist():
            station.add_to("steel", solids.post(x, y, half=0.22, z1=low + 0.1))


def _add_islands(station: GasStation, canopy: np.ndarray) -> None:
    """Adds kerbed islands with their pumps and bollards."""
    (x0, _), (x1, _) = canopy[0], canopy[2]
    step = (x1 - x0 - 3.0) / station.pumps
    half = min(2.2, 0.4 * step)
    for y in _pump_rows(station, canopy):
        for k in range(station.pumps):
            x = x0 + 1.5 + (k + 0.5) * step
            station.add_to(
                "concrete",
                solids.standing(x=around(x, half), y=around(y, 0.55), z1=0.18),
            )
            station.add_to("steel", _pump().moved((x, y, 0.15)))
            station.add_to(
                "brand",
                solids.box(
                    x=around(x, 0.42),
                    y=around(y, 0.27),
                    z=(1.75, 2.1),
                ),
            )
            for u in (x - half + 0.15, x + half - 0.15):
                post = outlines.regular_polygon(
                    radius=0.08, count=6, center=(u, y)
                )
                station.add_to("brand", solids.prism(post, z0=0.15, z1=0.95))


def _add_shop(station: GasStation, xs: bays.Span, ys: bays.Span) -> None:
    x0, x1 = xs[0] + 0.4, xs[1] - 0.4
    wash = 5.2 if station.wash else 0.0
    wide = min(x1 - x0 - wash - (0.6 if wash else 0.0), 18.0)
    start = x1 - wide if station.mirrored else x0
    shop = Wing.flat(
        (start, ys[0], start + wide, ys[1]),
        top=station.shop_height,
        parapet=0.5,
    )
    openings = Openings(station, shop)
    glazing = bays.shop_front(head=2.7, depth=_RECESS_M, door=False)
    openings.add_bays((0,), z=1.0, pitch=3.4, choices=[glazing], margin=0.4)
    doors = bays.window(
        width=2.0, sill=0.0, head=2.5, depth=_RECESS_M, mullions=1
    )
    openings.replace_by_bay(0, x=0.55 * wide, width=2.6, bay=doors)
    openings.add_bays(
        (1, 2, 3),
        z=1.0,
        pitch=4.5,
        choices=[bays.window(width=1.0, sill=1.6, head=2.3, depth=_RECESS_M)],
    )
    openings.enclose((_RECESS_M,), bands=(foot_band(height=0.25, reach=0.05),))
    station.add_to(
        "brand",
        shop.wall(0).box(
            x=(0.3, wide - 0.3),
            y=(-0.02, 0.3),
            z=(2.85, station.shop_height + 0.02),
        ),
    )
    equip_roof(station, shop.outline, shop.floor, station.roof_items)
    if wash:
        a = x0 if station.mirrored else x1 - wash
        _add_wash(station, (a, a + wash), ys)


def _add_wash(station: GasStation, xs: bays.Span, ys: bays.Span) -> None:
    """Adds a car wash: a gate in front and one behind."""
    box = Wing.flat(
        (xs[0], ys[0], xs[1], ys[1]), top=station.shop_height - 0.2, parapet=0.3
    )
    openings = Openings(station, box)
    for edge in (0, 2):
        openings.replace_by_bay(
            edge,
            x=(xs[1] - xs[0]) / 2,
            width=4.4,
            bay=bays.gate(width=3.4, height=2.9, depth=0.5),
        )
    openings.add_bays(
        (1, 3),
        z=1.0,
        pitch=3.0,
        choices=[bays.window(width=2.2, sill=1.0, head=2.4, depth=_RECESS_M)],
    )
    openings.enclose((_RECESS_M,))


def _add_sign(station: GasStation, xs: bays.Span, y0: float) -> None:
    """Adds the price sign at a front corner."""
    x = xs[0] + 1.2 if station.mirrored else xs[1] - 1.2
    y = y0 + 0.9
    top = station.height
    for u in (x - 0.7, x + 0.7):
        station.add_to("steel", solids.post(u, y, half=0.1, z1=top - 0.5))
    for k, z in enumerate(np.arange(top - 1.2, 1.9, -0.75).tolist()):
        board = solids.box(
            x=around(x, 0.85), y=around(y, 0.16), z=(z, z + 0.65)
        )
        station.add_to("steel" if k % 2 else "brand", board)
    crown = solids.box(x=around(x, 0.95), y=around(y, 0.2), z=(top - 0.5, top))
    station.add_to("brand", crown)


def _pump() -> Mesh:
    """Returns a double-sided pump with screens and nozzles, on z = 0."""
    pieces = [
        solids.box(
            x=(-0.38, 0.38), y=(-0.22, 0.22), z=(0.0, 1.65), bottom=False
        )
    ]
    for side in (-1.0, 1.0):
        y0, y1 = sorted((side * 0.2, side * 0.3))
        pieces.append(solids.box(x=(-0.3, 0.3), y=(y0, y1), z=(1.0, 1.45)))
        for x in (-0.34, 0.26):
            pieces.append(
                solids.box(x=(x, x + 0.1), y=(y0, y1), z=(0.55, 0.95))
            )
    return merge_meshes(*pieces)
