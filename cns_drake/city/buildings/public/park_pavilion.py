"""The park pavilion: a bandstand, a shelter with tables, or a tea house."""

from __future__ import annotations

import itertools
import math

import numpy as np

from cns_drake.city.facades import bays, details, massing, roofs
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.details import add_railing
from cns_drake.city.facades.walls import Band, Facade, facade_mesh, glass_mesh

_TIMBERS = ((0.88, 0.87, 0.83), (0.44, 0.34, 0.26), (0.34, 0.42, 0.38))
_ROOFS = ((0.34, 0.46, 0.42), (0.44, 0.28, 0.23), (0.36, 0.37, 0.40))
_STONE = (0.66, 0.64, 0.60)
_EAVES_M = 0.6


class Parameters:
    """Parameters of a pavilion; lengths in metres.

    Attributes:
        height: of the finial.
        kind: `bandstand` (open, round), `tea_house` (glazed, round) or
            `shelter` (open, long).
        sides: of a round one.
        floor: height of the deck.
        eaves: height of the posts above the deck.
        lantern: whether a lantern sits on the roof.
        bell: whether the roof is bent like a bell.
    """

    def __init__(self, d: Dice) -> None:
        ratio = d.width / d.depth
        long = not 0.67 < ratio < 1.5
        floor = d.uniform(0.3, 0.9, 2)
        self.height = d.height
        self.kind = (
            "shelter"
            if long
            else d.pick(("bandstand", "bandstand", "tea_house", "shelter"))
        )
        self.sides = d.pick((6, 8, 8))
        self.floor = floor
        self.eaves = round(max(2.2, 0.5 * (d.height - floor)), 2)
        self.lantern = d.height > 5.0 and d.chance(0.5)
        self.bell = d.chance(0.5)
        self.rgb = d.pick(_TIMBERS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the pavilion in the middle of a rectangle."""
    out.paint(timber=p.rgb, glass=out.glass_rgb, roof=p.roof_rgb, stone=_STONE)
    x0, y0, x1, y1 = out.site.bounds
    if p.kind == "shelter":
        _add_shelter(out, p, (x0, y0, x1, y1))
    else:
        center = ((x0 + x1) / 2, (y0 + y1) / 2)
        reach = min(x1 - x0, y1 - y0) / 2 - _EAVES_M
        _add_round(out, p, center, reach)


def _add_round(
    out: Assembly, p: Parameters, center: massing.Point, reach: float
) -> None:
    """Adds a deck, posts or glazed walls, and a roof over a polygon."""
    phase = -math.pi / 2 + math.pi / p.sides
    count = max(2, round(p.floor / 0.17))
    radius = (reach - 0.45 * 0.3 * count) / math.cos(math.pi / p.sides)
    radius = min(radius, reach, 7.0)
    plan = massing.regular_polygon(radius, p.sides, center, phase)
    # The front edge is the one that looks to -y: it ends at `phase`.
    plan = np.roll(plan, 1, axis=0)
    out.add_to("stone", massing.prism(plan, -massing.FOUNDATION_M, p.floor))
    wall = details.WallFrame(plan, 0)
    x, half = wall.length / 2, min(0.9, 0.4 * wall.length)
    flight = details.steps(x - half, x + half, 0.26 * count, p.floor, count)
    out.add_to("stone", wall.place(flight))
    z = p.floor + p.eaves
    posts = massing.inset(plan, 0.25)
    if p.kind == "tea_house":
        _add_glazing(out, p, posts)
    else:
        for spot in posts:
            shaft = massing.regular_polygon(0.13, 6, spot)
            out.add_to("timber", massing.skirt(shaft, shaft, p.floor, z))
        for edge in range(1, p.sides):
            side = details.WallFrame(posts, edge)
            ends = (0.1, 0.0), (side.length - 0.1, 0.0)
            add_railing(out, f"railing_{edge}", side, *ends, p.floor, p.rgb)
    beam = massing.inset(posts, -0.12)
    out.add_to(
        "timber",
        massing.skirt(beam, beam, z - 0.3, z + 0.02),
        massing.flat(beam, z - 0.3, up=False),
    )
    _add_round_roof(out, p, center, plan, z)


def _add_glazing(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds walls of glass over a parapet, a door in front."""
    window = bays.ribbon(0.8, p.eaves - 0.5, 0.12, 0.3)
    door = bays.window(1.5, 0.05, p.eaves - 0.5, 0.12, mullions=1)
    rows = bays.rhythm(2.0, [window], 0.1)
    layout = bays.by_edge({0: bays.alone(door, 1.9)}, rows)
    bands = (Band(0.0, 0.15, -0.05),)
    facade = Facade(round(p.eaves - 0.2, 2), bands, layout, (0.12,))
    out.add_to("timber", facade_mesh(plan, facade, p.floor))
    out.add_to("glass", glass_mesh(plan, facade, p.floor))


def _add_round_roof(
    out: Assembly,
    p: Parameters,
    center: massing.Point,
    plan: np.ndarray,
    z: float,
) -> None:
    """Adds a cone, straight or bent, with its lantern and finial."""
    eaves = massing.inset(plan, -_EAVES_M * 0.8)
    top = p.height - 0.5
    head = top - 1.0 if p.lantern else top

    def ring(share: float) -> np.ndarray:
        return np.asarray(center) + share * (eaves - center)

    pieces = [
        massing.flat(eaves, z, up=False),
        massing.skirt(eaves, eaves, z, z + 0.15),
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
        pieces.append(massing.skirt(ring(a), ring(b), za, zb))
    hat, low = ring(levels[-1][0]), levels[-1][1]
    if p.lantern:
        drum = ring(0.8 * neck)
        pieces.append(massing.flat(hat, head))
        out.add_to("timber", massing.skirt(drum, drum, head, top - 0.4))
        hat, low = ring(1.15 * neck), top - 0.4
        pieces.append(massing.flat(hat, low, up=False))
    out.add_to("roof", *pieces, massing.spire(hat, center, low, top))
    finial = massing.regular_polygon(0.07, 6, center)
    out.add_to("timber", massing.prism(finial, top - 0.3, p.height))


def _add_shelter(out: Assembly, p: Parameters, area: massing.Area) -> None:
    """Adds a hipped or gabled roof on posts, tables and a hearth."""
    x0, y0, x1, y1 = area
    a, b = x0 + _EAVES_M + 0.1, x1 - _EAVES_M - 0.1
    c, d = y0 + _EAVES_M + 0.1, y1 - _EAVES_M - 0.1
    floor, z = 0.12, 0.12 + p.eaves
    slab = (a - 0.3, b + 0.3, c - 0.3, d + 0.3, floor)
    out.add_to("stone", massing.standing(*slab, bottom=True))
    plan = massing.rectangle(a, c, b, d)
    across = max(2, round((b - a) / 3.5) + 1)
    deep = max(2, round((d - c) / 3.5) + 1)
    places: list[tuple[float, float]] = [
        *((u, v) for u in np.linspace(a, b, across) for v in (c, d)),
        *((u, v) for v in np.linspace(c, d, deep) for u in (a, b)),
    ]
    spots = {(round(u, 2), round(v, 2)) for u, v in places}
    for u, v in sorted(spots):
        out.add_to("timber", massing.post(u, v, 0.11, z, floor))
    frame = massing.inset(plan, -0.12)
    ceiling = massing.prism(frame, z - 0.25, z + 0.02, bottom=True)
    out.add_to("timber", ceiling)
    if p.bell:
        roof = roofs.hip(plan, z, p.height, 0.55, 0.15)
    else:
        along_y = d - c > b - a
        low, high = (a, b) if along_y else (c, d)
        start, end = (c, d) if along_y else (a, b)
        line = roofs.gable_line(low, high, z + 0.15, p.height)
        line = roofs.with_eaves(line, 0.5, 0.5)
        roof = roofs.shell(line, start - 0.5, end + 0.5, 0.15, along_y=along_y)
    out.add_to("roof", roof)
    _add_tables(out, (a, b, c, d), floor)


def _add_tables(out: Assembly, area: massing.Area, floor: float) -> None:
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
        feet = (massing.box(*spot, bottom=False) for spot in (leg, *seats))
        out.add_to("timber", massing.box(*top), *feet)
    hearth = massing.box(a + 0.3, a + 1.0, y - 0.5, y + 0.5, z, z + 1.0)
    out.add_to("stone", hearth)
