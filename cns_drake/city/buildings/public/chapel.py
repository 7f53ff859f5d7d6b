"""The chapel: a nave under a steep roof, a tower or a bell cote, a porch."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, massing, wings
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings, free_stretches
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Roof, Wing
from cns_drake.city.geometry.mesh import Mesh

_WALLS = (
    (0.90, 0.89, 0.86),
    (0.62, 0.60, 0.55),
    (0.56, 0.36, 0.30),
    (0.82, 0.76, 0.64),
)
_ROOFS = ((0.32, 0.33, 0.36), (0.44, 0.28, 0.23), (0.36, 0.40, 0.37))
_TRIM = (0.88, 0.87, 0.84)
_MARGIN = 0.45
_RECESS = 0.22
_THICK = 0.2


class Parameters:
    """Parameters of a chapel; lengths in metres.

    Attributes:
        height: of the cross on top.
        belfry: `front` (a tower in the middle of the front), `side` (a
            tower beside the nave) or `cote` (a bell gable on the roof).
        spire: `needle`, `broach` or `cap`.
        tower: side of the tower.
        nave: width of the nave, as a part of the site's.
        pitch_deg: of the nave's roof.
        bay: distance between the side windows.
        buttresses: whether the long walls have them.
        porch: whether the door has a porch (with a cote or a side tower).
        annex: whether a vestry stands beside the choir.
    """

    def __init__(self, d: Dice) -> None:
        width = min(d.width, d.depth, 18.0)
        small = d.height < 13.0
        self.height = d.height
        self.belfry = "cote" if small else d.pick(("front", "side", "front"))
        self.spire = d.pick(("needle", "broach", "cap"))
        self.tower = round(d.uniform(0.24, 0.3) * width + 0.6, 2)
        self.nave = d.uniform(0.62, 0.72)
        self.pitch_deg = d.uniform(44.0, 54.0)
        self.bay = d.uniform(2.8, 3.8)
        self.buttresses = d.chance(0.5)
        self.porch = d.chance(0.7)
        self.annex = d.chance(0.6)
        self.mirrored = d.chance(0.5)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the chapel along the longer side of a rectangle.

    Its door is in front, or on the left where it lies along x.
    """
    out.paint(walls=p.rgb, glass=out.glass_rgb, roof=p.roof_rgb, trim=_TRIM)
    x0, y0, x1, y1 = out.site.bounds
    if y1 - y0 >= x1 - x0:
        _add_all(p, out, x1 - x0, y1 - y0)
        out.turn((x0, y0, 0.0), 0.0)
    else:
        # The chapel is built along y, then turned a quarter to the right.
        _add_all(p, out, y1 - y0, x1 - x0)
        out.turn((x0, y1, 0.0), -np.pi / 2)


def _add_all(p: Parameters, out: Assembly, width: float, length: float) -> None:
    """Adds the chapel over 0..width, 0..length, its door at y = 0."""
    nave = _nave(p, width, length)
    boxes = [nave]
    tower = porch = None
    if p.belfry != "cote":
        tower = _tower(p, nave)
        boxes.append(tower)
    if p.porch and p.belfry != "front" and nave.y0 > 2.2:
        porch = _porch(nave)
        boxes.append(porch)
    annex = _annex(nave, width) if p.annex else None
    if annex is not None:
        boxes.append(annex)
    _add_nave(out, p, nave, boxes)
    if p.buttresses:
        _add_buttresses(out, p, nave, boxes)
    if tower is not None:
        _add_tower(out, p, tower, boxes)
    else:
        _add_cote(out, p, nave)
    for wing in boxes:
        if wing is not nave and wing is not tower:
            _add_small(out, wing, boxes, is_porch=wing is porch)


def _nave(p: Parameters, width: float, length: float) -> Wing:
    wide = min(p.nave * width, 11.0)
    if p.belfry == "side":
        wide = min(wide, width - p.tower - 2 * _MARGIN - 0.1)
    x = (width - wide) / 2
    if p.belfry == "side":
        x = _MARGIN if p.mirrored else width - _MARGIN - wide
    ahead = 0.6 * p.tower + _MARGIN if p.belfry == "front" else 2.4
    rise = min(wings.ridge_rise(wide, p.pitch_deg), 0.42 * p.height)
    share = 0.8 if p.belfry == "cote" else 0.62
    top = min(share * p.height, rise + 7.5)
    wall_top = max(top - rise - _THICK, 0.35 * top)
    roof = Roof("gable", True, 0.35, 0.25, _THICK)
    back = min(length - _MARGIN, ahead + 2.6 * wide)
    return Wing.at(x, min(ahead, 0.3 * length), x + wide, back, wall_top, top,
                   roof)  # fmt: skip


def _tower(p: Parameters, nave: Wing) -> Wing:
    """Returns the shaft of the tower, up to the foot of the spire."""
    side = p.tower
    top = max(0.62 * p.height, nave.top - 0.3 * (nave.top - nave.wall_top))
    y0 = nave.y0 - 0.6 * side
    x0 = nave.center[0] - side / 2
    if p.belfry == "side":
        x0 = nave.x1 - 0.1 if p.mirrored else nave.x0 + 0.1 - side
        y0 = nave.y0 + 0.8
    return Wing.at(x0, y0, x0 + side, y0 + side, top, top, Roof("flat"))


def _porch(nave: Wing) -> Wing:
    middle, half = nave.center[0], 1.3
    roof = Roof("gable", True, 0.25, 0.25, 0.15)
    area = (middle - half, nave.y0 - 1.7, middle + half, nave.y0 + 0.1)
    top = min(4.2, nave.wall_top + 0.8)
    return Wing.at(*area, min(2.6, nave.wall_top - 0.2), top, roof)


def _annex(nave: Wing, width: float) -> Wing | None:
    """Returns a vestry beside the choir, where there is room."""
    room = width - _MARGIN - nave.x1, nave.x0 - _MARGIN
    side = int(room[1] > room[0])
    if room[side] < 1.5:
        return None
    reach = min(room[side], 3.2)
    high = min(nave.wall_top - 0.2, 3.6)
    low = max(high - 0.45 * reach, 1.9)
    y0 = nave.y1 - 4.2
    a, b = nave.x1 - 0.05, nave.x1 + reach
    if side == 1:
        a, b = nave.x0 - reach, nave.x0 + 0.05
    roof = Roof("shed", True, 0.25, 0.2, 0.15, falling=side == 0)
    if high - low < 0.3 or y0 < nave.y0 + 1.0:
        return None
    return Wing.at(a, y0, b, nave.y1 - 0.4, low, high, roof)


def _add_nave(
    out: Assembly, p: Parameters, nave: Wing, boxes: list[Wing]
) -> None:
    openings = Openings(nave, boxes)
    high = nave.wall_top
    spring = max(1.6, high - 1.5)
    lancet = bays.arched(1.0, 1.2, spring, _RECESS, rise=0.7)
    openings.row((1, 3), 1.5, p.bay, [lancet], 1.0)
    middle = nave.width / 2
    if p.belfry != "front":
        door = bays.arched(1.6, 0.0, 2.0, 0.5, rise=0.8)
        if high > 3.1 and not any(w.roof.thickness == 0.15 for w in boxes[1:]):
            openings.put(0, middle, 2.2, door)
        elif not any(w.y0 < nave.y0 for w in boxes[1:]):
            openings.put(0, middle, 2.2, bays.entrance(1.4, 2.1, 0.4))
    low = high + 0.2 * (nave.top - high)
    rose = wings.attic_window(1.3, low, low + 1.6, _RECESS)
    openings.enclose(out, (_RECESS,), (Band(0.0, 0.45, -0.08),), attic=rose)


def _add_buttresses(
    out: Assembly, p: Parameters, nave: Wing, boxes: list[Wing]
) -> None:
    high = 0.75 * nave.wall_top
    for edge in (1, 3):
        wall = nave.wall(edge)
        for a, b in free_stretches(nave, edge, boxes, 0.5):
            for x, _ in bays.stretches(b - a, p.bay, 1.0)[1:]:
                left, right = a + x - 0.22, a + x + 0.22
                plan = massing.rectangle(left, -0.05, right, 0.42)
                slope = massing.rectangle(left, -0.05, right, 0.05)
                body = massing.skirt(plan, plan, -massing.FOUNDATION_M, high)
                cap = massing.frustum(plan, slope, high, high + 0.5)
                out.add_to("walls", wall.place(body), wall.place(cap))


def _add_tower(
    out: Assembly, p: Parameters, tower: Wing, boxes: list[Wing]
) -> None:
    """Adds the shaft, its bell chamber and the spire with a cross."""
    openings = Openings(tower, boxes)
    side, top = tower.width, tower.wall_top
    width = round(min(1.2, 0.4 * side), 2)
    louvre = bays.arched(width, top - 2.6, top - 1.3, _RECESS)
    slit = bays.window(0.5, 0.5 * top, 0.5 * top + 1.2, _RECESS)
    for edge in range(4):
        openings.put(edge, side / 2, width + 0.7, louvre)
        if p.belfry != "side" or edge != 3 - 2 * p.mirrored:
            openings.put(edge, side / 2, 1.0, slit)
    if p.belfry == "front":
        width = round(min(1.7, side - 1.1), 2)
        door = bays.arched(width, 0.0, 2.1, 0.45)
        openings.put(0, side / 2, width + 0.6, door)
    bands = (Band(0.0, 0.45, -0.1), Band(top - 3.1, top - 2.9, -0.08),
             Band(top - 0.3, top, -0.18))  # fmt: skip
    openings.add_walls(out, (_RECESS,), bands)
    out.add_to("roof", *_spire(p, tower))
    out.add_to("trim", *_cross(*tower.center, p.height - 1.3, p.height))


def _spire(p: Parameters, tower: Wing) -> list[Mesh]:
    z, tip, center = tower.wall_top, p.height - 1.0, tower.center
    eaves = massing.inset(tower.outline, -0.3)
    pieces = [
        massing.flat(eaves, z - 0.02, up=False),
        massing.skirt(eaves, eaves, z - 0.02, z + 0.2),
    ]
    if p.spire == "cap":
        knee = z + 0.45 * (tip - z)
        waist = massing.inset(tower.outline, 0.32 * tower.width)
        pieces += [
            massing.skirt(eaves, waist, z + 0.2, knee),
            massing.spire(waist, center, knee, tip),
        ]
    elif p.spire == "broach":
        # Eight sides on a square: a low pyramid with a needle through it.
        ring = massing.regular_polygon(0.5 * tower.width, 8, center, np.pi / 8)
        pieces += [
            massing.spire(eaves, center, z + 0.2, z + 0.45 * (tip - z)),
            massing.spire(ring, center, z + 0.1, tip),
        ]
    else:
        pieces.append(massing.spire(eaves, center, z + 0.2, tip))
    return pieces


def _cross(x: float, y: float, z0: float, z1: float) -> list[Mesh]:
    arm, ys = z1 - 0.4, (y - 0.06, y + 0.06)
    return [
        massing.box(x - 0.06, x + 0.06, *ys, z0, z1),
        massing.box(x - 0.35, x + 0.35, *ys, arm, arm + 0.12),
    ]


def _add_cote(out: Assembly, p: Parameters, nave: Wing) -> None:
    """Adds a small open belfry on the ridge at the front."""
    x, y = nave.center[0], nave.y0 + 1.1
    low, high = nave.top - 0.9, p.height - 1.6
    if high - nave.top < 0.9:
        out.add_to("trim", *_cross(x, nave.y0, nave.top - 0.3, p.height))
        return
    out.add_to("walls", massing.post(x, y, 0.7, nave.top + 0.3, low))
    posts = (
        massing.post(u, v, 0.1, high, nave.top + 0.2)
        for u in (x - 0.55, x + 0.55)
        for v in (y - 0.55, y + 0.55)
    )
    bell = [(0.34, high - 0.75), (0.24, high - 0.45), (0.12, high - 0.2)]
    rim = massing.regular_polygon(0.34, 8, (x, y))
    out.add_to(
        "trim",
        *posts,
        massing.revolved(bell, 8, (x, y)),
        massing.flat(rim, high - 0.75, up=False),
        *_cross(x, y, p.height - 1.0, p.height),
    )
    eaves, z = massing.square(x, y, 0.95), high - 0.02
    out.add_to("roof", massing.tent(eaves, (x, y), z, p.height - 0.8))


def _add_small(
    out: Assembly, wing: Wing, boxes: list[Wing], *, is_porch: bool
) -> None:
    """Adds the porch or the vestry."""
    openings = Openings(wing, boxes)
    if is_porch:
        arch = bays.window(1.5, 0.0, wing.wall_top - 0.3, 0.9)
        openings.put(0, wing.width / 2, 2.2, arch)
    else:
        head = round(min(2.0, wing.wall_top - 0.3), 2)
        openings.row(range(4), 1.2, 2.2, [bays.window(0.8, 1.0, head, _RECESS)])
    openings.enclose(out, (_RECESS,))
