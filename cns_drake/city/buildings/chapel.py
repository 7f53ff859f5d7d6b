"""The chapel."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    Wing,
    bays,
    free_stretches,
    outlines,
    solids,
    wing_roofs,
)
from cns_drake.city.geometry.mesh import Mesh

# Free strip around the walls, for eaves and buttresses [m].
_MARGIN_M = 0.45
# Depth of the windows behind the wall [m].
_RECESS_M = 0.22
# Vertical thickness of the roof of the nave [m].
_ROOF_M = 0.2


class Chapel(Building):
    """The chapel: a nave with a steep roof, a tower or bell cote, a porch."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        wide = min(site.width, site.depth, 18.0)
        # `front` (a tower in the middle of the front), `side` (a tower beside
        # the nave) or `cote` (a bell gable on the roof).
        self.belfry = "cote"
        if self.height >= 13.0:
            self.belfry = self.pick(("front", "side", "front"))
        self.spire = self.pick(("needle", "broach", "cap"))
        # Length of a side of the tower.
        self.tower = round(self.uniform(0.24, 0.3) * wide + 0.6, 2)
        # Width of the nave, as a share of the width of the site.
        self.nave = self.uniform(0.62, 0.72)
        self.pitch_deg = self.uniform(44.0, 54.0)
        # Distance between the side windows.
        self.bay = self.uniform(2.8, 3.8)
        self.buttresses = self.chance(0.5)
        # Whether the door has a porch, with a cote or a side tower.
        self.porch = self.chance(0.7)
        # Whether a vestry stands beside the choir.
        self.annex = self.chance(0.6)
        self.mirrored = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the chapel, parallel to the site's longer sides.

        The door is at the front of the site. If the site is wider than it is
        deep, the door is on the left, as seen from the front. The site must be
        a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        if y1 - y0 >= x1 - x0:
            _add_parts(self, x1 - x0, y1 - y0)
            self.turn((x0, y0, 0.0), 0.0)
        else:
            # The chapel is built along y, then turned by a quarter to the
            # right.
            _add_parts(self, y1 - y0, x1 - x0)
            self.turn((x0, y1, 0.0), -np.pi / 2)


def _add_parts(p: Chapel, width: float, length: float) -> None:
    """Adds the chapel on 0..width by 0..length, with its door at y = 0."""
    nave = _nave(p, width, length)
    boxes = [nave]
    tower = porch = None
    if p.belfry != "cote":
        tower = _tower(p, nave)
        boxes.append(tower)
    if p.porch and p.belfry != "front" and nave.y0 > 2.2:
        porch = _porch(nave)
        boxes.append(porch)
    annex = _vestry(nave, width) if p.annex else None
    if annex is not None:
        boxes.append(annex)
    _add_nave(p, nave, boxes)
    if p.buttresses:
        _add_buttresses(p, nave, boxes)
    if tower is not None:
        _add_tower(p, tower, boxes)
    else:
        _add_cote(p, nave)
    for wing in boxes:
        if wing is not nave and wing is not tower:
            add = _add_porch if wing is porch else _add_vestry
            add(p, wing, boxes)


def _nave(p: Chapel, width: float, length: float) -> Wing:
    wide = min(p.nave * width, 11.0)
    if p.belfry == "side":
        wide = min(wide, width - p.tower - 2 * _MARGIN_M - 0.1)
    x = (width - wide) / 2
    if p.belfry == "side":
        x = _MARGIN_M if p.mirrored else width - _MARGIN_M - wide
    ahead = 0.6 * p.tower + _MARGIN_M if p.belfry == "front" else 2.4
    rise = min(wing_roofs.ridge_rise(wide, p.pitch_deg), 0.42 * p.height)
    share = 0.8 if p.belfry == "cote" else 0.62
    top = min(share * p.height, rise + 7.5)
    wall_top = max(top - rise - _ROOF_M, 0.35 * top)
    roof = Roof("gable", True, 0.35, 0.25, _ROOF_M)
    back = min(length - _MARGIN_M, ahead + 2.6 * wide)
    return Wing.at((x, min(ahead, 0.3 * length), x + wide, back), wall_top, top,
                   roof)  # fmt: skip


def _tower(p: Chapel, nave: Wing) -> Wing:
    """Returns the shaft of the tower, up to the foot of the spire."""
    side = p.tower
    top = max(0.62 * p.height, nave.top - 0.3 * (nave.top - nave.wall_top))
    y0 = nave.y0 - 0.6 * side
    x0 = nave.center[0] - side / 2
    if p.belfry == "side":
        x0 = nave.x1 - 0.1 if p.mirrored else nave.x0 + 0.1 - side
        y0 = nave.y0 + 0.8
    return Wing.at((x0, y0, x0 + side, y0 + side), top, top, Roof("flat"))


def _add_nave(p: Chapel, nave: Wing, boxes: list[Wing]) -> None:
    openings = Openings(p, nave, boxes)
    high = nave.wall_top
    spring = max(1.6, high - 1.5)
    lancet = bays.arched(1.0, 1.2, spring, _RECESS_M, rise=0.7)
    openings.add_bays((1, 3), 1.5, p.bay, [lancet], 1.0)
    middle = nave.width / 2
    if p.belfry != "front":
        door = bays.arched(1.6, 0.0, 2.0, 0.5, rise=0.8)
        if high > 3.1 and not any(w.roof.thickness == 0.15 for w in boxes[1:]):
            openings.replace_by_bay(0, middle, 2.2, door)
        elif not any(w.y0 < nave.y0 for w in boxes[1:]):
            openings.replace_by_bay(
                0, middle, 2.2, bays.entrance(1.4, 2.1, 0.4)
            )
    low = high + 0.2 * (nave.top - high)
    rose = wing_roofs.attic_window(1.3, low, low + 1.6, _RECESS_M)
    openings.enclose((_RECESS_M,), (Band(0.0, 0.45, -0.08),), attic=rose)


def _add_buttresses(p: Chapel, nave: Wing, boxes: list[Wing]) -> None:
    high = 0.75 * nave.wall_top
    for edge in (1, 3):
        wall = nave.wall(edge)
        for a, b in free_stretches(nave, edge, boxes, 0.5):
            for x, _ in bays.stretches(b - a, p.bay, 1.0)[1:]:
                left, right = a + x - 0.22, a + x + 0.22
                plan = outlines.rectangle(left, -0.05, right, 0.42)
                slope = outlines.rectangle(left, -0.05, right, 0.05)
                body = solids.skirt(plan, plan, -solids.FOUNDATION_M, high)
                cap = solids.frustum(plan, slope, high, high + 0.5)
                p.add_to("walls", wall.place(body), wall.place(cap))


def _add_tower(p: Chapel, tower: Wing, boxes: list[Wing]) -> None:
    """Adds the shaft, its bell chamber and the spire with a cross."""
    openings = Openings(p, tower, boxes)
    side, top = tower.width, tower.wall_top
    width = round(min(1.2, 0.4 * side), 2)
    louvre = bays.arched(width, top - 2.6, top - 1.3, _RECESS_M)
    slit = bays.window(0.5, 0.5 * top, 0.5 * top + 1.2, _RECESS_M)
    for edge in range(4):
        openings.replace_by_bay(edge, side / 2, width + 0.7, louvre)
        if p.belfry != "side" or edge != 3 - 2 * p.mirrored:
            openings.replace_by_bay(edge, side / 2, 1.0, slit)
    if p.belfry == "front":
        width = round(min(1.7, side - 1.1), 2)
        door = bays.arched(width, 0.0, 2.1, 0.45)
        openings.replace_by_bay(0, side / 2, width + 0.6, door)
    bands = (Band(0.0, 0.45, -0.1), Band(top - 3.1, top - 2.9, -0.08),
             Band(top - 0.3, top, -0.18))  # fmt: skip
    openings.add_walls((_RECESS_M,), bands)
    p.add_to("roof", *_spire(p, tower))
    p.add_to("trim", *_cross(*tower.center, p.height - 1.3, p.height))


def _spire(p: Chapel, tower: Wing) -> list[Mesh]:
    z = tower.wall_top
    tip = p.height - 1.0
    center = tower.center
    eaves = outlines.inset(tower.outline, -0.3)
    pieces = [
        solids.flat(eaves, z - 0.02, up=False),
        solids.skirt(eaves, eaves, z - 0.02, z + 0.2),
    ]
    if p.spire == "cap":
        knee = z + 0.45 * (tip - z)
        waist = outlines.inset(tower.outline, 0.32 * tower.width)
        pieces += [
            solids.skirt(eaves, waist, z + 0.2, knee),
            solids.spire(waist, center, knee, tip),
        ]
    elif p.spire == "broach":
        # A low octagonal pyramid on the square tower, with a needle through it.
        ring = outlines.regular_polygon(0.5 * tower.width, 8, center, np.pi / 8)
        pieces += [
            solids.spire(eaves, center, z + 0.2, z + 0.45 * (tip - z)),
            solids.spire(ring, center, z + 0.1, tip),
        ]
    else:
        pieces.append(solids.spire(eaves, center, z + 0.2, tip))
    return pieces


def _add_cote(p: Chapel, nave: Wing) -> None:
    """Adds a small open belfry on the ridge at the front."""
    x, y = nave.center[0], nave.y0 + 1.1
    low, high = nave.top - 0.9, p.height - 1.6
    if high - nave.top < 0.9:
        p.add_to("trim", *_cross(x, nave.y0, nave.top - 0.3, p.height))
        return
    p.add_to("walls", solids.post(x, y, 0.7, nave.top + 0.3, low))
    posts = (
        solids.post(u, v, 0.1, high, nave.top + 0.2)
        for u in (x - 0.55, x + 0.55)
        for v in (y - 0.55, y + 0.55)
    )
    bell = [(0.34, high - 0.75), (0.24, high - 0.45), (0.12, high - 0.2)]
    rim = outlines.regular_polygon(0.34, 8, (x, y))
    p.add_to(
        "trim",
        *posts,
        solids.revolved(bell, 8, (x, y)),
        solids.flat(rim, high - 0.75, up=False),
        *_cross(x, y, p.height - 1.0, p.height),
    )
    eaves = outlines.square(x, y, 0.95)
    z = high - 0.02
    p.add_to("roof", solids.tent(eaves, (x, y), z, p.height - 0.8))


def _add_porch(p: Chapel, wing: Wing, boxes: list[Wing]) -> None:
    """Adds the porch, which is open to the front."""
    openings = Openings(p, wing, boxes)
    arch = bays.window(1.5, 0.0, wing.wall_top - 0.3, 0.9)
    openings.replace_by_bay(0, wing.width / 2, 2.2, arch)
    openings.enclose((_RECESS_M,))


def _add_vestry(p: Chapel, wing: Wing, boxes: list[Wing]) -> None:
    """Adds the vestry, with windows on all sides."""
    openings = Openings(p, wing, boxes)
    head = round(min(2.0, wing.wall_top - 0.3), 2)
    openings.add_bays(
        range(4), 1.2, 2.2, [bays.window(0.8, 1.0, head, _RECESS_M)]
    )
    openings.enclose((_RECESS_M,))


def _porch(nave: Wing) -> Wing:
    middle = nave.center[0]
    half = 1.3
    roof = Roof("gable", True, 0.25, 0.25, 0.15)
    area = (middle - half, nave.y0 - 1.7, middle + half, nave.y0 + 0.1)
    top = min(4.2, nave.wall_top + 0.8)
    return Wing.at(area, min(2.6, nave.wall_top - 0.2), top, roof)


def _vestry(nave: Wing, width: float) -> Wing | None:
    """Returns a vestry beside the choir, or None if there is no room for it."""
    room = width - _MARGIN_M - nave.x1, nave.x0 - _MARGIN_M
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
    return Wing.at((a, y0, b, nave.y1 - 0.4), low, high, roof)


def _cross(x: float, y: float, z0: float, z1: float) -> list[Mesh]:
    arm = z1 - 0.4
    ys = (y - 0.06, y + 0.06)
    return [
        solids.box(x - 0.06, x + 0.06, *ys, z0, z1),
        solids.box(x - 0.35, x + 0.35, *ys, arm, arm + 0.12),
    ]
