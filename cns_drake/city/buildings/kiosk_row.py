"""The row of kiosks."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Patch,
    Roof,
    Wing,
    bays,
    boards,
    canopies,
    outlines,
    roofs,
    solids,
)

# Height of a stall's counter [m].
_COUNTER_M = 1.05


class KioskRow(Building):
    """The row of kiosks: small stalls with counters behind a common arcade."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        reach = self.uniform(1.6, 2.4, 2)
        # Wanted width of a stall.
        self.stall = self.uniform(2.8, 4.2)
        self.depth = round(min(self.uniform(2.8, 4.2), site.depth - 3.0), 2)
        # Distance between groups of stalls.
        self.gap = self.uniform(0.8, 1.8, 2)
        # Number of stalls in a group; they are built wall to wall.
        self.group = self.whole(1, 4)
        self.roof = self.pick(("hip", "gable", "barrel", "shed"))
        # Reach of a roof on posts in front; 0 for awnings.
        self.arcade = reach if self.chance(0.5) else 0.0
        # Whether one stall carries a lantern.
        self.tower = self.height > 4.6 and self.chance(0.6)

    def build(self) -> None:
        """Adds all parts of the kiosks, side by side along the front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + 0.5, x1 - 0.5
        front = y0 + 2.2 if self.arcade == 0.0 else y0 + self.arcade + 0.5
        boxes = _stalls(self, left, right, front)
        tallest = len(boxes) // 2
        for k, wing in enumerate(boxes):
            _add_stall(self, wing, boxes, k)
            if k == tallest and self.tower:
                _add_lantern(self, wing)
        if self.arcade > 0:
            _add_arcade(self, (boxes[0].x0, boxes[-1].x1), front)
        slab = solids.box(left - 0.3, right + 0.3, y0 + 0.1, y1 - 0.1,
                           -solids.FOUNDATION_M, 0.12)  # fmt: skip
        self.add_to("timber", slab)


def _stalls(p: KioskRow, left: float, right: float, front: float) -> list[Wing]:
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
    boxes = []
    x = left
    for k in range(count):
        high = top - (0.25 * (k % 2) if k != count // 2 else 0.0)
        wall = max(2.2, high - 0.32 * min(width, p.depth))
        area = (x, front, x + width, front + p.depth)
        boxes.append(Wing.at(area, min(wall, high - 0.35), high, roof))
        x += width + p.gap * ((k + 1) % p.group == 0)
    return boxes


def _add_stall(p: KioskRow, wing: Wing, boxes: list[Wing], k: int) -> None:
    """Adds a stall: a counter under an awning, or closed shutters."""
    openings = Openings(p, wing, boxes)
    wall = wing.wall(0)
    material = ("stalls", "others")[k % 2]
    a, b = 0.3, wall.length - 0.3
    head = min(2.15, wing.wall_top - 0.25)
    if p.chance(0.75):
        openings.add_reliefs(0, [Patch(a, b, _COUNTER_M, head, 0.7)])
        shelf = wall.box(a, b, -0.3, 0.3, _COUNTER_M - 0.08, _COUNTER_M)
        p.add_to("timber", shelf)
        if p.arcade == 0.0:
            shade = canopies.awning(a - 0.1, b + 0.1, 1.3, 1.95, head + 0.1)
            p.add_to("awning", wall.place(shade))
    else:
        shutter = bays.gate(b - a, head, 0.12)
        openings.add_reliefs(0, shutter(a - 0.3, b + 0.3))
    door = bays.window(0.9, 0.05, 2.0, 0.12)
    openings.add_bays((2,), 0.2, wall.length, [door], 0.3)
    sign = boards.board(a, b, head + 0.02, wing.wall_top - 0.02, 0.1)
    p.add_to("awning", wall.place(sign))
    bands = (Band(0.0, 0.25, -0.05),)
    openings.enclose((0.12,), bands, material)


def _add_lantern(p: KioskRow, wing: Wing) -> None:
    """Adds a small square lantern with its own roof."""
    low = wing.wall_top
    top = p.height
    body = outlines.square(*wing.center, 0.6)
    eaves = outlines.inset(body, -0.25)
    p.add_to("others", solids.skirt(body, body, low, top - 0.7))
    p.add_to("roof", solids.tent(eaves, wing.center, top - 0.72, top))


def _add_arcade(p: KioskRow, xs: bays.Span, front: float) -> None:
    """Adds a lean-to roof on posts along the whole row."""
    a, b = xs
    low = 2.35
    y = front - p.arcade
    top = min(2.9, p.height - 0.4)
    line = [(y - 0.15, low + 0.15), (front + 0.05, top)]
    p.add_to("roof", roofs.shell(line, a, b, 0.12))
    for x in np.linspace(a + 0.15, b - 0.15, max(2, round((b - a) / 3.2))):
        post = solids.standing(x - 0.08, x + 0.08, y, y + 0.16, low + 0.1)
        p.add_to("timber", post)
    beam = solids.box(a, b, y, y + 0.16, low - 0.15, low + 0.06)
    p.add_to("timber", beam)
