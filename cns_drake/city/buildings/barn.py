"""The barn or boat house."""

import numpy as np

from cns_drake.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    boards,
    free_stretches,
    outlines,
    solids,
    wing_roofs,
)
from cns_drake.city.facades.reliefs import Band, Patch

# Free strip around the walls, for eaves [m].
_MARGIN_M = 0.5
# Depth of the windows behind the wall [m].
_RECESS_M = 0.15


class Barn(Building):
    """The barn or boat house: timber boards, wide doors, a lean-to."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        width = min(site.width, site.depth)
        aisle = round(self.uniform(0.2, 0.28) * width, 2)
        self.roof = self.pick(("gambrel", "gable", "gable", "barrel"))
        # Height of the walls, as a share of the height of the ridge.
        self.wall = self.uniform(0.42, 0.58)
        # Depth of the jetty in front of a boat house; 0 for a barn.
        self.deck = self.pick((0.0, 0.0, 2.0)) if site.depth > 10.0 else 0.0
        self.door_width = self.uniform(2.6, 4.4, digits=2)
        self.door_height = self.uniform(2.4, 3.4, digits=2)
        # Width of the lean-to on one side; 0 for none.
        self.aisle = aisle if self.chance(0.6) and width > 9.0 else 0.0
        self.aisle_left = self.chance(0.5)
        # Distance between battens.
        self.batten = self.uniform(1.0, 1.6)
        self.ventilators = self.whole(0, 3)

    def build(self) -> None:
        """Adds all parts of the barn, which lies along the site's longer sides.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        along_y = y1 - y0 >= x1 - x0
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        front = y0 + _MARGIN_M + self.deck
        back = y1 - _MARGIN_M
        a, b, low, high = left, right, front, back
        if along_y:
            a += self.aisle * self.aisle_left
            b -= self.aisle * (not self.aisle_left)
        else:
            high -= self.aisle
        top = self.height - (0.7 if self.ventilators else 0.0)
        half = ((b - a) if along_y else (high - low)) / 2
        wall_top = max(2.3, self.wall * top)
        eaves = 0.35
        if self.roof == "barrel":
            # A vault is at most half a circle.
            eaves = 0.0
            wall_top = max(wall_top, top - 0.8 * half)
        roof = Roof(
            self.roof, along_y=along_y, eaves=eaves, verge=0.35, thickness=0.18
        )
        main = Wing.at((a, low, b, high), wall_top=wall_top, top=top, roof=roof)
        boxes = [main]
        if self.aisle > 1.5:
            boxes.append(_lean_to(self, main, (left, right, back)))
        for wing in boxes:
            _add_box(self, wing, boxes)
        _add_ventilators(self, main)
        if self.deck > 0:
            _add_jetty(self, (left, right), y0, front)


def _add_box(barn: Barn, wing: Wing, boxes: list[Wing]) -> None:
    """Adds one box of the barn: the main box with doors, or the lean-to."""
    openings = Openings(barn, wing, boxes)
    head = round(min(2.0, wing.wall_top - 0.3), 2)
    window = bays.window(width=0.9, sill=1.1, head=head, depth=_RECESS_M)
    openings.add_bays(range(4), z=1.0, pitch=3.2, choices=[window], margin=0.8)
    if wing is boxes[0]:
        for edge in (0,) if wing.roof.along_y else (3, 0):
            _add_doors(barn, wing, openings, edge)
    low = wing.wall_top + 0.5
    attic = wing_roofs.attic_window(
        width=1.0, z0=low, z1=low + 1.3, depth=_RECESS_M
    )
    openings.enclose(
        (_RECESS_M,), bands=(Band(z0=0.0, z1=0.3, depth=-0.06),), attic=attic
    )
    for edge in range(4):
        _add_battens(barn, wing, boxes, openings, edge)


def _lean_to(
    barn: Barn, main: Wing, limits: tuple[float, float, float]
) -> Wing:
    """Returns the lean-to against the long side of the barn."""
    left, right, back = limits
    along_y = main.roof.along_y
    high = main.wall_top + 0.1
    low = max(1.9, high - 0.3 * barn.aisle)
    high = max(high, low + 0.25)
    # The lean-to stands behind or beside the barn: the side to which its roof
    # falls.
    area = (main.x0 + 1.0, main.y1 - 0.05, main.x1 - 1.0, back)
    if along_y:
        a, b = main.x1 - 0.05, right
        if barn.aisle_left:
            a, b = left, main.x0 + 0.05
        area = (a, main.y0 + 0.8, b, main.y1 - 0.8)
    falling = not (along_y and barn.aisle_left)
    roof = Roof(
        "shed",
        along_y=along_y,
        eaves=0.3,
        verge=0.25,
        thickness=0.15,
        falling=falling,
    )
    return Wing.at(area, wall_top=low, top=high, roof=roof)


def _add_doors(barn: Barn, wing: Wing, openings: Openings, edge: int) -> None:
    """Adds a pair of braced doors that slide along the wall."""
    wall = wing.wall(edge)
    width = min(barn.door_width, 0.5 * wall.length)
    height = min(barn.door_height, wing.wall_top - 0.35)
    x = wall.length / 2
    openings.clear(
        edge, x0=x - width - 0.2, x1=x + width + 0.2, z0=0.0, z1=height + 0.4
    )
    if barn.deck > 0 and edge == 0:
        gap = Patch(
            x0=x - width / 2, x1=x + width / 2, z0=0.0, z1=height, depth=2.0
        )
        openings.replace_by_bay(
            edge, x=x, width=width + 0.4, bay=lambda a, b: [gap]
        )
        spots = (x - width, x + width / 2 + 0.05)
        half = width / 2 - 0.05
    else:
        spots = (x - width / 2, x + 0.03)
        half = width / 2 - 0.03
    for a in spots:
        b = a + half
        brace = (a + 0.1, 0.1, 0.2), (b - 0.1, 0.1, height - 0.1)
        frame = [
            boards.board(x0=a, x1=a + 0.18, z0=0.08, z1=height, reach=0.15),
            boards.board(x0=b - 0.18, x1=b, z0=0.08, z1=height, reach=0.15),
            boards.board(x0=a, x1=b, z0=height - 0.18, z1=height, reach=0.15),
            boards.board(x0=a, x1=b, z0=0.08, z1=0.26, reach=0.15),
            solids.beam(*brace, 0.1),
        ]
        leaf = boards.board(x0=a, x1=b, z0=0.08, z1=height, reach=0.1)
        barn.add_to("doors", wall.place(leaf))
        barn.add_to("trim", *(wall.place(m) for m in frame))
    barn.add_to(
        "trim",
        wall.box(
            x=(x - width - 0.1, x + width + 0.1),
            y=(0.0, 0.18),
            z=(height + 0.05, height + 0.18),
        ),
    )


def _add_battens(
    barn: Barn, wing: Wing, boxes: list[Wing], openings: Openings, edge: int
) -> None:
    """Adds upright battens on the free parts of a wall between openings."""
    wall = wing.wall(edge)
    reliefs = openings.layout(edge, wall.length)
    for a, b in free_stretches(wing, edge, boxes, z=0.5):
        for x, _ in bays.stretches(b - a, pitch=barn.batten, margin=0.12):
            u = a + x
            if any(r.x0 - 0.15 < u < r.x1 + 0.15 for r in reliefs):
                continue
            strip = boards.board(
                x0=u - 0.05, x1=u + 0.05, z0=0.3, z1=wing.wall_top, reach=0.05
            )
            barn.add_to("walls", wall.place(strip))


def _add_ventilators(barn: Barn, main: Wing) -> None:
    """Adds louvred ventilators on the ridge."""
    z = main.top
    for k in range(barn.ventilators):
        share = (k + 0.5) / barn.ventilators - 0.5
        x, y = main.center
        if main.roof.along_y:
            y += 0.8 * share * main.depth
        else:
            x += 0.8 * share * main.width
        barn.add_to(
            "walls", solids.post(x, y, half=0.45, z1=z + 0.3, z0=z - 0.6)
        )
        eaves = outlines.square(x, y, half=0.65)
        barn.add_to("roof", solids.tent(eaves, (x, y), z0=z + 0.3, z1=z + 0.7))


def _add_jetty(barn: Barn, xs: bays.Span, y0: float, front: float) -> None:
    """Adds a plank deck on posts in front of a boat house."""
    a, b = xs
    y = y0 + 0.1
    barn.add_to("doors", solids.box(x=(a, b), y=(y, front), z=(0.05, 0.3)))
    for x in np.linspace(a + 0.2, b - 0.2, 4).tolist():
        barn.add_to(
            "doors",
            solids.standing(x=around(x, 0.12), y=(y + 0.02, y + 0.26), z1=1.1),
        )
