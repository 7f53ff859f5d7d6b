"""The row of kiosks."""

import numpy as np

from cns_drake.city.facades import (
    Building,
    Openings,
    Patch,
    Roof,
    Wing,
    around,
    bays,
    boards,
    canopies,
    foot_band,
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
        reach = self.uniform(1.6, 2.4, digits=2)
        # Wanted width of a stall.
        self.stall = self.uniform(2.8, 4.2)
        self.depth = round(min(self.uniform(2.8, 4.2), site.depth - 3.0), 2)
        # Distance between groups of stalls.
        self.gap = self.uniform(0.8, 1.8, digits=2)
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
        slab = solids.box(
            x=(left - 0.3, right + 0.3),
            y=(y0 + 0.1, y1 - 0.1),
            z=(-solids.FOUNDATION_M, 0.12),
        )
        self.add_to("timber", slab)


def _stalls(
    kiosks: KioskRow, left: float, right: float, front: float
) -> list[Wing]:
    """Returns the boxes of the stalls; the middle one is the tallest."""
    unit = kiosks.stall + kiosks.gap / kiosks.group
    count = max(1, int((right - left + kiosks.gap) / unit))
    gaps = kiosks.gap * ((count - 1) // kiosks.group)
    width = (right - left - gaps) / count
    roof = Roof(
        kiosks.roof,
        along_y=kiosks.roof in ("gable", "barrel"),
        eaves=0.0,
        verge=0.2,
        thickness=0.15,
    )
    if kiosks.roof == "hip":
        roof = Roof("hip", along_y=False, eaves=0.25, verge=0.0, thickness=0.15)
    if kiosks.roof == "shed":
        roof = Roof(
            "shed",
            along_y=False,
            eaves=0.25,
            verge=0.0,
            thickness=0.15,
            falling=True,
        )
    top = kiosks.height - (1.1 if kiosks.tower else 0.0)
    boxes = []
    x = left
    for k in range(count):
        high = top - (0.25 * (k % 2) if k != count // 2 else 0.0)
        wall = max(2.2, high - 0.32 * min(width, kiosks.depth))
        area = (x, front, x + width, front + kiosks.depth)
        boxes.append(
            Wing.at(area, wall_top=min(wall, high - 0.35), top=high, roof=roof)
        )
        x += width + kiosks.gap * ((k + 1) % kiosks.group == 0)
    return boxes


def _add_stall(kiosks: KioskRow, wing: Wing, boxes: list[Wing], k: int) -> None:
    """Adds a stall: a counter under an awning, or closed shutters."""
    openings = Openings(kiosks, wing, boxes)
    wall = wing.wall(0)
    material = ("stalls", "others")[k % 2]
    a, b = 0.3, wall.length - 0.3
    head = min(2.15, wing.wall_top - 0.25)
    if kiosks.chance(0.75):
        openings.add_reliefs(
            0, [Patch(x0=a, x1=b, z0=_COUNTER_M, z1=head, depth=0.7)]
        )
        shelf = wall.box(
            x=(a, b), y=(-0.3, 0.3), z=(_COUNTER_M - 0.08, _COUNTER_M)
        )
        kiosks.add_to("timber", shelf)
        if kiosks.arcade == 0.0:
            shade = canopies.awning(
                x0=a - 0.1, x1=b + 0.1, reach=1.3, z0=1.95, z1=head + 0.1
            )
            kiosks.add_to("awning", wall.place(shade))
    else:
        shutter = bays.gate(width=b - a, height=head, depth=0.12)
        openings.add_reliefs(0, shutter(a - 0.3, b + 0.3))
    door = bays.window(width=0.9, sill=0.05, head=2.0, depth=0.12)
    openings.add_bays(
        (2,), z=0.2, pitch=wall.length, choices=[door], margin=0.3
    )
    sign = boards.board(
        x0=a, x1=b, z0=head + 0.02, z1=wing.wall_top - 0.02, reach=0.1
    )
    kiosks.add_to("awning", wall.place(sign))
    bands = (foot_band(height=0.25, reach=0.05),)
    openings.enclose((0.12,), bands=bands, material=material)


def _add_lantern(kiosks: KioskRow, wing: Wing) -> None:
    """Adds a small square lantern with its own roof."""
    low = wing.wall_top
    top = kiosks.height
    body = outlines.square(*wing.center, 0.6)
    eaves = outlines.inset(body, -0.25)
    kiosks.add_to("others", solids.skirt(body, body, z0=low, z1=top - 0.7))
    kiosks.add_to(
        "roof", solids.tent(eaves, wing.center, z0=top - 0.72, z1=top)
    )


def _add_arcade(kiosks: KioskRow, xs: bays.Span, front: float) -> None:
    """Adds a lean-to roof on posts along the whole row."""
    a, b = xs
    low = 2.35
    y = front - kiosks.arcade
    top = min(2.9, kiosks.height - 0.4)
    line = [(y - 0.15, low + 0.15), (front + 0.05, top)]
    kiosks.add_to("roof", roofs.shell(line, start=a, end=b, thickness=0.12))
    for x in np.linspace(a + 0.15, b - 0.15, max(2, round((b - a) / 3.2))):
        post = solids.standing(x=around(x, 0.08), y=(y, y + 0.16), z1=low + 0.1)
        kiosks.add_to("timber", post)
    beam = solids.box(x=(a, b), y=(y, y + 0.16), z=(low - 0.15, low + 0.06))
    kiosks.add_to("timber", beam)
