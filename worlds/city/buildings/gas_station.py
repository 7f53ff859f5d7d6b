"""The gas station."""

import numpy as np

from worlds.city.facades import (
    Building,
    Openings,
    Wing,
    around,
    bays,
    foot_band,
    roofs,
    solids,
)
from worlds.shapes import Mesh, equip_roof, merge_meshes, outlines

# Depth of the windows behind the wall [m].
_RECESS_M = 0.18
# Least depth of a site with two rows of pumps [m].
_TWO_ROWS_DEPTH_M = 24.0
# Length of the canopy for each pump of a row [m].
_PUMP_PITCH_M = 6.5
# Greatest number of pumps in a row.
_MOST_PUMPS = 4
# Depth of the canopy for each row of pumps [m].
_LANE_M = 7.0
# Free strip in front of the canopy [m].
_FORECOURT_M = 1.5
# Distance between canopy and shop [m].
_SHOP_GAP_M = 3.0
# Strip between shop and the back of the site [m].
_BACK_M = 0.3
# Width of a car wash [m].
_WASH_M = 5.2
# Least width of a site with a car wash [m].
_WASH_SITE_M = 26.0
# Greatest width of the shop [m].
_MOST_SHOP_M = 18.0
# Distance of the islands from the ends of the canopy [m].
_ISLAND_END_M = 1.5
# Height of the islands [m].
_KERB_M = 0.18
# Height of the feet of pumps and bollards, just inside the islands [m].
_ISLAND_M = 0.15
# Distance from one board of the price sign to the next [m].
_BOARD_PITCH_M = 0.75


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
        self.lanes = 2 if site.depth > _TWO_ROWS_DEPTH_M else 1
        fitting = (site.width - 8.0) / _PUMP_PITCH_M
        self.pumps = int(min(max(fitting, 1), _MOST_PUMPS))
        self.shop_depth = round(
            min(self.uniform(6.0, 9.0), 0.36 * site.depth), 2
        )
        self.shop_height = self.uniform(3.6, 4.3, digits=2)
        # Whether a car wash stands beside the shop.
        self.wash = site.width > _WASH_SITE_M and self.chance(0.7)
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
        shop_front = y1 - self.shop_depth - _BACK_M
        room = shop_front - _SHOP_GAP_M - (y0 + _FORECOURT_M)
        deep = min(room, _LANE_M * self.lanes + 1.5)
        wide = min(x1 - x0 - 3.0, _PUMP_PITCH_M * self.pumps + 4.0)
        x, y = (x0 + x1) / 2, y0 + _FORECOURT_M + room / 2
        canopy = outlines.rectangle(
            x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2
        )
        _add_canopy(self, canopy)
        _add_islands(self, canopy)
        _add_shop(self, (x0, x1), (shop_front, y1 - _BACK_M))
        _add_sign(self, (x0, x1), y0)


def _pump_rows(station: GasStation, canopy: np.ndarray) -> list[float]:
    """Returns the y of each row of pumps [m]."""
    (_, y0), (_, y1) = canopy[0], canopy[2]
    return [
        y0 + (k + 0.5) * (y1 - y0) / station.lanes for k in range(station.lanes)
    ]


def _add_canopy(station: GasStation, canopy: np.ndarray) -> None:
    """Adds the roof on its columns, which is flat or a pair of raised wings.

    `canopy` is the outline (4, 2) of the roof [m].
    """
    x0, _, x1, _ = outlines.extent(canopy)
    if station.sloped:
        low = _add_sloped_canopy(station, canopy)
    else:
        low = _add_flat_canopy(station, canopy)
    count = max(2, station.pumps)
    for y in _pump_rows(station, canopy):
        for x in np.linspace(x0 + 2.2, x1 - 2.2, count).tolist():
            station.add_to("steel", solids.post(x, y, half=0.22, z1=low + 0.1))


def _add_sloped_canopy(station: GasStation, canopy: np.ndarray) -> float:
    """Adds a roof of two raised wings; returns its lowest height [m]."""
    x0, y0, x1, y1 = outlines.extent(canopy)
    top = station.canopy_top
    middle = (y0 + y1) / 2
    line = [(y0, top - 0.3), (middle, top - 0.9), (y1, top - 0.3)]
    wings = roofs.shell(line, start=x0, end=x1, thickness=0.35)
    low = top - 1.2
    gutter = solids.box(
        x=(x0 + 0.5, x1 - 0.5), y=around(middle, 0.4), z=(low, top - 0.6)
    )
    station.add_to("brand", wings)
    station.add_to("steel", gutter)
    return low


def _add_flat_canopy(station: GasStation, canopy: np.ndarray) -> float:
    """Adds a flat roof behind a fascia; returns its lowest height [m]."""
    top = station.canopy_top
    low = top - station.fascia
    station.add_to(
        "brand",
        solids.skirt(canopy, canopy, z0=low, z1=top),
        solids.roof_pan(canopy, z_floor=top - 0.4, z_top=top, thickness=0.25),
    )
    station.add_to("steel", solids.flat(canopy, low, up=False))
    return low


def _add_islands(station: GasStation, canopy: np.ndarray) -> None:
    """Adds an island with a pump at each place of the rows.

    `canopy` is the outline (4, 2) of the roof above them [m].
    """
    (x0, _), (x1, _) = canopy[0], canopy[2]
    step = (x1 - x0 - 2 * _ISLAND_END_M) / station.pumps
    half = min(2.2, 0.4 * step)
    for y in _pump_rows(station, canopy):
        for k in range(station.pumps):
            x = x0 + _ISLAND_END_M + (k + 0.5) * step
            _add_island(station, x, y, half)


def _add_island(station: GasStation, x: float, y: float, half: float) -> None:
    """Adds a kerbed island with a pump between two bollards.

    `x` and `y` are the middle of the island, and `half` is half its length [m].
    """
    island = solids.standing(x=around(x, half), y=around(y, 0.55), z1=_KERB_M)
    station.add_to("concrete", island)
    station.add_to("steel", _pump().moved((x, y, _ISLAND_M)))
    head = solids.box(x=around(x, 0.42), y=around(y, 0.27), z=(1.75, 2.1))
    station.add_to("brand", head)
    for x_bollard in (x - half + 0.15, x + half - 0.15):
        outline = outlines.regular_polygon(
            radius=0.08, count=6, center=(x_bollard, y)
        )
        bollard = solids.prism(outline, z0=_ISLAND_M, z1=0.95)
        station.add_to("brand", bollard)


def _add_shop(station: GasStation, xs: bays.Span, ys: bays.Span) -> None:
    """Adds the shop, with the car wash beside it if there is one.

    `xs` is the least and the greatest x of the site, and `ys` those of y of the
    shop [m].
    """
    x0, x1 = xs[0] + 0.4, xs[1] - 0.4
    y0, y1 = ys
    beside = _WASH_M if station.wash else 0.0
    gap = 0.6 if station.wash else 0.0
    wide = min(x1 - x0 - beside - gap, _MOST_SHOP_M)
    start = x1 - wide if station.mirrored else x0
    area = (start, y0, start + wide, y1)
    shop = Wing.flat(area, top=station.shop_height, parapet=0.5)
    openings = Openings(station, shop)
    glazing = bays.shop_front(head=2.7, depth=_RECESS_M, door=False)
    openings.add_bays((0,), z=1.0, pitch=3.4, choices=[glazing], margin=0.4)
    doors = bays.window(
        width=2.0, sill=0.0, head=2.5, depth=_RECESS_M, mullions=1
    )
    openings.replace_by_bay(0, x=0.55 * wide, width=2.6, bay=doors)
    window = bays.window(width=1.0, sill=1.6, head=2.3, depth=_RECESS_M)
    openings.add_bays((1, 2, 3), z=1.0, pitch=4.5, choices=[window])
    openings.enclose((_RECESS_M,), bands=(foot_band(height=0.25, reach=0.05),))
    sign = shop.wall(0).box(
        x=(0.3, wide - 0.3),
        y=(-0.02, 0.3),
        z=(2.85, station.shop_height + 0.02),
    )
    station.add_to("brand", sign)
    equip_roof(station, shop.outline, shop.floor, station.roof_items)
    if station.wash:
        wash_start = x0 if station.mirrored else x1 - _WASH_M
        _add_wash(station, (wash_start, y0, wash_start + _WASH_M, y1))


def _add_wash(station: GasStation, area: outlines.Area) -> None:
    """Adds a car wash on its ground [m]: a gate in front and one behind."""
    wash = Wing.flat(area, top=station.shop_height - 0.2, parapet=0.3)
    x0, _, x1, _ = area
    openings = Openings(station, wash)
    gate = bays.gate(width=3.4, height=2.9, depth=0.5)
    for edge in (0, 2):
        openings.replace_by_bay(edge, x=(x1 - x0) / 2, width=4.4, bay=gate)
    window = bays.window(width=2.2, sill=1.0, head=2.4, depth=_RECESS_M)
    openings.add_bays((1, 3), z=1.0, pitch=3.0, choices=[window])
    openings.enclose((_RECESS_M,))


def _add_sign(station: GasStation, xs: bays.Span, y0: float) -> None:
    """Adds the price sign at a front corner of the site.

    `xs` is the least and the greatest x of the site, and `y0` its least y [m].
    """
    x = xs[0] + 1.2 if station.mirrored else xs[1] - 1.2
    y = y0 + 0.9
    top = station.height
    for x_post in around(x, 0.7):
        post = solids.post(x_post, y, half=0.1, z1=top - 0.5)
        station.add_to("steel", post)
    heights = np.arange(top - 1.2, 1.9, -_BOARD_PITCH_M).tolist()
    for k, z in enumerate(heights):
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
