"""The court block: ranges around a court under a mansard with dormers."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.walls import Band, Facade
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.structures import MeshShape

_RENDERS = ((0.80, 0.70, 0.55), (0.70, 0.45, 0.38), (0.78, 0.76, 0.70))
_SLATES = ((0.33, 0.35, 0.40), (0.45, 0.30, 0.26))


class Parameters:
    """Parameters of a court block; lengths in metres."""

    def __init__(self, d: Dice) -> None:
        range_depth = d.uniform(10.0, 12.5)
        # The court has walls too.
        run = 1.3 * d.site.open_length
        self.height = d.height
        self.shape = "U" if d.width > 30.0 and d.chance(0.7) else "L"
        self.mirrored = d.chance(0.5)
        self.wing = round(min(range_depth, 0.34 * d.width), 1)
        self.back = round(min(range_depth + 0.8, 0.5 * d.depth), 1)
        self.ground_height = d.uniform(3.8, 4.4, 2)
        self.storey_height = d.uniform(3.0, 3.4)
        self.pitch = max(d.uniform(2.4, 3.2), run / 52)
        self.window_width = d.uniform(0.95, 1.25, 2)
        self.recess = d.uniform(0.15, 0.28, 2)
        self.oriel_every = d.whole(2, 5)
        self.oriel_reach = d.uniform(0.7, 1.0, 2)
        self.mansard_height = d.uniform(3.6, 4.8, 1)
        self.mansard_inset = d.uniform(1.6, 2.2, 2)
        self.dormer_pitch = max(d.uniform(4.5, 6.5), run / 26)
        self.chimneys = d.whole(3, 7)
        self.gate_height = d.uniform(3.2, 3.6, 2)
        self.rgb = d.pick(_RENDERS)
        self.roof_rgb = d.pick(_SLATES)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the block on a rectangle, its court open to the back."""
    form = massing.u_shape if p.shape == "U" else massing.l_shape
    plan = form(*out.site.bounds, p.wing, p.back)
    if p.mirrored:
        plan = massing.mirrored(plan)
    bottom = _add_ground(out, p, plan)
    eaves = p.height - p.mansard_height
    groups, per_group, storey = tiers.divided(eaves - bottom, p.storey_height)
    size = (p.window_width, 0.8, storey - 0.55, p.recess)
    windows = bays.rhythm(p.pitch, [bays.window(*size)], 0.8)
    framed = bays.rhythm(p.pitch, [bays.window(*size, ledge=0.1)], 0.8)
    band, layout = Band(storey - 0.15, storey, -0.07), {0: framed}
    walls = Facade(storey, (band,), bays.by_edge(layout, windows), (p.recess,))
    top = tiers.add_storeys(out, plan, walls, bottom, groups, per_group)
    _add_oriels(out, p, plan, bottom, groups * per_group, storey)
    out.add("mansard", *_mansard(p, plan, top, out.rng), rgb=p.roof_rgb)


def _add_ground(out: Assembly, p: Parameters, plan: np.ndarray) -> float:
    h = p.ground_height
    shops = bays.rhythm(1.7 * p.pitch, [bays.shop_front(h - 0.9, 0.3)], 0.7)
    window = bays.window(p.window_width, 1.2, h - 0.9, 0.3)
    flats = bays.rhythm(1.6 * p.pitch, [window], 0.8)
    front = bays.with_middle(shops, bays.gate(3.2, p.gate_height, 2.4), 5.0)
    layout = bays.by_edge({0: front}, flats)
    bands = (Band(0.0, 0.5, -0.08), Band(h - 0.4, h, -0.16))
    return tiers.add_ground(out, plan, Facade(h, bands, layout, (0.3,)))


def _add_oriels(
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    z0: float,
    count: int,
    storey: float,
) -> None:
    """Bay windows that hang on the street front from the first floor up."""
    half, r = 0.75, p.oriel_reach
    outline = [(-half - 0.5, 0.0), (-half, -r), (half, -r), (half + 0.5, 0.0)]
    floor = Facade(storey, (Band(0.9, storey - 0.5, 0.14),))
    height = count * storey
    oriel = merge_meshes(
        tiers.block(outline, floor.stacked(count), 0.0),
        massing.flat(outline, 0.0, up=False),
        massing.spire(outline, (0.0, 0.0), height, height + 0.6),
    )
    shape = MeshShape(out.define("oriel", oriel))
    wall = details.WallFrame(plan, 0)
    cells = bays.stretches(wall.length, p.pitch, 0.8)[1:-1]
    step = max(p.oriel_every, len(cells) // 5)
    for k, (a, b) in enumerate(cells[::step]):
        x, y = wall.point((a + b) / 2, 0.0)
        out.place(f"oriel_{k}", shape, (x, y, z0), wall.heading)


def _mansard(
    p: Parameters, plan: np.ndarray, z0: float, rng: np.random.Generator
) -> list[Mesh]:
    eaves = massing.inset(plan, -0.5)
    knee = massing.inset(plan, p.mansard_inset - 0.6)
    slope = min(1.6, p.wing / 2 - p.mansard_inset - 0.4)
    ridge = massing.inset(plan, p.mansard_inset + slope)
    z1 = z0 + 0.3
    z2, z3 = p.height - 0.9, p.height
    pieces = [
        massing.skirt(eaves, eaves, z0, z1),
        massing.flat(eaves, z0, up=False),
        massing.skirt(eaves, massing.inset(plan, 0.0), z1, z1),
        massing.skirt(plan, knee, z1, z2),
        massing.skirt(knee, ridge, z2, z3),
        massing.flat(ridge, z3),
    ]
    for edge in range(len(plan)):
        wall = details.WallFrame(plan, edge)
        for a, b in bays.stretches(wall.length, p.dormer_pitch, 2.5):
            dormer = _dormer(p, round((a + b) / 2, 2), z1, z2)
            pieces.append(wall.place(dormer))
    middle = (plan[0] + plan[1]) / 2
    for k in range(p.chimneys):
        x = plan[0, 0] + (k + 0.5) / p.chimneys * (plan[1, 0] - plan[0, 0])
        y = middle[1] + p.mansard_inset + 2.4 + float(rng.uniform(0.0, 1.5))
        stack = (x - 0.6, x + 0.6, y - 0.35, y + 0.35)
        pieces.append(massing.box(*stack, z2, p.height, bottom=False))
    return pieces


def _dormer(p: Parameters, x: float, z0: float, z1: float) -> Mesh:
    """A dormer whose back runs into the slope, in wall coordinates."""
    low, high = z0 + 0.4, min(z0 + 2.4, z1 - 0.2)
    deep = p.mansard_inset
    body = [
        (x - 0.7, -deep),
        (x + 0.7, -deep),
        (x + 0.7, -0.1),
        (x - 0.7, -0.1),
    ]
    walls = massing.skirt(body, body, low, high)
    lid = massing.box(x - 0.9, x + 0.9, -deep, 0.15, high, high + 0.2)
    # The back wall is inside the roof; the sill stands before the window.
    front = Mesh(walls.vertices, walls.faces[1:])
    sill = massing.box(x - 0.8, x + 0.8, -0.6, 0.05, low - 0.15, low + 0.1)
    return merge_meshes(front, lid, sill)
