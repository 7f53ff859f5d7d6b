"""The barn or boat house: timber boards, wide doors, a lean-to."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, wings
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings, free_stretches
from cns_drake.city.facades.walls import Band, Patch
from cns_drake.city.facades.wings import Roof, Wing

_BOARDS = (
    (0.50, 0.22, 0.18),
    (0.44, 0.36, 0.28),
    (0.56, 0.52, 0.46),
    (0.34, 0.40, 0.36),
    (0.30, 0.36, 0.44),
)
_ROOFS = ((0.40, 0.40, 0.42), (0.36, 0.28, 0.24), (0.48, 0.50, 0.50))
_TRIM = (0.88, 0.87, 0.84)
_DOORS = (0.30, 0.24, 0.20)

_MARGIN = 0.5
_RECESS = 0.15


class Parameters:
    """Parameters of a barn; lengths in metres.

    Attributes:
        height: of the ridge, the ventilator on it included.
        roof: `gambrel`, `gable` or `barrel`.
        wall: height of the walls, as a part of the ridge's.
        deck: room in front, a jetty of a boat house; 0 for a barn.
        door_width, door_height: of the doors in the gable.
        aisle: width of the lean-to on one side; 0 for none.
        aisle_left: on which.
        batten: distance between battens.
        ventilators: on the ridge.
    """

    def __init__(self, d: Dice) -> None:
        width = min(d.width, d.depth)
        aisle = d.uniform(0.2, 0.28) * width
        self.height = d.height
        self.roof = d.pick(("gambrel", "gable", "gable", "barrel"))
        self.wall = d.uniform(0.42, 0.58)
        self.deck = d.pick((0.0, 0.0, 2.0)) if d.depth > 10.0 else 0.0
        self.door_width = d.uniform(2.6, 4.4, 2)
        self.door_height = d.uniform(2.4, 3.4, 2)
        self.aisle = round(aisle, 2) if d.chance(0.6) and width > 9 else 0.0
        self.aisle_left = d.chance(0.5)
        self.batten = d.uniform(1.0, 1.6)
        self.ventilators = d.whole(0, 3)
        self.rgb = d.pick(_BOARDS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the barn along the longer side of a rectangle."""
    out.paint(
        walls=p.rgb,
        glass=out.glass_rgb,
        roof=p.roof_rgb,
        trim=_TRIM,
        doors=_DOORS,
    )
    x0, y0, x1, y1 = out.site.bounds
    along_y = y1 - y0 >= x1 - x0
    left, right = x0 + _MARGIN, x1 - _MARGIN
    front, back = y0 + _MARGIN + p.deck, y1 - _MARGIN
    a, b, low, high = left, right, front, back
    if along_y:
        a, b = a + p.aisle * p.aisle_left, b - p.aisle * (not p.aisle_left)
    else:
        high -= p.aisle
    top = p.height - (0.7 if p.ventilators else 0.0)
    half = ((b - a) if along_y else (high - low)) / 2
    wall_top = max(2.3, p.wall * top)
    eaves = 0.35
    if p.roof == "barrel":
        # A vault is at most half a circle.
        eaves, wall_top = 0.0, max(wall_top, top - 0.8 * half)
    roof = Roof(p.roof, along_y, eaves, 0.35, 0.18)
    main = Wing.at(a, low, b, high, wall_top, top, roof)
    boxes = [main]
    if p.aisle > 1.5:
        boxes.append(_aisle(p, main, (left, right, back)))
    for wing in boxes:
        _add_box(out, p, wing, boxes)
    _add_ridge(out, p, main)
    if p.deck > 0:
        _add_jetty(out, (left, right), y0, front)


def _add_box(
    out: Assembly, p: Parameters, wing: Wing, boxes: list[Wing]
) -> None:
    """Adds the barn itself, with its doors, or the lean-to."""
    openings = Openings(wing, boxes)
    head = round(min(2.0, wing.wall_top - 0.3), 2)
    openings.row(
        range(4), 1.0, 3.2, [bays.window(0.9, 1.1, head, _RECESS)], 0.8
    )
    if wing is boxes[0]:
        for edge in (0,) if wing.roof.along_y else (3, 0):
            _add_doors(out, p, wing, openings, edge)
    low = wing.wall_top + 0.5
    attic = wings.attic_window(1.0, low, low + 1.3, _RECESS)
    openings.enclose(out, (_RECESS,), (Band(0.0, 0.3, -0.06),), attic=attic)
    for edge in range(4):
        _add_battens(out, p, wing, boxes, openings, edge)


def _aisle(
    p: Parameters, main: Wing, limits: tuple[float, float, float]
) -> Wing:
    """Returns the lean-to against the long side of the barn."""
    left, right, back = limits
    along_y = main.roof.along_y
    high = main.wall_top + 0.1
    low = max(1.9, high - 0.3 * p.aisle)
    high = max(high, low + 0.25)
    # Behind the barn, or beside it: its roof falls away from there.
    area = (main.x0 + 1.0, main.y1 - 0.05, main.x1 - 1.0, back)
    if along_y:
        a, b = main.x1 - 0.05, right
        if p.aisle_left:
            a, b = left, main.x0 + 0.05
        area = (a, main.y0 + 0.8, b, main.y1 - 0.8)
    falling = not (along_y and p.aisle_left)
    roof = Roof("shed", along_y, 0.3, 0.25, 0.15, falling=falling)
    return Wing.at(*area, low, high, roof)


def _add_doors(
    out: Assembly, p: Parameters, wing: Wing, openings: Openings, edge: int
) -> None:
    """Adds a pair of braced doors that slide along the wall."""
    wall = wing.wall(edge)
    width = min(p.door_width, 0.5 * wall.length)
    height = min(p.door_height, wing.wall_top - 0.35)
    x = wall.length / 2
    openings.clear(edge, x - width - 0.2, x + width + 0.2, 0.0, height + 0.4)
    if p.deck > 0 and edge == 0:
        gap = Patch(x - width / 2, x + width / 2, 0.0, height, 2.0)
        openings.put(edge, x, width + 0.4, lambda a, b: [gap])
        spots = (x - width, x + width / 2 + 0.05)
        half = width / 2 - 0.05
    else:
        spots, half = (x - width / 2, x + 0.03), width / 2 - 0.03
    for a in spots:
        b = a + half
        brace = (a + 0.1, 0.1, 0.2), (b - 0.1, 0.1, height - 0.1)
        frame = [
            details.board(a, a + 0.18, 0.08, height, 0.15),
            details.board(b - 0.18, b, 0.08, height, 0.15),
            details.board(a, b, height - 0.18, height, 0.15),
            details.board(a, b, 0.08, 0.26, 0.15),
            details.beam(*brace, 0.1),
        ]
        leaf = details.board(a, b, 0.08, height, 0.1)
        out.add_to("doors", wall.place(leaf))
        out.add_to("trim", *(wall.place(m) for m in frame))
    rail = (x - width - 0.1, x + width + 0.1, 0.0, 0.18)
    out.add_to("trim", wall.box(*rail, height + 0.05, height + 0.18))


def _add_battens(
    out: Assembly,
    p: Parameters,
    wing: Wing,
    boxes: list[Wing],
    openings: Openings,
    edge: int,
) -> None:
    """Adds upright battens on the free parts of a wall between openings."""
    wall = wing.wall(edge)
    reliefs = openings.layout(edge, wall.length)
    for a, b in free_stretches(wing, edge, boxes, 0.5):
        for x, _ in bays.stretches(b - a, p.batten, 0.12):
            u = a + x
            if any(r.x0 - 0.15 < u < r.x1 + 0.15 for r in reliefs):
                continue
            strip = details.board(u - 0.05, u + 0.05, 0.3, wing.wall_top, 0.05)
            out.add_to("walls", wall.place(strip))


def _add_ridge(out: Assembly, p: Parameters, main: Wing) -> None:
    """Adds louvred ventilators on the ridge."""
    z = main.top
    for k in range(p.ventilators):
        share = (k + 0.5) / p.ventilators - 0.5
        x, y = main.center
        if main.roof.along_y:
            y += 0.8 * share * main.depth
        else:
            x += 0.8 * share * main.width
        out.add_to("walls", massing.post(x, y, 0.45, z + 0.3, z - 0.6))
        eaves = massing.square(x, y, 0.65)
        out.add_to("roof", massing.tent(eaves, (x, y), z + 0.3, z + 0.7))


def _add_jetty(out: Assembly, xs: bays.Span, y0: float, front: float) -> None:
    """Adds a plank deck on posts in front of a boat house."""
    (a, b), y = xs, y0 + 0.1
    out.add_to("doors", massing.box(a, b, y, front, 0.05, 0.3))
    for x in np.linspace(a + 0.2, b - 0.2, 4).tolist():
        spot = (x - 0.12, x + 0.12, y + 0.02, y + 0.26)
        out.add_to("doors", massing.standing(*spot, 1.1))
