"""The corner store: a cut-off corner with the door, flats above the shop."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.archetypes import ARCHETYPES
from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade
from cns_drake.city.geometry.mesh import Mesh

_WALLS = (
    (0.58, 0.36, 0.29),
    (0.80, 0.72, 0.58),
    (0.72, 0.70, 0.66),
    (0.66, 0.52, 0.42),
)
_SIGNS = ((0.55, 0.18, 0.16), (0.20, 0.30, 0.44), (0.22, 0.36, 0.28))


class Parameters:
    """Parameters of a corner store; lengths in metres.

    Attributes:
        height: of the parapet, its raised part above the corner included.
        corner: 0 front left, 1 front right.
        cut: taken off each edge at the corner.
        ground: height of the shop.
        storey: wanted height of a storey above.
        raised: what the parapet rises above the corner.
        cornice: how far it sticks out.
        awnings: part of the shop windows with an awning.
    """

    def __init__(self, d: Dice) -> None:
        x0, y0, x1, y1 = d.site.bounds
        raised = d.uniform(0.3, 0.9, 2)
        ground = min(d.uniform(3.5, 4.1), d.height - raised - 0.7)
        self.height = d.height
        self.corner = d.pick(d.site.free_corners or [0, 1])
        self.cut = round(min(d.uniform(2.0, 3.0), 0.3 * d.depth), 2)
        self.ground = round(ground, 2)
        self.storey = d.uniform(2.9, 3.3)
        self.pitch = max(d.uniform(2.2, 3.0), (x1 - x0 + y1 - y0) / 20)
        self.window_width = d.uniform(1.0, 1.5, 2)
        self.recess = d.uniform(0.12, 0.25, 2)
        self.ledge = d.pick((0.0, 0.1))
        self.raised = raised
        self.cornice = d.uniform(0.15, 0.4, 2)
        self.awnings = d.uniform(0.2, 0.9)
        self.roof_items = d.some_of("stair_house ac_unit vents", 1, 4)
        self.rgb = d.pick(_WALLS)
        self.sign_rgb = d.pick(_SIGNS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the store on a rectangle."""
    site = out.site
    if p.corner not in site.free_corners:
        site = site.detached(ARCHETYPES["corner_store"].overhang)
    rectangle = site.outline
    plan, front = _plan(p, rectangle)
    blind = massing.edges_on(plan, rectangle, site.blind_edges)
    side = (front - 1) % 5 if p.corner == 0 else (front + 1) % 5
    top = _add_shop(out, p, plan, (0, front, side), blind)
    room = p.height - (p.raised + 0.6) - top
    if room > 2.4:
        groups, per_group, storey = tiers.divided(room, p.storey, 4)
        head = min(2.3, storey - 0.35)
        window = bays.window(
            p.window_width, 0.85, head, p.recess, ledge=p.ledge
        )
        rows = bays.rhythm(p.pitch, [window], 0.5)
        walls = Facade(storey, (), rows, (p.recess,), blind)
        top = tiers.add_storeys(out, plan, walls, top, groups, per_group)
    _add_parapet(out, p, plan, front, top, blind)
    wall = details.WallFrame(plan, front)
    out.add("sign", *_corner_sign(p, wall), rgb=p.sign_rgb)


def _plan(p: Parameters, rectangle: np.ndarray) -> tuple[np.ndarray, int]:
    """Returns the five corners, and the edge across the cut-off one."""
    (x0, y0), (x1, y1) = rectangle[0], rectangle[2]
    c = p.cut
    if p.corner == 1:
        points = [(x0, y0), (x1 - c, y0), (x1, y0 + c), (x1, y1), (x0, y1)]
        return np.array(points), 1
    points = [(x0 + c, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0 + c)]
    return np.array(points), 4


def _add_shop(
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    streets: tuple[int, int, int],
    blind: frozenset[int],
) -> float:
    h, pitch = p.ground, 2 * p.pitch
    head, front = round(h - 1.0, 2), streets[1]
    shop = bays.shop_front(head, 0.3, door=False)
    glazed = bays.rhythm(pitch, [shop], margin=0.5)
    entry = bays.alone(bays.entrance(1.6, 2.4, 0.7, surround=0.1), p.cut)
    back = [bays.window(1.2, 1.3, 2.3, 0.3), bays.gate(1.8, 2.2)]
    layouts = dict.fromkeys(streets, glazed) | {front: entry}
    layout = bays.by_edge(layouts, bays.rhythm(4.0, back, 0.7))
    bands = (Band(0.0, 0.3, -0.05), Band(h - 0.25, h, -0.12))
    shades, boards = [], []
    for edge in streets:
        wall = details.WallFrame(plan, edge)
        if edge == front or edge in blind:
            continue
        cells = bays.stretches(wall.length, pitch, 0.5)
        for a, b in cells:
            spot = (a + 0.3, b - 0.3, -0.02, 0.1, head + 0.1, head + 0.7)
            boards.append(wall.box(*spot))
        shape = (0.2, 0.95, 2.4, head + 0.05)
        shades += details.awnings(wall, cells, out.rng, p.awnings, shape)
    tiers.add_awnings(out, shades)
    out.add("boards", *boards, rgb=p.sign_rgb)
    return tiers.add_ground(out, plan, Facade(h, bands, layout, (0.3,), blind))


def _add_parapet(
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    front: int,
    z0: float,
    blind: frozenset[int],
) -> None:
    """Adds the cornice and the roof, higher above the corner."""
    rim = round(p.height - p.raised - z0, 3)
    bands = tiers.cornice(rim - 0.1, p.cornice, thickness=0.45, steps=2)
    crown = Facade(rim, bands, plain=blind)
    roof = tiers.add_crown(out, plan, crown, z0, 0.5, thickness=0.25)
    wall = details.WallFrame(plan, front)
    piece = (0.1, wall.length - 0.1, -0.25, 0.04, z0 + rim - 0.3, p.height)
    out.add("pediment", wall.box(*piece))
    equip_roof(out, plan, roof, p.roof_items)


def _corner_sign(p: Parameters, wall: details.WallFrame) -> list[Mesh]:
    """A canopy above the door and an upright sign over it."""
    middle, z = wall.length / 2, p.ground - 0.55
    half = 0.5 * wall.length - 0.25
    lid = (middle - half, middle + half, -0.05, 0.9, z - 0.25, z)
    top = min(p.height - 0.4, z + 2.6)
    blade = (middle - 0.1, middle + 0.1, -0.05, 0.75, z - 0.05, top)
    return [wall.box(*lid), wall.box(*blade)]
