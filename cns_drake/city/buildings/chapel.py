"""The chapel."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    Wing,
    around,
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


def _add_parts(chapel: Chapel, width: float, length: float) -> None:
    """Adds the chapel on 0..width by 0..length, with its door at y = 0."""
    nave = _nave(chapel, width, length)
    boxes = [nave]
    tower = porch = None
    if chapel.belfry != "cote":
        tower = _tower(chapel, nave)
        boxes.append(tower)
    if chapel.porch and chapel.belfry != "front" and nave.y0 > 2.2:
        porch = _porch(nave)
        boxes.append(porch)
    annex = _vestry(nave, width) if chapel.annex else None
    if annex is not None:
        boxes.append(annex)
    _add_nave(chapel, nave, boxes)
    if chapel.buttresses:
        _add_buttresses(chapel, nave, boxes)
    if tower is not None:
        _add_tower(chapel, tower, boxes)
    else:
        _add_cote(chapel, nave)
    for wing in boxes:
        if wing is not nave and wing is not tower:
            add = _add_porch if wing is porch else _add_vestry
            add(chapel, wing, boxes)


def _nave(chapel: Chapel, width: float, length: float) -> Wing:
    wide = min(chapel.nave * width, 11.0)
    if chapel.belfry == "side":
        wide = min(wide, width - chapel.tower - 2 * _MARGIN_M - 0.1)
    x = (width - wide) / 2
    if chapel.belfry == "side":
        x = _MARGIN_M if chapel.mirrored else width - _MARGIN_M - wide
    ahead = 0.6 * chapel.tower + _MARGIN_M if chapel.belfry == "front" else 2.4
    rise = min(
        wing_roofs.ridge_rise(wide, chapel.pitch_deg), 0.42 * chapel.height
    )
    share = 0.8 if chapel.belfry == "cote" else 0.62
    top = min(share * chapel.height, rise + 7.5)
    wall_top = max(top - rise - _ROOF_M, 0.35 * top)
    roof = Roof(
        "gable", along_y=True, eaves=0.35, verge=0.25, thickness=_ROOF_M
    )
    back = min(length - _MARGIN_M, ahead + 2.6 * wide)
    return Wing.at(
        (x, min(ahead, 0.3 * length), x + wide, back),
        wall_top=wall_top,
        top=top,
        roof=roof,
    )


def _tower(chapel: Chapel, nave: Wing) -> Wing:
    """Returns the shaft of the tower, up to the foot of the spire."""
    side = chapel.tower
    top = max(0.62 * chapel.height, nave.top - 0.3 * (nave.top - nave.wall_top))
    y0 = nave.y0 - 0.6 * side
    x0 = nave.center[0] - side / 2
    if chapel.belfry == "side":
        x0 = nave.x1 - 0.1 if chapel.mirrored else nave.x0 + 0.1 - side
        y0 = nave.y0 + 0.8
    return Wing.at(
        (x0, y0, x0 + side, y0 + side), wall_top=top, top=top, roof=Roof("flat")
    )


def _add_nave(chapel: Chapel, nave: Wing, boxes: list[Wing]) -> None:
    openings = Openings(chapel, nave, boxes)
    high = nave.wall_top
    spring = max(1.6, high - 1.5)
    lancet = bays.arched(
        width=1.0, bottom=1.2, spring=spring, depth=_RECESS_M, rise=0.7
    )
    openings.add_bays(
        (1, 3), z=1.5, pitch=chapel.bay, choices=[lancet], margin=1.0
    )
    middle = nave.width / 2
    if chapel.belfry != "front":
        door = bays.arched(
            width=1.6, bottom=0.0, spring=2.0, depth=0.5, rise=0.8
        )
        if high > 3.1 and not any(w.roof.thickness == 0.15 for w in boxes[1:]):
            openings.replace_by_bay(0, x=middle, width=2.2, bay=door)
        elif not any(w.y0 < nave.y0 for w in boxes[1:]):
            openings.replace_by_bay(
                0,
                x=middle,
                width=2.2,
                bay=bays.entrance(width=1.4, height=2.1, depth=0.4),
            )
    low = high + 0.2 * (nave.top - high)
    rose = wing_roofs.attic_window(
        width=1.3, z0=low, z1=low + 1.6, depth=_RECESS_M
    )
    openings.enclose(
        (_RECESS_M,), bands=(Band(z0=0.0, z1=0.45, depth=-0.08),), attic=rose
    )


def _add_buttresses(chapel: Chapel, nave: Wing, boxes: list[Wing]) -> None:
    high = 0.75 * nave.wall_top
    for edge in (1, 3):
        wall = nave.wall(edge)
        for a, b in free_stretches(nave, edge, boxes, z=0.5):
            for x, _ in bays.stretches(b - a, pitch=chapel.bay, margin=1.0)[1:]:
                left, right = a + x - 0.22, a + x + 0.22
                plan = outlines.rectangle(left, -0.05, right, 0.42)
                slope = outlines.rectangle(left, -0.05, right, 0.05)
                body = solids.skirt(
                    plan, plan, z0=-solids.FOUNDATION_M, z1=high
                )
                cap = solids.frustum(plan, slope, z0=high, z1=high + 0.5)
                chapel.add_to("walls", wall.place(body), wall.place(cap))


def _add_tower(chapel: Chapel, tower: Wing, boxes: list[Wing]) -> None:
    """Adds the shaft, its bell chamber and the spire with a cross."""
    openings = Openings(chapel, tower, boxes)
    side, top = tower.width, tower.wall_top
    width = round(min(1.2, 0.4 * side), 2)
    louvre = bays.arched(
        width=width, bottom=top - 2.6, spring=top - 1.3, depth=_RECESS_M
    )
    slit = bays.window(
        width=0.5, sill=0.5 * top, head=0.5 * top + 1.2, depth=_RECESS_M
    )
    for edge in range(4):
        openings.replace_by_bay(edge, x=side / 2, width=width + 0.7, bay=louvre)
        if chapel.belfry != "side" or edge != 3 - 2 * chapel.mirrored:
            openings.replace_by_bay(edge, x=side / 2, width=1.0, bay=slit)
    if chapel.belfry == "front":
        width = round(min(1.7, side - 1.1), 2)
        door = bays.arched(width=width, bottom=0.0, spring=2.1, depth=0.45)
        openings.replace_by_bay(0, x=side / 2, width=width + 0.6, bay=door)
    bands = (
        Band(z0=0.0, z1=0.45, depth=-0.1),
        Band(z0=top - 3.1, z1=top - 2.9, depth=-0.08),
        Band(z0=top - 0.3, z1=top, depth=-0.18),
    )
    openings.add_walls((_RECESS_M,), bands)
    chapel.add_to("roof", *_spire(chapel, tower))
    chapel.add_to(
        "trim", *_cross(*tower.center, chapel.height - 1.3, chapel.height)
    )


def _spire(chapel: Chapel, tower: Wing) -> list[Mesh]:
    z = tower.wall_top
    tip = chapel.height - 1.0
    center = tower.center
    eaves = outlines.inset(tower.outline, -0.3)
    pieces = [
        solids.flat(eaves, z - 0.02, up=False),
        solids.skirt(eaves, eaves, z0=z - 0.02, z1=z + 0.2),
    ]
    if chapel.spire == "cap":
        knee = z + 0.45 * (tip - z)
        waist = outlines.inset(tower.outline, 0.32 * tower.width)
        pieces += [
            solids.skirt(eaves, waist, z0=z + 0.2, z1=knee),
            solids.spire(waist, center, z0=knee, z1=tip),
        ]
    elif chapel.spire == "broach":
        # A low octagonal pyramid on the square tower, with a needle through it.
        ring = outlines.regular_polygon(
            radius=0.5 * tower.width, count=8, center=center, phase=np.pi / 8
        )
        pieces += [
            solids.spire(eaves, center, z0=z + 0.2, z1=z + 0.45 * (tip - z)),
            solids.spire(ring, center, z0=z + 0.1, z1=tip),
        ]
    else:
        pieces.append(solids.spire(eaves, center, z0=z + 0.2, z1=tip))
    return pieces


def _add_cote(chapel: Chapel, nave: Wing) -> None:
    """Adds a small open belfry on the ridge at the front."""
    x, y = nave.center[0], nave.y0 + 1.1
    low, high = nave.top - 0.9, chapel.height - 1.6
    if high - nave.top < 0.9:
        chapel.add_to(
            "trim", *_cross(x, nave.y0, nave.top - 0.3, chapel.height)
        )
        return
    chapel.add_to(
        "walls", solids.post(x, y, half=0.7, z1=nave.top + 0.3, z0=low)
    )
    posts = (
        solids.post(u, v, half=0.1, z1=high, z0=nave.top + 0.2)
        for u in (x - 0.55, x + 0.55)
        for v in (y - 0.55, y + 0.55)
    )
    bell = [(0.34, high - 0.75), (0.24, high - 0.45), (0.12, high - 0.2)]
    rim = outlines.regular_polygon(radius=0.34, count=8, center=(x, y))
    chapel.add_to(
        "trim",
        *posts,
        solids.revolved(bell, 8, center=(x, y)),
        solids.flat(rim, high - 0.75, up=False),
        *_cross(x, y, chapel.height - 1.0, chapel.height),
    )
    eaves = outlines.square(x, y, half=0.95)
    z = high - 0.02
    chapel.add_to(
        "roof", solids.tent(eaves, (x, y), z0=z, z1=chapel.height - 0.8)
    )


def _add_porch(chapel: Chapel, wing: Wing, boxes: list[Wing]) -> None:
    """Adds the porch, which is open to the front."""
    openings = Openings(chapel, wing, boxes)
    arch = bays.window(width=1.5, sill=0.0, head=wing.wall_top - 0.3, depth=0.9)
    openings.replace_by_bay(0, x=wing.width / 2, width=2.2, bay=arch)
    openings.enclose((_RECESS_M,))


def _add_vestry(chapel: Chapel, wing: Wing, boxes: list[Wing]) -> None:
    """Adds the vestry, with windows on all sides."""
    openings = Openings(chapel, wing, boxes)
    head = round(min(2.0, wing.wall_top - 0.3), 2)
    openings.add_bays(
        range(4),
        z=1.2,
        pitch=2.2,
        choices=[bays.window(width=0.8, sill=1.0, head=head, depth=_RECESS_M)],
    )
    openings.enclose((_RECESS_M,))


def _porch(nave: Wing) -> Wing:
    middle = nave.center[0]
    half = 1.3
    roof = Roof("gable", along_y=True, eaves=0.25, verge=0.25, thickness=0.15)
    area = (middle - half, nave.y0 - 1.7, middle + half, nave.y0 + 0.1)
    top = min(4.2, nave.wall_top + 0.8)
    return Wing.at(
        area, wall_top=min(2.6, nave.wall_top - 0.2), top=top, roof=roof
    )


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
    roof = Roof(
        "shed",
        along_y=True,
        eaves=0.25,
        verge=0.2,
        thickness=0.15,
        falling=side == 0,
    )
    if high - low < 0.3 or y0 < nave.y0 + 1.0:
        return None
    return Wing.at((a, y0, b, nave.y1 - 0.4), wall_top=low, top=high, roof=roof)


def _cross(x: float, y: float, z0: float, z1: float) -> list[Mesh]:
    """Returns a cross that faces the front.

    Args:
        x: x of the cross's middle [m].
        y: y of the cross's middle [m].
        z0: height of the foot [m].
        z1: height of the top [m].
    """
    arm = z1 - 0.4
    y_range = (y - 0.06, y + 0.06)
    return [
        solids.box(x=around(x, 0.06), y=y_range, z=(z0, z1)),
        solids.box(x=around(x, 0.35), y=y_range, z=(arm, arm + 0.12)),
    ]
