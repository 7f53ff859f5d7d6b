"""The row of kiosks: small stalls with counters behind a common arcade."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, roofs
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.walls import Band, Patch
from cns_drake.city.facades.wings import Roof, Wing

_STALLS = (
    (0.30, 0.42, 0.36),
    (0.55, 0.24, 0.20),
    (0.80, 0.76, 0.66),
    (0.26, 0.34, 0.46),
    (0.62, 0.50, 0.34),
)
_ROOFS = ((0.36, 0.36, 0.38), (0.46, 0.28, 0.23), (0.40, 0.46, 0.42))
_AWNINGS = ((0.70, 0.22, 0.18), (0.84, 0.78, 0.60), (0.30, 0.46, 0.40))
_TIMBER = (0.42, 0.35, 0.28)
_COUNTER = 1.05


class Parameters:
    """Parameters of a row; lengths in metres.

    Attributes:
        height: of the highest roof.
        stall: wanted width of a stall.
        depth: of the stalls.
        gap: between groups of stalls.
        group: stalls built wall to wall.
        roof: `hip`, `gable`, `barrel` or `shed`.
        arcade: reach of a roof on posts in front; 0 for awnings.
        tower: whether one stall carries a lantern.
    """

    def __init__(self, d: Dice) -> None:
        depth = d.depth
        arcade = d.uniform(1.6, 2.4, 2)
        self.height = d.height
        self.stall = d.uniform(2.8, 4.2)
        self.depth = round(min(d.uniform(2.8, 4.2), depth - 3.0), 2)
        self.gap = d.uniform(0.8, 1.8, 2)
        self.group = d.whole(1, 4)
        self.roof = d.pick(("hip", "gable", "barrel", "shed"))
        self.arcade = arcade if d.chance(0.5) else 0.0
        self.tower = d.height > 4.6 and d.chance(0.6)
        self.rgb = d.pick(_STALLS)
        self.second_rgb = d.pick(_STALLS)
        self.roof_rgb = d.pick(_ROOFS)
        self.awning_rgb = d.pick(_AWNINGS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the row along the front of a rectangle."""
    out.paint(
        stalls=p.rgb,
        others=p.second_rgb,
        glass=out.glass_rgb,
        roof=p.roof_rgb,
        awning=p.awning_rgb,
        timber=_TIMBER,
    )
    x0, y0, x1, y1 = out.site.bounds
    left, right = x0 + 0.5, x1 - 0.5
    front = y0 + 2.2 if p.arcade == 0.0 else y0 + p.arcade + 0.5
    boxes = _stalls(p, left, right, front)
    tallest = len(boxes) // 2
    for k, wing in enumerate(boxes):
        _add_stall(out, p, wing, boxes, k)
        if k == tallest and p.tower:
            _add_lantern(out, p, wing)
    if p.arcade > 0:
        _add_arcade(out, p, (boxes[0].x0, boxes[-1].x1), front)
    slab = massing.box(left - 0.3, right + 0.3, y0 + 0.1, y1 - 0.1,
                       -massing.FOUNDATION_M, 0.12)  # fmt: skip
    out.add_to("timber", slab)


def _stalls(
    p: Parameters, left: float, right: float, front: float
) -> list[Wing]:
    """Returns the boxes of the stalls; the middle one is the tallest."""
    unit = p.stall + p.gap / p.group
    count = max(1, int((right - left + p.gap) / unit))
    gaps = p.gap * ((count - 1) // p.group)
    width = (right - left - gaps) / count
    roof = Roof(p.roof, p.roof in ("gable", "barrel"), 0.0, 0.2, 0.15)
    if p.roof == "hip":
        roof = Roof("hip", False, 0.25, 0.0, 0.15)
    if p.roof == "shed":
        roof = Roof("shed", False, 0.25, 0.0, 0.15, falling=True)
    top = p.height - (1.1 if p.tower else 0.0)
    boxes, x = [], left
    for k in range(count):
        high = top - (0.25 * (k % 2) if k != count // 2 else 0.0)
        wall = max(2.2, high - 0.32 * min(width, p.depth))
        area = (x, front, x + width, front + p.depth)
        boxes.append(Wing.at(*area, min(wall, high - 0.35), high, roof))
        x += width + p.gap * ((k + 1) % p.group == 0)
    return boxes


def _add_stall(
    out: Assembly, p: Parameters, wing: Wing, boxes: list[Wing], k: int
) -> None:
    """Adds a stall: a counter under an awning, or closed shutters."""
    openings = Openings(wing, boxes)
    wall, material = wing.wall(0), ("stalls", "others")[k % 2]
    a, b = 0.3, wall.length - 0.3
    head = min(2.15, wing.wall_top - 0.25)
    if out.rng.random() < 0.75:
        openings.add(0, [Patch(a, b, _COUNTER, head, 0.7)])
        shelf = wall.box(a, b, -0.3, 0.3, _COUNTER - 0.08, _COUNTER)
        out.add_to("timber", shelf)
        if p.arcade == 0.0:
            shade = details.awning(a - 0.1, b + 0.1, 1.3, 1.95, head + 0.1)
            out.add_to("awning", wall.place(shade))
    else:
        shutter = bays.gate(b - a, head, 0.12)
        openings.add(0, shutter(a - 0.3, b + 0.3))
    door = bays.window(0.9, 0.05, 2.0, 0.12)
    openings.row((2,), 0.2, wall.length, [door], 0.3)
    sign = details.board(a, b, head + 0.02, wing.wall_top - 0.02, 0.1)
    out.add_to("awning", wall.place(sign))
    bands = (Band(0.0, 0.25, -0.05),)
    openings.enclose(out, (0.12,), bands, material)


def _add_lantern(out: Assembly, p: Parameters, wing: Wing) -> None:
    """Adds a small square lantern with its own roof."""
    low, top = wing.wall_top, p.height
    body = massing.square(*wing.center, 0.6)
    eaves = massing.inset(body, -0.25)
    out.add_to("others", massing.skirt(body, body, low, top - 0.7))
    out.add_to("roof", massing.tent(eaves, wing.center, top - 0.72, top))


def _add_arcade(
    out: Assembly, p: Parameters, xs: bays.Span, front: float
) -> None:
    """Adds a lean-to roof on posts along the whole row."""
    a, b = xs
    low, y = 2.35, front - p.arcade
    top = min(2.9, p.height - 0.4)
    line = [(y - 0.15, low + 0.15), (front + 0.05, top)]
    out.add_to("roof", roofs.shell(line, a, b, 0.12))
    for x in np.linspace(a + 0.15, b - 0.15, max(2, round((b - a) / 3.2))):
        post = massing.standing(x - 0.08, x + 0.08, y, y + 0.16, low + 0.1)
        out.add_to("timber", post)
    beam = massing.box(a, b, y, y + 0.16, low - 0.15, low + 0.06)
    out.add_to("timber", beam)
