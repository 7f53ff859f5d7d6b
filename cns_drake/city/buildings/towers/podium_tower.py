"""The podium tower: a block of shops with a tower set back on its roof."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_CLADDINGS = (
    ((0.70, 0.66, 0.60), (0.84, 0.83, 0.80)),
    ((0.45, 0.42, 0.40), (0.72, 0.70, 0.66)),
    ((0.60, 0.50, 0.42), (0.56, 0.60, 0.63)),
)

_ROOF_ITEMS = ("lift_house", "cooling_tower", "air_handler", "mast")


class Parameters:
    """Parameters of a podium tower; lengths in metres.

    The tower covers the share `tower` of the podium along x and y and
    stands at the fraction `at` of the room that is left.
    """

    def __init__(self, d: Dice) -> None:
        x0, y0, x1, y1 = d.site.bounds
        podium_rgb, tower_rgb = d.pick(_CLADDINGS)
        share = d.rng.uniform(0.5, 0.68, 2)
        run = 2 * (share[0] * d.width + share[1] * d.depth)
        self.height = d.height
        self.podium_storeys = d.whole(2, 4)
        self.ground_height = d.uniform(4.8, 5.6, 2)
        self.storey_height = d.uniform(3.2, 3.7)
        self.shop_pitch = d.uniform(5.5, 7.5) * min(
            1.3, max(1.0, (x1 - x0 + y1 - y0) / 70)
        )
        self.tower = (float(share[0]), float(share[1]))
        self.at = tuple(d.rng.choice([0.15, 0.5, 0.85], 2).tolist())
        self.chamfer = d.pick((0.0, 2.0, 3.5))
        self.pitch = max(d.uniform(3.0, 4.2), run / 19)
        self.recess = d.uniform(0.35, 0.5, 2)
        self.frame = d.uniform(0.5, 0.9, 2)
        self.mullions = int(run < 70.0)
        self.balconies = d.chance(0.5)
        self.awnings = d.uniform(0.3, 0.9)
        self.rgb = podium_rgb
        self.tower_rgb = tower_rgb


def build(p: Parameters, out: Assembly) -> None:
    """Builds podium and tower on a rectangle."""
    (x0, y0, x1, y1), base = out.site.bounds, out.site.outline
    top, walls = _add_shops(out, p), _podium_storey(p)
    top = tiers.add_storeys(
        out, base, walls, top, p.podium_storeys, 1, part="podium"
    )
    edge = Facade(1.6, (Band(0.2, 0.7, -0.3), Band(1.4, 1.6, -0.1)))
    roof = tiers.add_crown(out, base, edge, top, 1.2, part="terrace")
    width, depth = p.tower[0] * (x1 - x0), p.tower[1] * (y1 - y0)
    left = round(x0 + p.at[0] * (x1 - x0 - width), 2)
    near = round(y0 + p.at[1] * (y1 - y0 - depth), 2)
    right, far = round(left + width, 2), round(near + depth, 2)
    plan = massing.rectangle(left, near, right, far)
    _add_garden(out, plan, roof)
    if p.chamfer:
        plan = massing.chamfered(plan, p.chamfer)
    out.rgb = p.tower_rgb
    _add_tower(out, p, plan, roof)


def _add_shops(out: Assembly, p: Parameters) -> float:
    outline, h = out.site.outline, p.ground_height
    front, pitch = details.WallFrame(outline, 0), p.shop_pitch
    choices = [bays.shop_front(h - 0.6, 0.45, door=d) for d in (True, False)]
    shops = bays.rhythm(pitch, choices, margin=0.8)
    gates = [bays.gate(4.0, 3.4), bays.blank]
    main = bays.with_middle(shops, bays.entrance(4.0, 3.8, 1.6), 6.0)
    service = bays.rhythm(pitch, gates, margin=1.0)
    layout = bays.by_edge({0: main, 2: service}, shops)
    bands = (Band(0.0, 0.3, -0.06), Band(h - 1.1, h - 0.2, -0.2))
    cells = bays.stretches(front.length, pitch, 0.8)
    shape = (0.4, 1.35, 2.7, h - 1.3)
    shades = details.awnings(front, cells, out.rng, p.awnings, shape, 3.2)
    tiers.add_awnings(out, shades)
    roof = details.front_canopy(outline, 3.2, 1.45, 4.0)
    facade = Facade(h, bands, layout, (0.45,))
    return tiers.add_ground(out, outline, facade, [roof])


def _podium_storey(p: Parameters) -> Facade:
    storey = 4.2
    window = bays.window(p.shop_pitch - 1.4, 0.7, storey - 0.7, 0.3, mullions=2)
    layout = bays.rhythm(p.shop_pitch, [window], margin=0.8)
    return Facade(storey, (Band(0.0, 0.25, -0.12),), layout, glass=(0.3,))


def _add_tower(
    out: Assembly, p: Parameters, plan: np.ndarray, z0: float
) -> None:
    room = p.height - 3.0 - z0
    groups, per_group, storey = tiers.divided(room, p.storey_height)
    # Deep frames, one bay wide, with the glass at their backs.
    frame = bays.window(
        1e3, round(p.frame / 2, 2), round(storey - p.frame / 2, 2), p.recess,
        pier=round(p.frame / 2, 2), mullions=p.mullions,
    )  # fmt: skip
    layout = bays.rhythm(p.pitch, [frame], margin=0.5)
    walls = Facade(storey, (), layout, (p.recess,))
    extras = []
    for edge in range(len(plan)) if p.balconies else ():
        wall = details.WallFrame(plan, edge)
        if wall.length > 3 * p.pitch:
            x = 0.5 + p.pitch
            extras.append(wall.place(details.balcony(x - 2.6, x, 1.4, 0.0)))
    top = tiers.add_storeys(out, plan, walls, z0, groups, per_group, extras)
    crown = round(p.height - top, 3)
    louvres = tuple(Band(z, z + 0.35, 0.15) for z in (0.5, 1.2, 1.9))
    screen = Facade(crown, (*louvres, Band(2.6, crown, -0.15)))
    roof = tiers.add_crown(out, plan, screen, top, 2.2)
    equip_roof(out, plan, roof, _ROOF_ITEMS)


def _add_garden(out: Assembly, tower: np.ndarray, z: float) -> None:
    """Planters and a pergola on the widest strip of the podium's roof."""
    x0, y0, x1, y1 = out.site.bounds
    (tx0, ty0), (tx1, ty1) = tower[0], tower[2]
    strips = (
        (x0, tx0, y0, y1),
        (tx1, x1, y0, y1),
        (x0, x1, y0, ty0),
        (x0, x1, ty1, y1),
    )
    a, b, c, d = max(strips, key=lambda s: min(s[1] - s[0], s[3] - s[2]))
    a, b, c, d = a + 1.4, b - 1.4, c + 1.4, d - 1.4
    if min(b - a, d - c) < 2.0:
        return
    if b - a > d - c:
        garden = _garden(b - a, d - c).moved((a, c, z))
    else:
        garden = _garden(d - c, b - a).moved((b, c, z), math.pi / 2)
    out.add("garden", garden, rgb=(0.45, 0.40, 0.33))


def _garden(length: float, width: float) -> Mesh:
    """Planters along x, behind them the posts and beams of a pergola."""
    planters = (
        (u * length, (u + 0.12) * length, 0.0, 1.2, -0.1, 0.8)
        for u in (0.1, 0.32, 0.54, 0.76)
    )
    places = [round(u * length, 2) for u in np.linspace(0.25, 0.75, 7)]
    beams = (massing.box(x, x + 0.15, 1.5, width, 2.6, 2.85) for x in places)
    posts = (
        (x, x + 0.15, y, y + 0.15, -0.1, 2.7)
        for x in (places[0], places[-1])
        for y in (1.6, width - 0.2)
    )
    return merge_meshes(
        *(massing.box(*spot, bottom=False) for spot in planters),
        *beams,
        *(massing.box(*spot, bottom=False) for spot in posts),
    )
