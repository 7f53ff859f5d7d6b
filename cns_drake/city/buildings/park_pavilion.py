"""The park pavilion."""

import itertools
import math

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    add_railing,
    bays,
    facade_mesh,
    glass_mesh,
    outlines,
    porches,
    roofs,
    solids,
)

# Overhang of the roof [m].
_EAVES_M = 0.6


class ParkPavilion(Building):
    """The park pavilion: a bandstand, a shelter with tables, or a tea house."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        long = not 0.67 < site.width / site.depth < 1.5
        self.floor = self.uniform(0.3, 0.9, 2)
        # `bandstand` (open, round), `tea_house` (glazed, round) or `shelter`
        # (open, long).
        self.form = "shelter"
        if not long:
            self.form = self.pick(
                ("bandstand", "bandstand", "tea_house", "shelter")
            )
        self.sides = self.pick((6, 8, 8))
        # Height of the posts above the deck.
        self.eaves = round(max(2.2, 0.5 * (self.height - self.floor)), 2)
        self.lantern = self.height > 5.0 and self.chance(0.5)
        # Whether the roof is bent like a bell.
        self.bell = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the pavilion.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        if self.form == "shelter":
            _add_shelter(self, (x0, y0, x1, y1))
        else:
            center = ((x0 + x1) / 2, (y0 + y1) / 2)
            reach = min(x1 - x0, y1 - y0) / 2 - _EAVES_M
            _add_round(self, center, reach)


def _add_round(p: ParkPavilion, center: outlines.Point, reach: float) -> None:
    """Adds a polygonal deck, posts or glazed walls, and a roof."""
    phase = -math.pi / 2 + math.pi / p.sides
    count = max(2, round(p.floor / 0.17))
    radius = (reach - 0.45 * 0.3 * count) / math.cos(math.pi / p.sides)
    radius = min(radius, reach, 7.0)
    plan = outlines.regular_polygon(radius, p.sides, center, phase)
    # The front edge, which faces -y, ends at the corner of `phase`.
    plan = np.roll(plan, 1, axis=0)
    p.add_to("stone", solids.prism(plan, -solids.FOUNDATION_M, p.floor))
    wall = WallFrame(plan, 0)
    x = wall.length / 2
    half = min(0.9, 0.4 * wall.length)
    flight = porches.steps(x - half, x + half, 0.26 * count, p.floor, count)
    p.add_to("stone", wall.place(flight))
    z = p.floor + p.eaves
    posts = outlines.inset(plan, 0.25)
    if p.form == "tea_house":
        _add_glazing(p, posts)
    else:
        for spot in posts:
            shaft = outlines.regular_polygon(0.13, 6, spot)
            p.add_to("timber", solids.skirt(shaft, shaft, p.floor, z))
        for edge in range(1, p.sides):
            side = WallFrame(posts, edge)
            ends = (0.1, 0.0), (side.length - 0.1, 0.0)
            add_railing(
                p, f"railing_{edge}", side, *ends, p.floor, p.colours["timber"]
            )
    beam = outlines.inset(posts, -0.12)
    p.add_to(
        "timber",
        solids.skirt(beam, beam, z - 0.3, z + 0.02),
        solids.flat(beam, z - 0.3, up=False),
    )
    _add_round_roof(p, center, plan, z)


def _add_glazing(p: ParkPavilion, plan: np.ndarray) -> None:
    """Adds glass walls above a parapet, with a door in front."""
    window = bays.ribbon(0.8, p.eaves - 0.5, 0.12, 0.3)
    door = bays.window(1.5, 0.05, p.eaves - 0.5, 0.12, mullions=1)
    rows = bays.rhythm(2.0, [window], 0.1)
    layout = bays.by_edge({0: bays.alone(door, 1.9)}, rows)
    bands = (Band(0.0, 0.15, -0.05),)
    facade = Facade(round(p.eaves - 0.2, 2), bands, layout, (0.12,))
    p.add_to("timber", facade_mesh(plan, facade, p.floor))
    p.add_to("glass", glass_mesh(plan, facade, p.floor))


def _add_round_roof(
    p: ParkPavilion, center: outlines.Point, plan: np.ndarray, z: float
) -> None:
    """Adds a conical or bell-shaped roof with its lantern and finial."""
    eaves = outlines.inset(plan, -_EAVES_M * 0.8)
    top = p.height - 0.5
    head = top - 1.0 if p.lantern else top

    def ring(share: float) -> np.ndarray:
        return np.asarray(center) + share * (eaves - center)

    pieces = [
        solids.flat(eaves, z, up=False),
        solids.skirt(eaves, eaves, z, z + 0.15),
    ]
    levels = [(1.0, z + 0.15)]
    if p.bell:
        rise = head - z - 0.15
        levels += [(0.62, z + 0.15 + 0.28 * rise),
                   (0.36, z + 0.15 + 0.58 * rise)]  # fmt: skip
    neck = 0.24
    if p.lantern:
        levels.append((neck, head))
    for (a, za), (b, zb) in itertools.pairwise(levels):
        pieces.append(solids.skirt(ring(a), ring(b), za, zb))
    hat = ring(levels[-1][0])
    low = levels[-1][1]
    if p.lantern:
        drum = ring(0.8 * neck)
        pieces.append(solids.flat(hat, head))
        p.add_to("timber", solids.skirt(drum, drum, head, top - 0.4))
        hat = ring(1.15 * neck)
        low = top - 0.4
        pieces.append(solids.flat(hat, low, up=False))
    p.add_to("roof", *pieces, solids.spire(hat, center, low, top))
    finial = outlines.regular_polygon(0.07, 6, center)
    p.add_to("timber", solids.prism(finial, top - 0.3, p.height))


def _add_shelter(p: ParkPavilion, area: outlines.Area) -> None:
    """Adds a hipped or gabled roof on posts, with tables and a hearth."""
    x0, y0, x1, y1 = area
    a, b = x0 + _EAVES_M + 0.1, x1 - _EAVES_M - 0.1
    c, d = y0 + _EAVES_M + 0.1, y1 - _EAVES_M - 0.1
    floor = 0.12
    z = 0.12 + p.eaves
    slab = (a - 0.3, b + 0.3, c - 0.3, d + 0.3, floor)
    p.add_to("stone", solids.standing(*slab, bottom=True))
    plan = outlines.rectangle(a, c, b, d)
    across = max(2, round((b - a) / 3.5) + 1)
    deep = max(2, round((d - c) / 3.5) + 1)
    places: list[tuple[float, float]] = [
        *((u, v) for u in np.linspace(a, b, across) for v in (c, d)),
        *((u, v) for v in np.linspace(c, d, deep) for u in (a, b)),
    ]
    spots = {(round(u, 2), round(v, 2)) for u, v in places}
    for u, v in sorted(spots):
        p.add_to("timber", solids.post(u, v, 0.11, z, floor))
    frame = outlines.inset(plan, -0.12)
    ceiling = solids.prism(frame, z - 0.25, z + 0.02, bottom=True)
    p.add_to("timber", ceiling)
    if p.bell:
        roof = roofs.hip(plan, z, p.height, 0.55, 0.15)
    else:
        along_y = d - c > b - a
        low, high = (a, b) if along_y else (c, d)
        start, end = (c, d) if along_y else (a, b)
        line = roofs.gable_line(low, high, z + 0.15, p.height)
        line = roofs.with_eaves(line, 0.5, 0.5)
        roof = roofs.shell(line, start - 0.5, end + 0.5, 0.15, along_y=along_y)
    p.add_to("roof", roof)
    _add_tables(p, (a, b, c, d), floor)


def _add_tables(p: ParkPavilion, area: outlines.Area, floor: float) -> None:
    """Adds tables with benches, and a hearth at one end."""
    a, b, c, d = area
    y, z = (c + d) / 2, floor
    for x, _ in bays.stretches(b - a, 3.0, 0.6)[1:]:
        u = a + x
        top = (u - 0.4, u + 0.4, y - 0.9, y + 0.9, z + 0.7, z + 0.78)
        leg = (u - 0.1, u + 0.1, y - 0.6, y + 0.6, z, z + 0.72)
        seats = (
            (v - 0.15, v + 0.15, y - 0.9, y + 0.9, z, z + 0.45)
            for v in (u - 0.75, u + 0.75)
        )
        feet = (solids.box(*spot, bottom=False) for spot in (leg, *seats))
        p.add_to("timber", solids.box(*top), *feet)
    hearth = solids.box(a + 0.3, a + 1.0, y - 0.5, y + 0.5, z, z + 1.0)
    p.add_to("stone", hearth)
