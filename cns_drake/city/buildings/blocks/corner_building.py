"""The corner house: a curved front, arched windows, a dome or a lantern."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.city.buildings.archetypes import ARCHETYPES
from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade, Relief
from cns_drake.city.geometry.mesh import Mesh

_STUCCOS = ((0.84, 0.78, 0.66), (0.76, 0.66, 0.56), (0.82, 0.80, 0.76))

_ROOF_ITEMS = ("stair_house", "skylight", "vents", "ac_unit")


class Parameters:
    """Parameters of a corner house; lengths in metres.

    `corner` is the rounded corner of the rectangle (0: front left,
    1: front right) and `radius` its radius.
    """

    def __init__(self, d: Dice) -> None:
        side = min(d.width, d.depth)
        self.height = d.height
        self.corner = d.pick(d.site.free_corners or [0, 1])
        self.radius = round(d.uniform(0.3, 0.42) * min(side, 24.0), 1)
        self.ground_height = d.uniform(4.6, 5.4, 2)
        self.first_height = d.uniform(4.2, 4.8, 2)
        self.storey_height = d.uniform(3.3, 3.8)
        self.pitch = max(d.uniform(2.5, 3.2), d.site.open_length / 36)
        self.window_width = d.uniform(1.1, 1.5, 2)
        self.recess = d.uniform(0.22, 0.4, 2)
        self.hood = 0.1 * d.chance(0.4)
        self.pilasters = d.chance(0.6)
        self.balcony = d.chance(0.7)
        self.dome = d.pick(("dome", "cone", "lantern"))
        self.dome_height = round(d.uniform(0.17, 0.24) * d.height, 1)
        self.cornice_reach = d.uniform(0.5, 0.9, 2)
        self.rgb = d.pick(_STUCCOS)
        self.roof_rgb = d.pick(((0.3, 0.42, 0.38), (0.32, 0.33, 0.36)))


def build(p: Parameters, out: Assembly) -> None:
    """Builds the house on a rectangle."""
    site = out.site
    if p.corner not in site.free_corners:
        site = site.detached(ARCHETYPES["corner_building"].overhang)
    rectangle = site.outline
    plan = massing.rounded(rectangle, {p.corner: p.radius}, 2.8)
    blind = massing.edges_on(plan, rectangle, site.blind_edges)
    bottom = _add_shops(out, p, plan, blind)
    top = _add_first_floor(out, p, plan, blind, bottom)
    room = p.height - p.dome_height - 2.2 - top
    groups, per_group, storey = tiers.divided(room, p.storey_height)
    window = bays.window(
        p.window_width, 0.8, storey - 0.7, p.recess, hood=p.hood
    )
    rows = bays.rhythm(p.pitch, [window], 0.3)
    walls = Facade(storey, (Band(0.6, 0.8, -0.1),), rows, (p.recess,), blind)
    top = tiers.add_storeys(out, plan, walls, top, groups, per_group)
    if p.pilasters:
        strips = details.pilasters(
            plan, p.pitch, 0.3, 2, 0.5, 0.16, bottom, top, blind
        )
        out.add("pilasters", strips)
    eaves = Facade(2.2, tiers.cornice(1.4, p.cornice_reach), plain=blind)
    roof = tiers.add_crown(out, plan, eaves, top, 0.8)
    out.add("dome", *_dome(p, plan, roof), rgb=p.roof_rgb)
    x0, y0, x1, y1 = site.bounds
    if y1 - y0 - 2 * p.radius > 5.0:
        free = massing.rectangle(x0, y0 + 2 * p.radius, x1, y1)
        equip_roof(out, free, roof, _ROOF_ITEMS)


def _is_front(plan: np.ndarray, edge: int) -> bool:
    """Whether a wall looks to the front or belongs to the curve."""
    along = plan[(edge + 1) % len(plan)] - plan[edge]
    return edge == 0 or (along[0] > 0.1 and abs(along[1]) > 0.1)


def _add_shops(
    out: Assembly, p: Parameters, plan: np.ndarray, blind: frozenset[int]
) -> float:
    h = p.ground_height
    choices = [
        bays.shop_front(h - 1.2, 0.4, pier=0.25, door=d) for d in (True, False)
    ]
    shops = bays.rhythm(2 * p.pitch, choices, margin=0.35)
    pane = bays.shop_front(h - 1.2, 0.4, door=False, pier=0.15)
    glazed = bays.rhythm(3.0, [pane], 0.1)
    window = bays.window(1.4, 1.5, h - 1.2, 0.4)
    service = bays.rhythm(2.5 * p.pitch, [window], 1.0)
    service = bays.with_middle(service, bays.gate(2.6, 2.9, 0.4), 3.4)

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if length < 3.0:
            return glazed(edge, length)
        along = plan[(edge + 1) % len(plan)] - plan[edge]
        return (service if along[0] < -0.1 else shops)(edge, length)

    bands = (Band(0.0, 0.3, -0.06), Band(h - 1.0, h - 0.2, -0.15))
    front = details.WallFrame(plan, 0)
    cells = bays.stretches(front.length, 2 * p.pitch, 0.35)
    shape = (0.3, 1.3, 2.7, h - 1.2)
    tiers.add_awnings(out, details.awnings(front, cells, out.rng, 0.5, shape))
    return tiers.add_ground(out, plan, Facade(h, bands, layout, (0.4,), blind))


def _add_first_floor(
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    blind: frozenset[int],
    z0: float,
) -> float:
    """The tall main floor: arched windows, balconies in front of some."""
    h = p.first_height
    arched = bays.arched(p.window_width, 0.5, h - 1.6, p.recess)
    plain = bays.window(p.window_width, 0.5, h - 0.9, p.recess)
    fronts = {
        edge: bays.rhythm(p.pitch, [arched], 0.3)
        for edge in range(len(plan))
        if _is_front(plan, edge)
    }
    layout = bays.by_edge(fronts, bays.rhythm(p.pitch, [plain], 0.3))
    floor = Facade(h, (Band(h - 0.4, h, -0.18),), layout, (p.recess,), blind)
    rails: list[Mesh] = []
    for edge in fronts if p.balcony else ():
        wall = details.WallFrame(plan, edge)
        cells = bays.stretches(wall.length, p.pitch, 0.3)
        for a, b in cells[len(cells) // 3 :: 3] if edge not in blind else ():
            x = round((a + b) / 2, 2)
            rail = details.balcony(x - 0.9, x + 0.9, 0.8, 0.25, 0.9)
            rails.append(wall.place(rail))
    return tiers.add_storeys(
        out, plan, floor, z0, 1, 1, rails, part="main_floor"
    )


def _center(p: Parameters, plan: np.ndarray) -> np.ndarray:
    """Returns the middle of the rounded corner's circle."""
    low, high = plan.min(axis=0), plan.max(axis=0)
    x = low[0] + p.radius if p.corner == 0 else high[0] - p.radius
    return np.array([x, low[1] + p.radius])


def _dome(p: Parameters, plan: np.ndarray, z0: float) -> list[Mesh]:
    """A drum over the corner under a dome, a cone or an open lantern."""
    center, r = _center(p, plan), 0.62 * p.radius
    top, height = p.height, p.height - z0
    drum_top = round(z0 + 0.4 * height, 2)

    def ring(radius: float) -> np.ndarray:
        return massing.regular_polygon(radius, 12, center)

    wall = drum_top - z0
    bands = (Band(0.9, wall - 0.7, 0.25), Band(wall - 0.35, wall, -0.3))
    posts = bays.rhythm(4.0, [bays.bar(0.4, 0.9, wall - 0.7, 0.0)], 0.1)
    pieces = [tiers.block(ring(r), Facade(wall, bands, posts), z0)]
    rise = top - drum_top
    if p.dome == "cone":
        return [*pieces, massing.spire(ring(r), center, drum_top, top)]
    share = 0.85 if p.dome == "dome" else 0.6
    angles = np.linspace(0.0, 0.4 * np.pi, 5)
    radii = r * np.cos(angles)
    heights = drum_top + share * rise * np.sin(angles)
    profile = list(zip(radii, heights, strict=True))
    pieces.append(massing.revolved(profile, 12, center))
    lid, tip = heights[-1], ring(radii[-1])
    if p.dome == "lantern":
        core, middle = ring(0.6 * radii[-1]), lid + 0.55 * (top - lid)
        pieces.append(massing.prism(core, lid, middle))
        pieces.append(massing.flat(tip, middle, up=False))
        lid = middle
    return [*pieces, massing.spire(tip, center, lid, top)]
