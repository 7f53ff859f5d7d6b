"""The multi-storey car park: open decks beside a round helical ramp."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.helix import ramp_turn
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.structures import MeshShape

_SLAB_M = 0.32
_STAIR_RISE_M = 3.0


class Parameters:
    """Parameters of a car park; lengths in metres.

    The ramp stands at the front on the left or on the right; where the
    site is too narrow for decks beside it, wide ramps are all there is.
    """

    def __init__(self, d: Dice) -> None:
        room = min(d.width, d.depth)
        radius = min(0.5 * room, d.uniform(0.27, 0.32) * d.width, 15.0)
        if d.width - 2 * radius < 12.0:
            radius = 0.5 * room
        rise = d.height - _STAIR_RISE_M
        storeys = max(2, round(rise / d.uniform(2.9, 3.4)))
        self.height = d.height
        self.ramp_left = d.chance(0.5)
        self.ramp_radius = round(radius, 2)
        self.lane = round(min(0.45 * radius, d.uniform(5.0, 6.5)), 1)
        self.storeys = storeys
        self.storey_height = round(rise / storeys, 3)
        self.parapet = d.uniform(0.9, 1.15, 2)
        self.column_pitch = d.uniform(6.5, 8.5)
        self.panels = d.uniform(0.25, 0.55)
        self.panel_width = d.uniform(1.6, 2.6, 2)
        self.rgb = d.pick(((0.74, 0.74, 0.72), (0.82, 0.81, 0.78)))
        self.panel_rgb = d.pick(
            ((0.7, 0.32, 0.22), (0.25, 0.45, 0.55), (0.72, 0.6, 0.25))
        )


def build(p: Parameters, out: Assembly) -> None:
    """Builds the car park on a rectangle."""
    x0, y0, x1, y1 = out.site.bounds
    r = p.ramp_radius
    center = (x0 + r if p.ramp_left else x1 - r, y0 + r)
    _add_ramp(out, p, center)
    # The decks overlap the ramp by a lane's width, so that one drives over.
    reach = r - 0.6 * p.lane
    a, b = (center[0] + reach, x1) if p.ramp_left else (x0, center[0] - reach)
    if b - a > 10.0:
        decks = massing.rectangle(a, y0, b, y1)
        _add_decks(out, p, decks)
        _add_stair(out, p, _stair_by_decks(p, decks, center))
    else:
        side = min(5.0, 0.29 * r)
        x = x1 - side if p.ramp_left else x0
        corner = massing.rectangle(x, y1 - side, x + side, y1)
        _add_stair(out, p, corner)


def _add_ramp(out: Assembly, p: Parameters, center: massing.Point) -> None:
    """Turns of the ramp around a core, on a ring of columns."""
    r, inner = p.ramp_radius - 0.05, p.ramp_radius - 0.05 - p.lane
    start = 0.0 if p.ramp_left else math.pi
    turn = ramp_turn(r, inner, p.storey_height, _SLAB_M, p.parapet, start)
    shape = MeshShape(out.define("ramp", turn))
    for k in range(p.storeys):
        out.place(f"ramp_{k:02d}", shape, (*center, k * p.storey_height))
    top = p.storeys * p.storey_height + p.parapet
    core = [(0.45 * inner, -massing.FOUNDATION_M), (0.45 * inner, top + 0.8)]
    hat = massing.regular_polygon(0.45 * inner + 0.8, 14, center)
    pieces = [
        massing.revolved(core, 14, center),
        massing.prism(hat, top - 0.2, top + 0.2, bottom=True),
    ]
    for k in range(8):
        angle = start + (k + 0.5) * math.pi / 4
        # The ramp above this column ends at most here.
        lift = (k + 0.5) / 8 - 1.0
        z = (p.storeys + lift) * p.storey_height - 0.1
        for radius in (r - 0.45, inner + 0.45):
            x = center[0] + radius * math.cos(angle)
            y = center[1] + radius * math.sin(angle)
            plan = massing.regular_polygon(0.25, 6, (x, y))
            pieces.append(massing.prism(plan, -massing.FOUNDATION_M, z))
    out.add("ramp_core", *pieces)


def _add_decks(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    x0, y0, x1, y1 = massing.extent(plan)
    top = p.storeys * p.storey_height - 0.1
    across = bays.bounds(bays.stretches(x1 - x0, p.column_pitch, 0.4))
    along = bays.bounds(bays.stretches(y1 - y0, p.column_pitch, 0.4))
    low, high = -_SLAB_M - 0.45, -_SLAB_M + 0.02
    beams = (
        massing.box(x0 + x - 0.2, x0 + x + 0.2, y0 + 0.3, y1 - 0.3, low, high)
        for x in across
    )
    # A slab on beams with an upstand around it; one drives at z = 0.
    deck = merge_meshes(
        massing.skirt(plan, plan, -_SLAB_M, p.parapet),
        massing.flat(plan, -_SLAB_M, up=False),
        massing.roof_pan(plan, 0.0, p.parapet, 0.18),
        *beams,
    )
    out.stack("deck", deck, p.storey_height, p.storey_height, p.storeys)
    columns = [
        massing.post(x0 + x, y0 + y, 0.25, top) for x in across for y in along
    ]
    # A wall along the middle stiffens the decks and hides the far side.
    middle = (y0 + y1) / 2
    ends = (x0 + 0.25 * (x1 - x0), x1 - 0.2 * (x1 - x0))
    spine = massing.standing(*ends, middle - 0.15, middle + 0.15, top)
    out.add("columns", *columns, spine)
    out.add("panels", *_panels(p, plan, out.rng), rgb=p.panel_rgb)


def _panels(
    p: Parameters, plan: np.ndarray, rng: np.random.Generator
) -> list[Mesh]:
    """Screens between the decks, on the front, the back and the far side."""
    pieces = []
    gap = p.storey_height - _SLAB_M
    far = 1 if p.ramp_left else 3
    for edge in (0, 2, far):
        wall = details.WallFrame(plan, edge)
        for a, b in bays.stretches(wall.length, p.panel_width, 0.6):
            for k in range(1, p.storeys):
                if rng.random() < p.panels:
                    z = k * p.storey_height
                    low, high = round(z - 0.2, 2), round(z + gap + 0.1, 2)
                    ends = (round(a + 0.05, 2), round(b - 0.05, 2))
                    pieces.append(wall.box(*ends, -0.02, 0.12, low, high))
    return pieces


def _stair_by_decks(
    p: Parameters, decks: np.ndarray, center: massing.Point
) -> np.ndarray:
    """Behind the ramp, against the decks; or in their far back corner."""
    side = 5.0
    (x0, _), (x1, y1) = decks[0], decks[2]
    behind = y1 - (center[1] + p.ramp_radius) > side + 0.3
    if p.ramp_left:
        x = x0 - side if behind else x1 - side
    else:
        x = x1 if behind else x0
    return massing.rectangle(x, y1 - side, x + side, y1)


def _add_stair(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Stairs and lift in a shaft with a glazed slit, above all decks."""
    slit = bays.window(1.6, 2.6, p.height - 1.2, 0.3)
    door = bays.window(1.8, 0.0, p.height - 1.2, 0.3)
    walls = tiers.shaft_walls(p.height, door, slit, 2.4, (0.6, 0.2))
    body = tiers.block(plan, walls, 0.0)
    out.add("stairs", massing.foundation(plan), body, rgb=p.panel_rgb)
