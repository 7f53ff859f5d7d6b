"""The row of kiosks."""

import numpy as np

from worlds.city.facades import (
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
    roofs,
    solids,
)
from worlds.shapes import outlines

# Height of a stall's counter [m].
_COUNTER_M = 1.05
# Thickness of a counter [m].
_SHELF_M = 0.08
# Depth of doors and shutters behind the wall [m].
_RECESS_M = 0.12
# Depth of a stall behind its counter [m].
_NICHE_M = 0.7
# Share of the stalls that are open.
_OPEN_SHARE = 0.75
# Distance of counter and shutter from the ends of a stall [m].
_JAMB_M = 0.3
# Free strip beside the row [m].
_MARGIN_M = 0.5
# Depth of the free strip in front of stalls with awnings [m].
_FORECOURT_M = 2.2
# Least height of a row with a lantern [m].
_LANTERN_ROW_M = 4.6
# Height of a lantern above the stalls [m].
_LANTERN_M = 1.1
# Thickness of the roofs [m].
_ROOF_M = 0.15
# By how much every other stall is lower [m].
_STEP_M = 0.25
# Height of the beam on the posts of an arcade [m].
_ARCADE_M = 2.35
# Side of the square posts of an arcade [m].
_POST_M = 0.16
# Distance between the posts of an arcade, approximately [m].
_POST_PITCH_M = 3.2


class KioskRow(Building):
    """The row of kiosks: small stalls with counters behind a common arcade."""

    def draw(self) -> None:
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
        self.tower = self.height > _LANTERN_ROW_M and self.chance(0.6)

    def build(self) -> None:
        """Adds all parts of the kiosks, side by side along the front."""
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        front = y0 + _FORECOURT_M
        if self.arcade > 0:
            front = y0 + self.arcade + 0.5
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
    roof = _stall_roof(kiosks.roof)
    top = kiosks.height - (_LANTERN_M if kiosks.tower else 0.0)
    tallest = count // 2
    boxes = []
    x = left
    for k in range(count):
        is_lower = k % 2 == 1 and k != tallest
        high = top - _STEP_M if is_lower else top
        wall = max(2.2, high - 0.32 * min(width, kiosks.depth))
        wall_top = min(wall, high - 0.35)
        area = (x, front, x + width, front + kiosks.depth)
        boxes.append(Wing.at(area, wall_top=wall_top, top=high, roof=roof))
        ends_group = (k + 1) % kiosks.group == 0
        x += width + kiosks.gap if ends_group else width
    return boxes


def _stall_roof(kind: str) -> Roof:
    """Returns the roof of a stall; `kind` is the kind of roof, as in `Roof`."""
    if kind in ("hip", "shed"):
        return Roof(
            kind,
            eaves=0.25,
            verge=0.0,
            thickness=_ROOF_M,
            falling=kind == "shed",
        )
    return Roof(kind, along_y=True, eaves=0.0, verge=0.2, thickness=_ROOF_M)


def _add_stall(
    kiosks: KioskRow, wing: Wing, boxes: list[Wing], number: int
) -> None:
    """Adds a stall: a counter under an awning, or closed shutters."""
    openings = Openings(kiosks, wing, boxes)
    wall = wing.wall(0)
    start, end = _JAMB_M, wall.length - _JAMB_M
    head = min(2.15, wing.wall_top - 0.25)
    if kiosks.chance(_OPEN_SHARE):
        _add_counter(kiosks, openings, (start, end), head)
    else:
        shutter = bays.gate(width=end - start, height=head, depth=_RECESS_M)
        openings.add_reliefs(0, shutter(start - _JAMB_M, end + _JAMB_M))
    door = bays.window(width=0.9, sill=0.05, head=2.0, depth=_RECESS_M)
    openings.add_bays(
        (2,), z=0.2, pitch=wall.length, choices=[door], margin=0.3
    )
    sign = boards.board(
        x0=start, x1=end, z0=head + 0.02, z1=wing.wall_top - 0.02, reach=0.1
    )
    kiosks.add_to("awning", wall.place(sign))
    openings.enclose(
        (_RECESS_M,),
        bands=(foot_band(height=0.25, reach=0.05),),
        material="stalls" if number % 2 == 0 else "others",
    )


def _add_counter(
    kiosks: KioskRow, openings: Openings, across: bays.Span, head: float
) -> None:
    """Adds an open front with a counter; without an arcade, also an awning.

    `across` is the start and the end of the opening along the wall, and `head`
    the height of its top [m].
    """
    start, end = across
    wall = openings.wing.wall(0)
    niche = Patch(x0=start, x1=end, z0=_COUNTER_M, z1=head, depth=_NICHE_M)
    openings.add_reliefs(0, [niche])
    counter = wall.box(
        x=across, y=(-0.3, 0.3), z=(_COUNTER_M - _SHELF_M, _COUNTER_M)
    )
    kiosks.add_to("timber", counter)
    if kiosks.arcade == 0.0:
        awning = canopies.awning(
            x0=start - 0.1, x1=end + 0.1, reach=1.3, z0=1.95, z1=head + 0.1
        )
        kiosks.add_to("awning", wall.place(awning))


def _add_lantern(kiosks: KioskRow, wing: Wing) -> None:
    """Adds a small square lantern with its own roof."""
    top = kiosks.height
    body = outlines.square(*wing.center, half=0.6)
    eaves = outlines.inset(body, -0.25)
    walls = solids.skirt(body, body, z0=wing.wall_top, z1=top - 0.7)
    roof = solids.tent(eaves, wing.center, z0=top - 0.72, z1=top)
    kiosks.add_to("others", walls)
    kiosks.add_to("roof", roof)


def _add_arcade(kiosks: KioskRow, xs: bays.Span, front: float) -> None:
    """Adds a lean-to roof on posts along the whole row.

    `xs` is the least and the greatest x of the stalls, and `front` the y of
    their front [m].
    """
    left, right = xs
    low = _ARCADE_M
    top = min(2.9, kiosks.height - 0.4)
    y = front - kiosks.arcade
    line = [(y - 0.15, low + 0.15), (front + 0.05, top)]
    roof = roofs.shell(line, start=left, end=right, thickness=0.12)
    kiosks.add_to("roof", roof)
    depth = (y, y + _POST_M)
    count = max(2, round((right - left) / _POST_PITCH_M))
    for x in np.linspace(left + 0.15, right - 0.15, count):
        post = solids.standing(x=around(x, _POST_M / 2), y=depth, z1=low + 0.1)
        kiosks.add_to("timber", post)
    beam = solids.box(x=xs, y=depth, z=(low - 0.15, low + 0.06))
    kiosks.add_to("timber", beam)
