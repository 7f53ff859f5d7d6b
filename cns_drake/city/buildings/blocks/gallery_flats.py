"""The bar of flats: open galleries in front of the doors, loggias behind."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade, Relief
from cns_drake.city.geometry.mesh import merge_meshes

_CONCRETES = ((0.74, 0.73, 0.70), (0.80, 0.77, 0.70), (0.66, 0.67, 0.68))
_PANELS = (
    (0.76, 0.44, 0.26),
    (0.32, 0.48, 0.58),
    (0.56, 0.62, 0.34),
    (0.78, 0.66, 0.32),
    (0.58, 0.30, 0.28),
)


class Parameters:
    """Parameters of a bar; lengths in metres.

    Attributes:
        height: of the stair's top.
        gallery_front: whether the galleries look to the street, else the
            loggias do.
        depth: of the bar between galleries and loggias.
        gallery: width of a gallery.
        storey: wanted height of a storey.
        pitch: width of a flat.
        loggia: depth of the loggias.
        rail: height of the parapets.
        stair_left: where the stair stands.
        stair_width: along the front.
        panels: part of the galleries' bays with a screen.
        ground: height of the ground floor.
    """

    def __init__(self, d: Dice) -> None:
        gallery = d.uniform(1.4, 1.8, 2)
        room = d.depth - gallery
        self.height = d.height
        self.gallery_front = d.chance(0.5)
        self.depth = round(min(room, d.uniform(10.0, 13.0)), 2)
        self.gallery = gallery
        self.storey = d.uniform(2.8, 3.0)
        self.pitch = max(d.uniform(4.8, 6.4), d.width / 12)
        self.loggia = d.uniform(1.1, 1.5, 2)
        self.rail = d.uniform(0.95, 1.1, 2)
        self.recess = d.uniform(0.12, 0.2, 2)
        self.stair_left = d.chance(0.5)
        self.stair_width = d.uniform(3.2, 4.2, 2)
        self.panels = d.uniform(0.15, 0.5)
        self.ground = d.uniform(3.0, 3.6, 2)
        self.roof_items = d.some_of("vents tank mast dish", 2, 5)
        self.rgb = d.pick(_CONCRETES)
        self.panel_rgb = d.pick(_PANELS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the bar along x on a rectangle."""
    x0, y0, x1, y1 = out.site.bounds
    front = y0 + (p.gallery if p.gallery_front else 0.1)
    back = min(front + p.depth, y1 - (0.1 if p.gallery_front else p.gallery))
    a = x0 + p.stair_width * p.stair_left
    b = x1 - p.stair_width * (not p.stair_left)
    slab = massing.rectangle(a, round(front, 2), b, round(back, 2))
    open_edge = 0 if p.gallery_front else 2
    goal = p.height - 2.2 - p.ground
    groups, per_group, storey = tiers.divided(goal, p.storey, 6)
    top = _add_ground(out, p, slab)
    walls = _storey(p, storey, open_edge)
    top = tiers.add_storeys(out, slab, walls, top, groups, per_group)
    stack = (groups, per_group, storey)
    _add_galleries(out, p, slab, open_edge, stack)
    crown = Facade(0.6, (Band(0.4, 0.6, -0.1),))
    roof = tiers.add_crown(out, slab, crown, top, 0.5, thickness=0.25)
    equip_roof(out, slab, roof, p.roof_items)
    left = x0 if p.stair_left else b - 0.05
    shaft = massing.rectangle(
        left, slab[0, 1] + 0.8, left + p.stair_width + 0.05, slab[2, 1] - 0.8
    )
    _add_stair(out, p, shaft)


def _add_ground(out: Assembly, p: Parameters, slab: np.ndarray) -> float:
    """Adds cellars, bicycle rooms and a glazed hall."""
    h = p.ground
    store = bays.gate(2.4, 2.2, 0.2)
    window = bays.window(1.6, 1.4, h - 0.5, p.recess)
    hall = bays.window(3.6, 0.3, h - 0.4, 0.3, mullions=2)
    rows = bays.rhythm(p.pitch, [window, store], 0.5)
    front = bays.with_middle(rows, hall, 5.0)
    layout = bays.by_edge({0: front, 2: rows}, bays.plain)
    bands = (Band(0.0, 0.4, -0.05), Band(h - 0.2, h, -0.1))
    return tiers.add_ground(
        out, slab, Facade(h, bands, layout, (p.recess, 0.3))
    )


def _storey(p: Parameters, storey: float, open_edge: int) -> Facade:
    head = round(storey - 0.45, 2)

    def flat(a: float, b: float) -> list[Relief]:
        door = bays.window(1.0, 0.05, 2.1, p.recess + 0.15)
        pane = bays.window(1.5, 1.0, head, p.recess)
        middle = a + 0.4 * (b - a)
        return [*door(a + 0.1, middle), *pane(middle, b - 0.1)]

    behind = bays.loggia(p.pitch - 0.5, p.loggia, p.rail, head)
    layouts = {
        open_edge: bays.rhythm(p.pitch, [flat], 0.4),
        2 - open_edge: bays.rhythm(p.pitch, [behind], 0.4),
    }
    blank = bays.alone(bays.window(1.2, 0.9, head, p.recess), 2.2)
    glass = (p.recess, p.loggia + 0.15)
    return Facade(storey, (), bays.by_edge(layouts, blank), glass)


def _add_galleries(
    out: Assembly,
    p: Parameters,
    slab: np.ndarray,
    edge: int,
    stack: tuple[int, int, float],
) -> None:
    """Adds one gallery per storey, posts through all, and screens."""
    wall, rng = details.WallFrame(slab, edge), out.rng
    end, reach = wall.length, p.gallery - 0.05
    groups, per_group, storey = stack
    storeys, step = groups * per_group, per_group * storey
    gallery = wall.place(details.balcony(0.02, end - 0.02, reach, 0.0, p.rail))
    group = (gallery.moved((0.0, 0.0, k * storey)) for k in range(per_group))
    out.stack("gallery", merge_meshes(*group), p.ground, step, groups)
    top = p.ground + storeys * storey
    posts = [wall.box(0.02, end - 0.02, -0.05, reach, top - 0.2, top)]
    cells = bays.stretches(end, p.pitch, 0.4)
    for x in bays.bounds(cells):
        spot = (x - 0.15, x + 0.15, reach - 0.35, reach - 0.05)
        posts.append(wall.standing(*spot, top - 0.1))
    out.add("posts", *posts)
    screens = []
    for a, b in cells:
        for k in range(storeys):
            if rng.random() < p.panels:
                z = p.ground + k * storey
                u = float(rng.uniform(a + 0.2, b - 1.8))
                spot = (round(u, 2), round(u + 1.5, 2), reach, reach + 0.06)
                screens.append(wall.box(*spot, z + 0.1, z + storey - 0.15))
    out.add("screens", *screens, rgb=p.panel_rgb)


def _add_stair(out: Assembly, p: Parameters, shaft: np.ndarray) -> None:
    slit = bays.window(1.4, 2.8, p.height - 1.0, 0.25)
    entry = bays.window(1.6, 0.0, p.height - 1.0, 0.25)
    walls = tiers.shaft_walls(p.height, entry, slit, 2.4, (0.4, 0.08))
    body = tiers.block(shaft, walls, 0.0)
    out.add("stair", massing.foundation(shaft), body, rgb=p.panel_rgb)
